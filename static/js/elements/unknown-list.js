/** Folders in the data directory without a database row; an admin adopts, leaves or discards each. */

import { adoptUnknown, discardUnknown, leaveUnknown, listUnknown } from "../api.js";
import { h } from "../dom.js";
import { Answers } from "../lib/answers.js";
import { ago, bytes, counted } from "../lib/format.js";
import { say, sayError } from "./toasts.js";

/** @typedef {import("../api-types").UnknownFolder} UnknownFolder */

export class UnknownList extends HTMLElement {
  #answers = new Answers();

  /** Reload the list; hidden while it is empty. */
  async load() {
    try {
      await this.#answers.take(listUnknown(), (all) => this.#draw(all));
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {UnknownFolder[]} all */
  #draw(all) {
    const left = all.filter((entry) => entry.left);
    const open = all.filter((entry) => !entry.left);
    this.hidden = !all.length;
    this.replaceChildren(
      h(
        "section",
        { class: "card stack", "aria-label": "Set aside" },
        h("h2", {}, "Set aside"),
        h("p", { class: "muted" }, WHY),
        h("ul", { class: "stack plain" }, ...open.map((entry) => this.#row(entry))),
        left.length
          ? h(
              "details",
              {},
              h("summary", {}, `${counted(left.length, "folder")} left in place`),
              h("ul", { class: "stack plain" }, ...left.map((entry) => this.#row(entry))),
            )
          : "",
      ),
    );
  }

  /** @param {UnknownFolder} entry */
  #row(entry) {
    const when = entry.changed === null ? "" : `changed ${ago(entry.changed, Date.now() / 1000)}`;
    const ofProject = entry.kind === "project" || entry.kind === "newer";
    const holds = [
      entry.recording ? "recording" : "",
      ofProject ? counted(entry.objects, "object") : "",
      entry.clicks ? counted(entry.clicks, "click") : "",
      entry.bundles ? counted(entry.bundles, "bundle") : "",
      bytes(entry.size_bytes),
      when,
    ];
    const adopt = h("button", { type: "button", class: "primary", disabled: Boolean(entry.why_not) }, "Adopt");
    adopt.setAttribute("aria-label", `Adopt ${entry.name}`);
    adopt.addEventListener("click", () => this.#do(adoptUnknown(entry.entry), `${entry.name} is adopted`));
    const leave = h("button", { type: "button", class: "quiet" }, "Leave it there");
    leave.addEventListener("click", () => this.#do(leaveUnknown(entry.entry), `${entry.name} stays where it is`));
    const discard = h("button", { type: "button", class: "quiet" }, "Discard…");
    discard.setAttribute("aria-label", `Discard ${entry.name}`);
    discard.addEventListener("click", () => {
      if (!confirm(`Delete ${entry.name}, ${bytes(entry.size_bytes)} of an upload? This cannot be undone.`)) return;
      this.#do(discardUnknown(entry.entry), `${entry.name} is deleted`);
    });
    return h(
      "li",
      {},
      h("h3", {}, entry.name, " ", h("span", { class: "chip" }, KINDS[entry.kind])),
      h("div", {}, holds.filter(Boolean).join(" · ")),
      h("div", { class: "muted" }, entry.path),
      entry.why_not ? h("div", { class: "muted" }, `Cannot be adopted: ${entry.why_not}`) : "",
      h("div", { class: "row" }, adopt, ofProject && !entry.left ? leave : "", entry.kind === "upload" ? discard : ""),
    );
  }

  /**
   * @param {Promise<unknown>} change
   * @param {string} done
   */
  async #do(change, done) {
    await change.then(() => say(done, { kind: "good" }), sayError);
    this.load();
  }
}

const WHY =
  "These folders are not in the database: it was lost, or an older copy was restored. Nothing is deleted automatically. Adopting " +
  "makes a project with its clicks, verdicts, corrections, comments, recording and bundles; what is newer than the database is " +
  "added to its project, and can be undone.";
const KINDS = { project: "project", newer: "newer than the database", upload: "upload", other: "no project" };
