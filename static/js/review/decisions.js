/**
 * Decisions about an object, sent through the outbox: verdicts, corrections, mesh uploads, undo and redo.
 * Emits "stored" {object, job} for every response, `job` being the run it started, and "undone" after an undo or redo.
 */

import { lookAtMesh, startRun, uploadCandidate } from "../api.js";
import { changeFront, changeMade, changeOverride, giveVerdict, undoRedo } from "../changes.js";
import { askForText } from "../elements/ask-dialog.js";
import { askToUseMesh } from "../elements/mesh-dialog.js";
import { say, sayError } from "../elements/toasts.js";
import { copiedWords } from "../lib/copied.js";
import { withLimit } from "../lib/joints.js";
import { withMark } from "../lib/opening-marks.js";
import { outbox } from "../outbox.js";

/** @typedef {import("../api-types").Candidate} Candidate */
/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */
/** @typedef {import("../api-types").OverridePatch} OverridePatch */
/** @typedef {import("../api-types").Reviewed} Reviewed */
/** @typedef {"accepted" | "rejected"} Verdict */

export const REVIEWERS = "A reviewer accepts, rejects and corrects; you can comment.";

export class Decisions extends EventTarget {
  #objects;
  #marking = Promise.resolve();

  /** @param {import("./objects.js").ReviewObjects} objects */
  constructor(objects) {
    super();
    this.#objects = objects;
  }

  /** Accept the shown candidate, or go on if already accepted: unlike the button, a second key press clears nothing. */
  accept() {
    const { group, candidate } = this.#objects;
    if (group?.accepted && group.accepted === candidate) this.#objects.stepToReview();
    else this.#onCandidate("accepted");
  }

  reject() {
    this.#onCandidate("rejected");
  }

  /**
   * Give a verdict; giving the same one again clears it.
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
    this.#objects.choose(group.object); // not stored: return to the object
    await this.#objects.load();
  }

  /** Whether the user may decide; shows a message if not. */
  #may() {
    if (!this.#objects.judges) say(REVIEWERS);
    return this.#objects.judges;
  }

  /** @param {Partial<OverridePatch>} patch */
  correct(patch) {
    const { group } = this.#objects;
    if (group && this.#may()) this.#report(outbox.send(changeOverride(this.#project, group, patch)));
  }

  /**
   * Mark how far a leaf is open in a frame; null removes the mark. With `stops` it opens no further: `value` is also its limit.
   * Marks are stored one at a time, as each adds to the others.
   * @param {{ leaf: import("../api-types").Leaf, frame: number, value: number | null, stops: boolean, alone: boolean }} mark
   */
  mark({ leaf, frame, value, stops, alone }) {
    const { object } = this.#objects;
    if (!this.#may()) return;
    this.#marking = this.#marking.then(async () => {
      await outbox.settled;
      const group = this.#objects.groups.find((one) => one.object === object);
      if (!group) return;
      const states = withMark(group.override.states, leaf, frame, value);
      const limit = stops ? withLimit(group.override, leaf.joint, alone, value) : {};
      await this.#report(outbox.send(changeOverride(this.#project, group, { states, ...limit })));
    });
  }

  /**
   * Copy a correction of the chosen object to others, in one run; each copy can be undone at its object.
   * @param {Partial<OverridePatch>} patch
   * @param {number[]} to
   */
  async copy(patch, to) {
    if (!this.#may()) return;
    const others = this.#objects.groups.filter((one) => to.includes(one.object) && differs(one, patch));
    if (!others.length) return say("They have it already");
    let job = null;
    try {
      for (const [k, one] of others.entries()) {
        const rerun = k === others.length - 1;
        const stored = await outbox.send(changeOverride(this.#project, one, { ...patch, rerun }));
        if (stored.group) this.#objects.stored(one.object, stored.group.version);
        job = stored.job ?? job;
      }
      say(`Copied ${copiedWords(patch)} to ${others.map(({ name }) => name).join(", ")}`, { kind: "good" });
    } catch (error) {
      sayError(error);
    }
    this.dispatchEvent(new CustomEvent("stored", { detail: { object: others[0]?.object, job } }));
    await this.#objects.load();
  }

  /** Change the category and start a run; results stay until that run is done. @param {string} category */
  async categorise(category) {
    const { group } = this.#objects;
    if (!group || !this.#may()) return;
    try {
      await outbox.send(
        changeFront(this.#project, group.object, { category }, undefined, { category: group.category }),
      );
      say(`${group.name} is a ${category} from the next run on`, { kind: "good" });
      const job = await startRun(this.#project);
      this.dispatchEvent(new CustomEvent("stored", { detail: { object: group.object, job } }));
      await this.#objects.load();
    } catch (error) {
      sayError(error);
    }
  }

  /**
   * Set the category whose body and joints to use; with a custom category, for all objects of that category.
   * @param {string | null} template
   */
  async buildAs(template) {
    const { group, groups, categories } = this.#objects;
    if (!group || !this.#may()) return;
    const isOwn = !categories.some(({ name }) => name === group.category);
    const alike = groups.filter(
      ({ object, category }) => object === group.object || (isOwn && category === group.category),
    );
    for (const one of alike)
      await this.#report(outbox.send(changeOverride(this.#project, one, { built_as: template })));
  }

  /**
   * @param {{ run_name: string, override?: import("../api-types").OverrideData }} item made from the scan
   * @param {Partial<OverridePatch>} patch
   */
  correctMade(item, patch) {
    if (this.#may()) this.#report(outbox.send(changeMade(this.#project, item, patch)));
  }

  /** Generate further candidates, in addition to the existing ones. */
  more() {
    const { group } = this.#objects;
    if (!group) return;
    if (group.can_regenerate) this.correct({ regenerate: group.override.regenerate + 1 });
    else say(`No further candidates of ${group.name} are made: choose among these or upload a mesh`);
  }

  /** Upload a mesh, after the user has seen and confirmed it. @param {File} file */
  async upload(file) {
    const { group } = this.#objects;
    if (!group || !this.#may()) return;
    const look = (/** @type {AbortSignal} */ signal) => lookAtMesh(this.#project, group.object, file, signal);
    if (await askToUseMesh(file, group.name, look)) await this.#report(uploadCandidate(this.#project, group, file));
  }

  /**
   * Undo or redo a change of the version shown here; if somebody changed the object since, reload it instead.
   * @param {"undo" | "redo"} which
   */
  async undoRedo(which) {
    const { object } = this.#objects;
    await outbox.settled; // undo applies to the last edit, which must be stored first
    const version = this.#objects.groups.find((group) => group.object === object)?.version;
    if (version === undefined) return;
    try {
      const wanted = { object, scope: /** @type {const} */ ("review"), version };
      const undone = await outbox.send(undoRedo(this.#project, which, wanted));
      this.#objects.stored(object, undone.version);
      say(`${which === "undo" ? "Undone" : "Redone"}: ${undone.text}`);
      this.dispatchEvent(new Event("undone"));
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
   * @returns {Promise<boolean>} whether it was stored; false if another person's value was kept
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

/** Whether a patch would change the object's override. @param {CandidateGroup} group @param {Partial<OverridePatch>} patch */
function differs({ override }, patch) {
  const said = new Map(Object.entries(override));
  return Object.entries(patch).some(([key, value]) => JSON.stringify(said.get(key)) !== JSON.stringify(value));
}

/** @param {Candidate} candidate */
function askWhy({ id }) {
  return askForText(`Reject ${id}`, "Why? (optional)", { button: "Reject", required: false });
}
