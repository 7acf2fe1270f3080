/**
 * What a person says about an object, sent through the outbox: verdicts, corrections, another mesh, taking it back.
 * Says "stored" {object, job} for every answer; job is the run that follows from it.
 */

import { uploadCandidate } from "../api.js";
import { changeOverride, giveVerdict, undoRedo } from "../changes.js";
import { askForText } from "../elements/ask-dialog.js";
import { say, sayError } from "../elements/toasts.js";
import { outbox } from "../outbox.js";

/** @typedef {import("../api-types").Candidate} Candidate */
/** @typedef {import("../api-types").OverridePatch} OverridePatch */
/** @typedef {import("../api-types").Reviewed} Reviewed */
/** @typedef {"accepted" | "rejected"} Verdict */

export const REVIEWERS = "A reviewer accepts, rejects and corrects; you can comment.";

export class Decisions extends EventTarget {
  #objects;

  /** @param {import("./objects.js").ReviewObjects} objects */
  constructor(objects) {
    super();
    this.#objects = objects;
  }

  /** Accept what is looked at, or go on where it is accepted: the key pressed twice takes nothing back, the button does. */
  accept() {
    const { group, candidate } = this.#objects;
    if (group?.accepted && group.accepted === candidate) this.#objects.stepToReview();
    else this.#onCandidate("accepted");
  }

  reject() {
    this.#onCandidate("rejected");
  }

  /**
   * Said again, it is taken back.
   * @param {Candidate} candidate
   * @param {Verdict} said
   */
  async judge(candidate, said) {
    const { group } = this.#objects;
    if (!group || !this.#may()) return;
    const again = candidate.verdict === said;
    const reason = said === "rejected" && !again ? await askWhy(candidate) : "";
    if (reason === null) return;
    const verdict = again ? /** @type {const} */ ("cleared") : said;
    const change = giveVerdict(this.#project, group, { candidate: candidate.id, verdict, reason, rerun: true });
    const answer = outbox.send(change);
    if (verdict === "accepted") this.#objects.accepting(group, candidate.id, answer);
    if ((await this.#report(answer)) || verdict !== "accepted") return;
    this.#objects.choose(group.object); // it was not stored: back to it
    await this.#objects.load();
  }

  /** Whether who looks may decide; says who may. */
  #may() {
    if (!this.#objects.judges) say(REVIEWERS);
    return this.#objects.judges;
  }

  /** @param {Partial<OverridePatch>} patch */
  correct(patch) {
    const { group } = this.#objects;
    if (group && this.#may()) this.#report(outbox.send(changeOverride(this.#project, group, patch)));
  }

  /** Another draw of candidates beside those that are there. */
  more() {
    const { group } = this.#objects;
    if (!group) return;
    if (group.can_regenerate) this.correct({ regenerate: group.override.regenerate + 1 });
    else say(`No further candidates of ${group.name} are made: choose among these or upload a mesh`);
  }

  /** A mesh of one's own. @param {File} file */
  upload(file) {
    const { group } = this.#objects;
    if (group) this.#report(uploadCandidate(this.#project, group, file));
  }

  /**
   * Of what was said here or seen here: where somebody else said something since, that is shown instead.
   * @param {"undo" | "redo"} which
   */
  async undoRedo(which) {
    const { object } = this.#objects;
    await outbox.settled; // what was said before is what it takes back
    const version = this.#objects.groups.find((group) => group.object === object)?.version;
    if (version === undefined) return;
    try {
      const wanted = { object, scope: /** @type {const} */ ("review"), version };
      const undone = await outbox.send(undoRedo(this.#project, which, wanted));
      this.#objects.stored(object, undone.version);
      say(`${which === "undo" ? "Undone" : "Redone"}: ${undone.text}`);
    } catch (error) {
      sayError(error);
    }
    await this.#objects.load();
  }

  get #project() {
    return this.#objects.project;
  }

  /** @param {Verdict} verdict */
  #onCandidate(verdict) {
    const { group, candidate } = this.#objects;
    const shown = group?.candidates.find(({ id }) => id === candidate);
    if (shown) this.judge(shown, verdict);
  }

  /**
   * @param {Promise<Reviewed>} answer
   * @returns {Promise<boolean>} whether it was stored; not where somebody else's is left as it is
   */
  async #report(answer) {
    try {
      const { text, job, group } = await answer;
      if (group) this.#objects.stored(group.object, group.version);
      say(text ?? "What is stored stays as it is", { kind: text ? "good" : "" });
      this.dispatchEvent(new CustomEvent("stored", { detail: { object: group?.object, job } }));
      await this.#objects.load();
      return Boolean(text);
    } catch (error) {
      sayError(error);
      return false;
    }
  }
}

/** @param {Candidate} candidate */
function askWhy({ id }) {
  return askForText(`Reject ${id}`, "Why? (optional)", { button: "Reject", required: false });
}
