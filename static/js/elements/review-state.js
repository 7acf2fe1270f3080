/** Review state of a project: who set it, and the possible transitions with their unmet conditions. */

import { ApiError, getFigures, getReview, getSystem, stepReview } from "../api.js";
import { h, LiveElement, renew } from "../dom.js";
import { Answers } from "../lib/answers.js";
import { ago, counted, duration } from "../lib/format.js";
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
    for (const type of ["project", "review", "comments", "you"])
      live.addEventListener(type, () => this.load(), { signal });
    this.load();
  }

  async load() {
    if (!this.project) return;
    try {
      const all = Promise.all([getReview(this.project), getFigures(this.project), getSystem()]);
      await this.#answers.take(all, ([status, figures, { role }]) => this.#draw(status, figures, role));
    } catch (error) {
      sayError(error);
    }
  }

  /**
   * @param {ReviewStatus} status
   * @param {Figures} figures
   * @param {string} role of the user
   */
  #draw(status, figures, role) {
    const by = status.at ? `${status.who}, ${ago(status.at, Date.now() / 1000)}` : "";
    renew(
      this.#body,
      h("div", { class: "row" }, stateChip(status.state), h("span", { class: "muted" }, by)),
      status.reason ? h("p", { class: "said" }, status.reason) : "",
      ...status.moves.map((move) => this.#move(status, move, role)),
      h("p", { class: "muted" }, cost(figures)),
    );
  }

  /**
   * @param {ReviewStatus} status
   * @param {ReviewMove} move
   * @param {string} role of the user
   */
  #move(status, move, role) {
    const refused = move.role === "reviewer" && role === "annotator" ? "A reviewer does this." : "";
    const onward = PLACES[move.to] > PLACES[status.state] && !move.unmet.length && !refused;
    const disabled = refused !== "";
    const button = h("button", { type: "button", class: onward ? "primary" : "", disabled, title: refused }, move.text);
    button.dataset.at = `move:${move.to}`;
    button.addEventListener("click", () => this.#step(status, move));
    const lines = [...(refused ? [refused] : []), ...move.unmet, ...move.notes];
    const unmet = lines.length ? h("ul", { class: "muted unmet" }, ...lines.map((line) => h("li", {}, line))) : null;
    return h("div", {}, button, unmet);
  }

  /**
   * Make a transition once all pending edits are stored; unmet conditions are checked again then. Where a reason is needed, its
   * box opens before the click returns: what is typed next must not run as shortcuts.
   * @param {ReviewStatus} seen
   * @param {ReviewMove} wanted
   */
  async #step(seen, wanted) {
    const checked = this.#checked(seen, wanted);
    const move = asksWhy(wanted) ? wanted : await checked;
    let reason = "";
    if (asksWhy(move)) {
      const label = move.needs_reason
        ? "What has to change?"
        : "Reason for going on with open points (kept in the history)";
      const later = checked.then((now) => ({ notes: now.unmet, required: asksWhy(now) }));
      const given = await askForText(move.text, label, { button: move.text, notes: move.unmet, later });
      if (given === null) return;
      reason = given;
    }
    await outbox.settled;
    try {
      await stepReview(this.project, { from_state: seen.state, to: move.to, reason });
      say(`The project is ${move.to} now`, { kind: "good" });
    } catch (error) {
      sayError(error);
      if (!(error instanceof ApiError)) return;
    }
    this.load();
  }

  /**
   * The wanted step with its conditions as they are once all edits are stored.
   * @param {ReviewStatus} seen
   * @param {ReviewMove} wanted
   * @returns {Promise<ReviewMove>}
   */
  async #checked(seen, wanted) {
    await outbox.settled;
    const status = await getReview(this.project).catch(() => seen); // a connection error is reported by the step itself
    return (status.state === seen.state && status.moves.find(({ to }) => to === wanted.to)) || wanted;
  }
}

/** Whether a step needs a written reason. @param {ReviewMove} move */
function asksWhy({ unmet, needs_reason }) {
  return unmet.length > 0 || needs_reason;
}

/** @param {Figures} figures */
function cost(figures) {
  const clicks = figures.clicks ? `Clicks and edits: ${figures.clicks}, for ${counted(figures.objects, "object")}` : "";
  const time =
    figures.upload_to_approval_s === null
      ? ""
      : `approved ${duration(figures.upload_to_approval_s)} after the upload or import began`;
  return [clicks, time].filter(Boolean).join(" · ");
}
