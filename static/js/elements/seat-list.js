/** Seats (server processes that run jobs): current work and queue; an admin drains a seat before its machine is stopped. */

import { drainSeat, listSeats } from "../api.js";
import { h, LiveElement, renew } from "../dom.js";
import { Answers } from "../lib/answers.js";
import { ago, counted } from "../lib/format.js";
import { live } from "../live.js";
import { say, sayError } from "./toasts.js";

/** @typedef {import("../api-types").Seat} Seat */
/** @typedef {import("../api-types").Seats} Seats */
/** @typedef {import("../api-types").SeatJob} SeatJob */

const LOOK_MS = 5000; // polling: no event is sent when a seat starts or ends

export class SeatList extends LiveElement {
  #answers = new Answers();
  #waiting = h("p", { role: "status" });
  #rows = h("tbody", {});

  connected() {
    const titles = ["Machine", "Does", "Since", ""].map((text) => h("th", { scope: "col" }, text));
    this.replaceChildren(
      h("h2", {}, "Seats"),
      this.#waiting,
      h("table", {}, h("thead", {}, h("tr", {}, ...titles)), this.#rows),
    );
    live.addEventListener("job", () => this.#load(), { signal: this.signal });
    const timer = setInterval(() => this.#load(), LOOK_MS);
    this.signal.addEventListener("abort", () => clearInterval(timer));
    this.#load();
  }

  async #load() {
    try {
      await this.#answers.take(listSeats(this.signal), (seats) => this.#show(seats));
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {Seats} seats */
  #show({ waiting, shared, seats }) {
    const text = waiting ? `${counted(waiting, "job")} in the queue` : "No waiting jobs";
    if (this.#waiting.textContent !== text) this.#waiting.textContent = text;
    renew(this.#rows, ...seats.map((seat) => this.#row(seat, shared)));
  }

  /** @param {Seat} seat @param {boolean} shared */
  #row(seat, shared) {
    const { id, host, process, here, began, draining, version } = seat;
    const name = `${host}, process ${process}`;
    const button = h("button", { type: "button", class: "quiet" }, draining ? "Take jobs again" : "Drain");
    button.setAttribute("aria-label", draining ? `Let ${name} take jobs again` : `Drain ${name}`);
    button.dataset.at = `drain:${id}`;
    button.addEventListener("click", () => this.#drain(id, name, !draining).catch(sayError));
    return h(
      "tr",
      {},
      h("th", { scope: "row", title: version }, name, here ? h("span", { class: "muted" }, " (this server)") : ""),
      h("td", {}, ...work(seat)),
      h("td", { class: "muted" }, ago(began, Date.now() / 1000)),
      h("td", {}, shared && seat.jobs_at_a_time ? button : ""),
    );
  }

  /** @param {number} id @param {string} name @param {boolean} draining */
  async #drain(id, name, draining) {
    await this.#answers.take(drainSeat(id, draining), (seats) => this.#show(seats));
    say(draining ? `${name} takes no further job` : `${name} takes jobs again`, { kind: "good" });
  }
}

/** @param {Seat} seat */
function work({ jobs, jobs_at_a_time, draining, silent_s }) {
  const idle = jobs_at_a_time ? (draining ? "drained" : "idle") : "serves pages";
  const lines = jobs.map((job) =>
    h("div", {}, h("a", { href: `/p/${job.project_id}/run` }, job.project_name), doing(job)),
  );
  const silent = silent_s > 20 ? h("div", { class: "chip warn" }, `silent for ${Math.round(silent_s)} s`) : "";
  return [
    ...(lines.length ? lines : [idle]),
    draining && lines.length ? h("div", { class: "muted" }, "draining") : "",
    silent,
  ];
}

/** @param {SeatJob} job */
function doing({ kind, stage, progress, objects }) {
  const part = objects.length ? `helps: ${objects.join(", ")}` : `${Math.round(progress * 100)} %`;
  return h("span", { class: "muted" }, ` ${stage || kind}, ${part}`);
}
