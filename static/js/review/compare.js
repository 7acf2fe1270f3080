/**
 * Side-by-side view of an object's candidates, rotated together, with the differences of each from one of them and their source
 * crops. Emits "show-candidate" with a candidate, "judge" {candidate, said}, "seek-photo" with a frame.
 */

import { getDifferences } from "../api.js";
import { h, LiveElement, renew, slider, spinner } from "../dom.js";
import { sayError } from "../elements/toasts.js";
import { Answers } from "../lib/answers.js";
import { sheetOf } from "../lib/crop-view.js";
import { differs, TURNS, turnedBy } from "../lib/turntable.js";
import { doubts, figures, ranked, verdict } from "./candidates.js";

/** @typedef {import("../api-types").Candidate} Candidate */
/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */
/** @typedef {import("../api-types").Differences} Differences */

const SPIN_MS = 110;
const CROP = { width: 96, height: 72 };

export class CandidateCompare extends LiveElement {
  project = "";
  judges = true;
  #answers = new Answers();
  /** @type {CandidateGroup | undefined} */
  #group;
  #against = "";
  /** @type {Differences | null} */
  #found = null;
  #drawn = ""; // key of the cards drawn
  #spin = 0; // timer of the rotation; 0 while stopped
  #turn = h("input", {
    type: "range",
    min: "0",
    max: String(TURNS - 1),
    value: "0",
    "aria-label": "Turn all candidates",
  });
  #spinning = h("button", { type: "button", "aria-pressed": "false", onClick: () => this.spin() }, "Spin");
  #marked = h("input", { type: "checkbox", checked: true });
  #other = h("select", { "aria-label": "Compare with" });
  #tools = h("div", { class: "bar", hidden: true });
  #why = h("p", { class: "why" });
  #legend = h("p", { class: "muted legend" });
  #cards = h("div", { class: "cards" }, spinner("Loading the candidates…"));
  #crops = h("div", { class: "crops" });

  connected() {
    const { signal } = this;
    this.#turn.addEventListener("input", () => this.#face(), { signal });
    this.#marked.addEventListener("change", () => this.#draw(), { signal });
    this.#other.addEventListener("change", () => this.#compareWith(this.#other.value), { signal });
    this.#cards.addEventListener("pointerdown", (event) => this.#drag(event), { signal });
    signal.addEventListener("abort", () => this.#stop());
    this.#tools.replaceChildren(
      slider("Turn", this.#turn),
      this.#spinning,
      h("span", { class: "spring" }),
      h("label", {}, this.#marked, "Mark what differs from"),
      this.#other,
    );
    this.replaceChildren(this.#tools, this.#why, this.#legend, this.#cards, this.#crops);
  }

  /** @param {CandidateGroup | undefined} group */
  async show(group) {
    const other = group?.object !== this.#group?.object;
    this.#group = group;
    if (other || !group?.candidates.some(({ id }) => id === this.#against))
      await this.#compareWith(group?.chosen ?? "");
    else this.#draw();
  }

  /** Start or stop the automatic rotation. */
  spin() {
    if (this.#spin) return this.#stop();
    this.#spinning.setAttribute("aria-pressed", "true");
    this.#spin = window.setInterval(() => this.#turnTo(Number(this.#turn.value) + 1), SPIN_MS);
  }

  #stop() {
    window.clearInterval(this.#spin);
    this.#spin = 0;
    this.#spinning.setAttribute("aria-pressed", "false");
  }

  /** @param {string} against */
  async #compareWith(against) {
    this.#against = against;
    this.#found = null;
    this.#draw();
    const group = this.#group;
    if (!group) return;
    try {
      await this.#answers.take(getDifferences(this.project, group.object, against), (found) => {
        if (this.#group?.object !== group.object) return;
        this.#found = found;
        this.#draw();
      });
    } catch (error) {
      sayError(error);
    }
  }

  #draw() {
    const group = this.#group;
    const drawn = JSON.stringify([group, this.#against, this.#found, this.#marked.checked, this.judges]);
    if (drawn === this.#drawn) return;
    this.#drawn = drawn;
    this.#other.replaceChildren(
      ...(group?.candidates ?? []).map(({ id }) =>
        h("option", { value: id, selected: id === this.#against }, id === group?.chosen ? `${id}, which is used` : id),
      ),
    );
    this.#why.textContent = group?.reason ?? "";
    this.#legend.hidden = this.#tools.hidden = !group;
    this.#legend.textContent = `Drag a picture, or use the slider: all turn together. ${this.#explained()}`;
    renew(this.#cards, ...(group ? ranked(group).map((one) => this.#card(group, one)) : [nothing()]));
    renew(this.#crops, ...this.#cropped());
    this.#face();
  }

  #explained() {
    if (!this.#marked.checked || !this.#found) return "";
    const { tolerance, longest_m: longest } = this.#found;
    const far =
      longest === null ? `${100 * tolerance} % of the longest side` : `${Math.round(1000 * tolerance * longest)} mm`;
    return `Orange: more than ${far} away from ${this.#against}, with their fronts aligned.`;
  }

  /** @param {CandidateGroup} group @param {Candidate} candidate */
  #card(group, candidate) {
    const { id } = candidate;
    const against = this.#marked.checked && id !== this.#against ? this.#against : "";
    const query = new URLSearchParams({
      against,
      v: new URL(candidate.thumbnail, location.href).searchParams.get("v") ?? "",
    });
    const picture = h("div", { class: "turntable waiting", role: "img", "aria-label": `${id} from ${TURNS} sides` });
    picture.style.backgroundImage = `url("${candidate.thumbnail}")`; // until the turntable images are loaded
    const strip = Object.assign(new Image(), { src: `${candidate.thumbnail.split(".png")[0]}/turns.png?${query}` });
    strip.onload = () => {
      picture.style.backgroundImage = `url("${strip.src}")`;
      picture.classList.remove("waiting");
    };
    const found = this.#found?.candidates.find((one) => one.candidate === id);
    const show = h("button", { type: "button", class: "quiet" }, "Show in 3D");
    show.dataset.at = `show:${id}`;
    show.addEventListener("click", () => this.emit("show-candidate", candidate));
    /** @type {import("./candidates.js").Told} */
    const told = {
      judges: this.judges,
      show: () => {},
      verdict: (_, said) => this.emit("judge", { candidate, said }),
    };
    return h(
      "article",
      { class: "compared", "aria-label": id },
      picture,
      h(
        "div",
        { class: "row" },
        h("strong", {}, id),
        id === group.chosen ? h("span", { class: "chip good" }, "★ used") : "",
        h("span", { class: "grow" }),
        show,
      ),
      candidate.assumes ? h("div", { class: "assumes" }, candidate.assumes) : "",
      h(
        "p",
        { class: "off" },
        id === this.#against ? "The others are compared with this one." : found ? differs(found, this.#found) : "…",
      ),
      h("p", { class: "muted" }, figures(candidate)),
      doubts(candidate),
      h("div", { class: "verdicts" }, verdict(candidate, "accepted", told), verdict(candidate, "rejected", told)),
    );
  }

  #cropped() {
    const crops = this.#found?.crops ?? [];
    if (!crops.length) return [];
    return [h("h3", {}, "Made from these crops"), h("div", { class: "row" }, ...crops.map((crop) => this.#crop(crop)))];
  }

  /** @param {import("../api-types").Crop} crop */
  #crop({ frame, width, height, box }) {
    const sheet = sheetOf({ width, height }, CROP, box);
    const image = h("img", { src: `/media/${this.project}/frames/${frame}.jpg?w=960`, alt: "", loading: "lazy" });
    for (const side of /** @type {const} */ (["left", "top", "width", "height"]))
      image.style[side] = `${sheet[side]}px`;
    const uses = (this.#group?.candidates ?? []).filter(({ frames }) => frames.includes(frame)).map(({ id }) => id);
    const label = `Frame ${frame}, of which ${uses.join(", ")} ${uses.length === 1 ? "was" : "were"} made`;
    const button = h("button", { type: "button", class: "source-crop", title: label, "aria-label": label }, image);
    button.dataset.at = `crop:${frame}`;
    button.addEventListener("click", () => this.emit("seek-photo", frame));
    return button;
  }

  /** @param {number} turn */
  #turnTo(turn) {
    this.#turn.value = String(((turn % TURNS) + TURNS) % TURNS);
    this.#face();
  }

  /** Show the same side of all candidates. */
  #face() {
    const share = Number(this.#turn.value) / (TURNS - 1);
    this.#turn.setAttribute("aria-valuetext", `${Math.round((360 * Number(this.#turn.value)) / TURNS)} degrees`);
    this.style.setProperty("--side", `${100 * share}%`);
  }

  /** Rotate all candidates by a drag on one picture. @param {PointerEvent} event */
  #drag(event) {
    const picture = event.target;
    if (!(picture instanceof HTMLElement) || !picture.classList.contains("turntable")) return;
    this.#stop();
    event.preventDefault();
    const [start, x, ended] = [Number(this.#turn.value), event.clientX, new AbortController()];
    const signal = AbortSignal.any([ended.signal, this.signal]);
    picture.setPointerCapture(event.pointerId);
    picture.addEventListener("pointermove", (move) => this.#turnTo(turnedBy(start, move.clientX - x)), { signal });
    for (const type of ["pointerup", "pointercancel"]) picture.addEventListener(type, () => ended.abort(), { signal });
  }
}

function nothing() {
  return h(
    "p",
    { class: "muted" },
    "Choose an object that was clicked: what was made from the scan has no candidates.",
  );
}
