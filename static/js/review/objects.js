/**
 * What there is to review: the objects with their candidates, the scene, the certificate; which of them is looked at.
 * Says "change" when any of it is to be drawn anew, "choose" when another object is looked at.
 */

import { getCertificate, getScene, getSystem, listCandidates } from "../api.js";
import { sayError } from "../elements/toasts.js";
import { Answers } from "../lib/answers.js";

/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */
/** @typedef {import("../api-types").Certificate} Certificate */
/** @typedef {import("../api-types").SceneItem} SceneItem */

const NONE = -1;

export class ReviewObjects extends EventTarget {
  project = "";
  /** The object that is looked at, and which of its candidates. */
  object = NONE;
  candidate = "";
  /** @type {CandidateGroup[]} */
  groups = [];
  /** @type {SceneItem[]} */
  items = [];
  /** @type {Certificate | null} */
  certificate = null;
  /** Whether who looks may accept, reject and correct. */
  judges = true;
  /** Objects that were accepted here and are not stored yet, with the candidate. @type {Map<number, string>} */
  #accepting = new Map();
  #answers = new Answers();

  /** @param {number} [first] the object to look at when none is */
  async load(first = this.object) {
    try {
      const orNone = (/** @type {unknown} */ _) => null; // there is no scene or certificate before the first run
      const all = Promise.all([
        listCandidates(this.project),
        getScene(this.project).catch(orNone),
        getCertificate(this.project).catch(orNone),
        getSystem(),
      ]);
      await this.#answers.take(all, ([groups, scene, certificate, { role }]) => {
        this.judges = role !== "annotator";
        this.groups = groups.map((group) => this.#asSaid(group));
        this.items = scene?.items ?? [];
        this.certificate = certificate;
        if (!this.group) this.choose((groups.find(({ object }) => object === first) ?? groups[0])?.object ?? NONE);
        this.#say("change");
      });
    } catch (error) {
      sayError(error);
    }
  }

  get group() {
    return this.groups.find(({ object }) => object === this.object);
  }

  get item() {
    return this.items.find(({ object }) => object === this.object);
  }

  /** The object's number; null when there is none. */
  get number() {
    return this.object === NONE ? null : this.object;
  }

  /** @param {number} object */
  choose(object) {
    this.object = object;
    this.candidate = this.group?.chosen ?? "";
    this.#say("choose");
    this.#say("change");
  }

  /** @param {string} candidate of this object */
  look(candidate) {
    this.candidate = candidate;
    this.#say("change");
  }

  /** To the next one or the one before. @param {1 | -1} by */
  step(by) {
    const at = this.groups.findIndex(({ object }) => object === this.object);
    const next = this.groups[(at + by + this.groups.length) % Math.max(this.groups.length, 1)];
    if (next) this.choose(next.object);
  }

  /** To the next one that nobody accepted yet; stays when all are. */
  stepToReview() {
    const at = this.groups.findIndex(({ object }) => object === this.object);
    const left = [...this.groups.slice(at + 1), ...this.groups.slice(0, at)].find(({ accepted }) => !accepted);
    if (left) this.choose(left.object);
  }

  /**
   * Take it as accepted and go on at once: the outbox keeps what was said, and the next key is meant for what comes next.
   * @param {CandidateGroup} group
   * @param {string} candidate
   * @param {Promise<unknown>} answer
   */
  accepting(group, candidate, answer) {
    const stored = () => this.#accepting.delete(group.object);
    this.#accepting.set(group.object, candidate);
    answer.then(stored, stored);
    this.groups = this.groups.map((one) => this.#asSaid(one));
    if (this.object === group.object) this.stepToReview();
    this.#say("change");
  }

  /**
   * What was said here is stored: what is said next is about that version.
   * @param {number} object
   * @param {number} version
   */
  stored(object, version) {
    this.groups = this.groups.map((one) => (one.object === object ? { ...one, version } : one));
  }

  /** With what was said here after it was asked for. @param {CandidateGroup} group */
  #asSaid(group) {
    const known = this.groups.find(({ object }) => object === group.object)?.version ?? 0;
    const accepted = this.#accepting.get(group.object) ?? group.accepted;
    return { ...group, accepted, version: Math.max(known, group.version) };
  }

  /** @param {string} type */
  #say(type) {
    this.dispatchEvent(new Event(type));
  }
}
