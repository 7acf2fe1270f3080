/**
 * What there is to review: the objects with their candidates, the scene, the certificate; which of them is looked at.
 * Says "change" when any of it is to be drawn anew, "choose" when another object is looked at.
 */

import { getCertificate, getScene, getSystem, listCandidates } from "../api.js";
import { sayError } from "../elements/toasts.js";
import { Answers } from "../lib/answers.js";
import { findingsAbout } from "../lib/findings.js";
import { riskiestFirst, riskOf } from "../lib/risk.js";

/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */
/** @typedef {import("../api-types").Certificate} Certificate */
/** @typedef {import("../api-types").SceneItem} SceneItem */

const NONE = -1;

export class ReviewObjects extends EventTarget {
  project = "";
  /** The object that is looked at, and which of its candidates. */
  object = NONE;
  candidate = "";
  /** Of what was made from the scan, the one that is looked at instead, by its name in the scene; empty where none is. */
  madeName = "";
  /** Whether those come first that something speaks against. */
  byRisk = false;
  /** What speaks against each object. @type {Map<number, import("../lib/risk.js").Risk>} */
  risks = new Map();
  /** Objects that take over together what is said of the chosen one. @type {Set<number>} */
  selected = new Set();
  /** What is hidden in the scene, by names there. @type {Set<string>} */
  hidden = new Set();
  /** @type {import("../api-types").SceneSummary["left_out"]} */
  leftOut = [];
  /** Corrected, but not made by the last run. @type {import("../api-types").SceneSummary["unused"]} */
  unused = [];
  /** @type {CandidateGroup[]} */
  groups = [];
  /** @type {SceneItem[]} */
  items = [];
  /** @type {Certificate | null} */
  certificate = null;
  /** @type {import("../api-types").Category[]} */
  categories = [];
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
      await this.#answers.take(all, ([groups, scene, certificate, { role, categories }]) => {
        this.judges = role !== "annotator";
        this.categories = categories;
        this.groups = groups.map((group) => this.#asSaid(group));
        this.items = scene?.items ?? [];
        this.leftOut = scene?.left_out ?? [];
        this.unused = scene?.unused ?? [];
        if (!this.made.some(({ run_name }) => run_name === this.madeName)) this.madeName = "";
        this.certificate = certificate;
        this.risks = this.#weighed();
        if (!this.group && !this.madeName)
          this.choose((groups.find(({ object }) => object === first) ?? groups[0])?.object ?? NONE);
        this.#say("change");
      });
    } catch (error) {
      sayError(error);
    }
  }

  /** The objects in the order in which they are reviewed. */
  get ordered() {
    return this.byRisk ? riskiestFirst(this.groups, this.risks) : this.groups;
  }

  /** @param {boolean} byRisk */
  order(byRisk) {
    this.byRisk = byRisk;
    this.#say("change");
  }

  #weighed() {
    const names = this.groups.map(({ run_name }) => run_name);
    const byNumber = new Map(this.items.map((item) => [item.object, item]));
    return new Map(
      this.groups.map((group) => {
        const findings = findingsAbout(this.certificate, group.run_name, names);
        return [group.object, riskOf(group, byNumber.get(group.object), findings)];
      }),
    );
  }

  get group() {
    return this.madeName ? undefined : this.groups.find(({ object }) => object === this.object);
  }

  get item() {
    if (this.madeName) return this.items.find(({ run_name }) => run_name === this.madeName);
    return this.items.find(({ object }) => object === this.object);
  }

  /** What a run made from the scan, but for what is left out of it. */
  get made() {
    const clicked = new Set(this.groups.map(({ object }) => object));
    return this.items.filter(({ object, override }) => (object === null || !clicked.has(object)) && !override.left_out);
  }

  /** The object's number; null when there is none. */
  get number() {
    return this.madeName || this.object === NONE ? null : this.object;
  }

  /** @param {string} name of what was made from the scan, in the scene */
  chooseMade(name) {
    this.madeName = name;
    this.#say("choose");
    this.#say("change");
  }

  /**
   * @param {string} name in the scene
   * @param {boolean} hidden
   */
  hide(name, hidden) {
    if (hidden) this.hidden.add(name);
    else this.hidden.delete(name);
    this.#say("hide");
    this.#say("change");
  }

  /** @param {Iterable<number>} objects */
  select(objects) {
    this.selected = new Set(objects);
    this.#say("change");
  }

  /** @param {number} object that is selected, or no longer */
  toggleSelected(object) {
    const without = [...this.selected].filter((one) => one !== object);
    this.select(this.selected.has(object) ? without : [...without, object]);
  }

  /** @param {string[]} names of all that are hidden in the scene */
  hideOnly(names) {
    this.hidden = new Set(names);
    this.#say("change");
  }

  /** Only the chosen one is shown in the scene; all are again where that is so already. */
  solo() {
    const others = this.items.map(({ run_name }) => run_name).filter((name) => name !== this.shownName);
    const alone = others.every((name) => this.hidden.has(name)) && !this.hidden.has(this.shownName);
    this.hidden = new Set(alone ? [] : others);
    this.#say("hide");
    this.#say("change");
  }

  /** What the chosen one is called in the scene; empty where none is chosen. */
  get shownName() {
    return this.madeName || this.group?.run_name || "";
  }

  /** @param {number} object */
  choose(object) {
    this.madeName = "";
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
    const all = this.ordered;
    const at = all.findIndex(({ object }) => object === this.object);
    const next = all[(at + by + all.length) % Math.max(all.length, 1)];
    if (next) this.choose(next.object);
  }

  /** To the next one that nobody accepted yet; stays when all are. */
  stepToReview() {
    const all = this.ordered;
    const at = all.findIndex(({ object }) => object === this.object);
    const left = [...all.slice(at + 1), ...all.slice(0, at)].find(({ accepted }) => !accepted);
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
