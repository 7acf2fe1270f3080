/** Review state of a project: who set it, and the possible transitions with their unmet conditions. */

import { ApiError, getFigures, getReview, stepReview } from "../api.js";
import { h, LiveElement, renew } from "../dom.js";
import { Answers } from "../lib/answers.js";
import { ago, duration } from "../lib/format.js";
import { live } from "../live.js";
import { outbox } from "../outbox.js";
import { stateChip } from "../state-chip.js";
import { askForText } from "./ask-dialog.js";
import { say, sayError } from "./toasts.js";

/** @typedef {import("../api-types").ReviewStatus} ReviewStatus */
/** @typedef {import("../api-types").ReviewMove} ReviewMove */
/** @typedef {import("../api-types").Figures} Figures */

/** Progress of each state towards approval. */
const PLACES = { draft: 0, "changes requested": 0, ready: 1, "in review": 2, approved: 3 };

export class ReviewState extends LiveElement {
  project = "";
  #answers = new Answers();
  #body = h("section", { class: "review-state stack", "aria-label": "State of the review" });

  connected() {
    this.replaceChildren(this.#body);
    const { signal } = this;
    for (const type of ["project", "review", "comments"]) live.addEventListener(type, () => this.load(), { signal });
    this.load();
  }

  async load() {
    if (!this.project) return;
    try {
      const both = Promise.all([getReview(this.project), getFigures(this.project)]);
      await this.#answers.take(both, ([status, figures]) => this.#draw(status, figures));
    } catch (error) {
      sayError(error);
    }
  }

  /**
   * @param {ReviewStatus} status
   * @param {Figures} figures
   */
  #draw(status, figures) {
    const by = status.at ? `${status.who}, ${ago(status.at, Date.now() / 1000)}` : "";
    renew(
      this.#body,
      h("div", { class: "row" }, stateChip(status.state), h("span", { class: "muted" }, by)),
      status.reason ? h("p", { class: "said" }, status.reason) : "",
      ...status.moves.map((move) => this.#move(status, move)),
      h("p", { class: "muted" }, cost(figures)),
    );
  }

  /**
   * @param {ReviewStatus} status
   * @param {ReviewMove} move
   */
  #move(status, move) {
    const onward = PLACES[move.to] > PLACES[status.state] && !move.unmet.length;
    const button = h("button", { type: "button", class: onward ? "primary" : "" }, move.text);
    button.dataset.at = `move:${move.to}`;
    button.addEventListener("click", () => this.#step(status, move));
    const lines = [...move.unmet, ...move.notes];
    const unmet = lines.length ? h("ul", { class: "muted unmet" }, ...lines.map((line) => h("li", {}, line))) : null;
    return h("div", {}, button, unmet);
  }

  /**
   * Make a transition once all pending edits are stored; unmet conditions are checked again then.
   * @param {ReviewStatus} seen
   * @param {ReviewMove} wanted
   */
  async #step(seen, wanted) {
    await outbox.settled;
    const status = await getReview(this.project).catch(() => seen); // a connection error is reported below
    const move = (status.state === seen.state && status.moves.find(({ to }) => to === wanted.to)) || wanted;
    let reason = "";
    if (move.unmet.length || move.needs_reason) {
      const label = move.unmet.length
        ? "Reason for going on with open points (kept in the history)"
        : "What has to change?";
      const given = await askForText(move.text, label, { button: move.text, notes: move.unmet });
      if (!given) return;
      reason = given;
    }
    try {
      await stepReview(this.project, { from_state: seen.state, to: move.to, reason });
      say(`The project is ${move.to} now`, { kind: "good" });
    } catch (error) {
      sayError(error);
      if (!(error instanceof ApiError)) return;
    }
    this.load();
  }
}

/** @param {Figures} figures */
function cost(figures) {
  const clicks = !figures.clicks_per_object ? "" : `${figures.clicks_per_object.toFixed(1)} clicks an object`;
  const time =
    figures.upload_to_approval_s === null
      ? ""
      : `approved ${duration(figures.upload_to_approval_s)} after the upload or import began`;
  return [clicks, time].filter(Boolean).join(" · ");
}
