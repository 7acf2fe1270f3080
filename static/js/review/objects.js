/**
 * State of the review page: objects with their candidates, scene, certificate, and the chosen object.
 * Emits "change" when anything must be redrawn, "choose" when another object is chosen, "hide" when hidden objects change.
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
  /** Whether the objects have been loaded. */
  loaded = false;
  /** The chosen object, and the candidate shown. */
  object = NONE;
  candidate = "";
  /** Name in the scene of the object made from the scan that is chosen instead; empty if none is. */
  madeName = "";
  /** Whether the riskiest objects come first. */
  byRisk = false;
  /** Risk of each object. @type {Map<number, import("../lib/risk.js").Risk>} */
  risks = new Map();
  /** Objects selected to copy the chosen one's corrections to. @type {Set<number>} */
  selected = new Set();
  /** Names of the objects hidden in the scene. @type {Set<string>} */
  hidden = new Set();
  /** @type {import("../api-types").SceneSummary["left_out"]} */
  leftOut = [];
  /** Corrected objects that the last run did not make. @type {import("../api-types").SceneSummary["unused"]} */
  unused = [];
  /** @type {CandidateGroup[]} */
  groups = [];
  /** @type {SceneItem[]} */
  items = [];
  /** @type {Certificate | null} */
  certificate = null;
  /** @type {import("../api-types").Category[]} */
  categories = [];
  /** Whether the user may accept, reject and correct. */
  judges = true;
  /** Candidates accepted here but not stored yet, by object. @type {Map<number, string>} */
  #accepting = new Map();
  #answers = new Answers();

  /** @param {number} [first] object to choose if none is chosen */
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
        this.loaded = true;
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

  /** Objects in review order. */
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

  /** Objects made from the scan, except those left out. */
  get made() {
    const clicked = new Set(this.groups.map(({ object }) => object));
    return this.items.filter(({ object, override }) => (object === null || !clicked.has(object)) && !override.left_out);
  }

  /** Id of the chosen object; null if none, or one made from the scan, is chosen. */
  get number() {
    return this.madeName || this.object === NONE ? null : this.object;
  }

  /** @param {string} name in the scene of an object made from the scan */
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

  /** @param {number} object */
  toggleSelected(object) {
    const without = [...this.selected].filter((one) => one !== object);
    this.select(this.selected.has(object) ? without : [...without, object]);
  }

  /** @param {string[]} names in the scene of all objects to hide */
  hideOnly(names) {
    this.hidden = new Set(names);
    this.#say("change");
  }

  /** Show only the chosen object in the scene; if it is alone already, show all. */
  solo() {
    const others = this.items.map(({ run_name }) => run_name).filter((name) => name !== this.shownName);
    const alone = others.every((name) => this.hidden.has(name)) && !this.hidden.has(this.shownName);
    this.hidden = new Set(alone ? [] : others);
    this.#say("hide");
    this.#say("change");
  }

  /** Name of the chosen object in the scene; empty if none is chosen. */
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

  /** Choose the next or the previous object. @param {1 | -1} by */
  step(by) {
    const all = this.ordered;
    const at = all.findIndex(({ object }) => object === this.object);
    const next = all[(at + by + all.length) % Math.max(all.length, 1)];
    if (next) this.choose(next.object);
  }

  /** Choose the next object not accepted yet; stay if all are. */
  stepToReview() {
    const all = this.ordered;
    const at = all.findIndex(({ object }) => object === this.object);
    const left = [...all.slice(at + 1), ...all.slice(0, at)].find(({ accepted }) => !accepted);
    if (left) this.choose(left.object);
  }

  /**
   * Treat an object as accepted and go on to the next at once, while the outbox stores the verdict, so that the next key press
   * applies to the next object.
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
   * Record the version stored by an edit made here, on which the next edit is based.
   * @param {number} object
   * @param {number} version
   */
  stored(object, version) {
    this.groups = this.groups.map((one) => (one.object === object ? { ...one, version } : one));
  }

  /** Group with verdicts and versions from here that are newer than the response. @param {CandidateGroup} group */
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
