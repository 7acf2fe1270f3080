/**
 * The objects of the project as the page knows them: which is chosen, which are selected besides, hidden or locked, in which colour
 * each is drawn. A lock is this browser's own, and kept: it guards what is finished against one's own slips.
 * Says "change" when any of it is to be drawn anew, "choose" when another one or none is chosen, "gone" {id}.
 */

import { isComing } from "../lib/listing.js";

/** @typedef {import("../api-types").SceneObject} SceneObject */

const LOCKED = "r2c2r-locked";

export class SceneObjects extends EventTarget {
  /** @type {Map<number, SceneObject>} */
  #all = new Map();
  /** @type {number | null} */
  #current = null;
  /** @type {Set<number>} */
  #hidden = new Set();
  /** @type {Set<number>} */
  #locked = new Set();
  /** @type {Set<number>} several, to be changed together */
  #selected = new Set();
  #project = "";
  /** @type {string[]} */
  palette = ["#e69f00"];

  /** @param {SceneObject[]} objects */
  fill(objects) {
    this.#all = new Map(objects.map((object) => [object.id, object]));
    if (this.#current !== null && !this.#all.has(this.#current)) this.choose(null);
    else this.#say("change");
  }

  /** @param {string} id */
  set project(id) {
    this.#project = id;
    this.#locked = new Set(JSON.parse(localStorage.getItem(`${LOCKED}-${id}`) ?? "[]"));
  }

  /** The number of the chosen one. */
  get current() {
    return this.#current;
  }

  get chosen() {
    return this.#current === null ? null : this.get(this.#current);
  }

  get size() {
    return this.#all.size;
  }

  /** Of how many masks are still to come. */
  get following() {
    return this.sorted.filter(isComing).length;
  }

  /** In the order they were made. */
  get sorted() {
    return [...this.#all.values()].toSorted((a, b) => a.id - b.id);
  }

  /** @param {number} id */
  get(id) {
    return this.#all.get(id) ?? null;
  }

  /** @param {number} point */
  ownerOf(point) {
    return this.sorted.find((object) => object.points.some(({ id }) => id === point)) ?? null;
  }

  /** @param {SceneObject} object */
  colour(object) {
    return this.palette[object.colour % this.palette.length] ?? "#e69f00";
  }

  /** @param {number} id */
  isHidden(id) {
    return this.#hidden.has(id);
  }

  /** @param {number} id */
  isLocked(id) {
    return this.#locked.has(id);
  }

  /** Lock them, or unlock them where all are. @param {number[]} ids */
  lock(ids) {
    this.#switch(this.#locked, ids);
    localStorage.setItem(`${LOCKED}-${this.#project}`, JSON.stringify([...this.#locked]));
  }

  /** Several, in the order they were made. */
  get selected() {
    return this.sorted.filter(({ id }) => this.#selected.has(id));
  }

  /** Those that a command is about: the selected ones, else the chosen one. */
  get changed() {
    const { selected, chosen } = this;
    return selected.length ? selected : chosen ? [chosen] : [];
  }

  /** @param {number} id */
  isSelected(id) {
    return this.#selected.has(id);
  }

  /** These alone. @param {number[]} ids */
  select(ids) {
    this.#selected = new Set(ids);
    this.#say("change");
  }

  /** An answer to a change: what the live connection said of the same change may be newer. @param {SceneObject} object */
  answered(object) {
    if ((this.get(object.id)?.version ?? -1) < object.version) this.store(object);
  }

  /** @param {SceneObject} object one that was deleted goes */
  store(object) {
    if (!object.deleted) this.#all.set(object.id, object);
    else if (this.#all.delete(object.id)) this.#say("gone", { id: object.id });
    if (object.deleted && this.#current === object.id) this.choose(null);
    else this.#say("change");
  }

  /** @param {number | null} id */
  choose(id) {
    this.#current = id !== null && this.#all.has(id) ? id : null;
    this.#say("choose");
    this.#say("change");
  }

  /** Hide them, or show them again where all are hidden. @param {number[]} ids */
  hide(ids) {
    this.#switch(this.#hidden, ids);
  }

  /** @param {Set<number>} set @param {number[]} ids */
  #switch(set, ids) {
    const all = ids.every((id) => set.has(id));
    for (const id of ids)
      if (all) set.delete(id);
      else set.add(id);
    this.#say("change");
  }

  /** The chosen one alone, or all again. */
  solo() {
    if (this.#current === null) return;
    const others = [...this.#all.keys()].filter((id) => id !== this.#current);
    const alone = others.every((id) => this.#hidden.has(id));
    this.#hidden = new Set(alone ? [] : others);
    this.#say("change");
  }

  /**
   * @param {string} type
   * @param {object} [detail]
   */
  #say(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}
