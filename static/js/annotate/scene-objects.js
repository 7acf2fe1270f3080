/**
 * Client-side state of the project's objects: chosen, selected, hidden, and the colour of each.
 * Emits "change" when a redraw is needed, "choose" when another object or none is chosen, "gone" {id} when one is deleted.
 */

import { isComing } from "../lib/listing.js";

/** @typedef {import("../api-types").SceneObject} SceneObject */

export class SceneObjects extends EventTarget {
  /** @type {Map<number, SceneObject>} */
  #all = new Map();
  /** @type {number | null} */
  #current = null;
  /** @type {Set<number>} */
  #hidden = new Set();
  /** @type {Set<number>} objects to be changed together */
  #selected = new Set();
  /** @type {string[]} */
  palette = ["#e69f00"];

  /** @param {SceneObject[]} objects */
  fill(objects) {
    this.#all = new Map(objects.map((object) => [object.id, object]));
    if (this.#current !== null && !this.#all.has(this.#current)) this.choose(null);
    else this.#say("change");
  }

  /** Id of the chosen object. */
  get current() {
    return this.#current;
  }

  get chosen() {
    return this.#current === null ? null : this.get(this.#current);
  }

  get size() {
    return this.#all.size;
  }

  /** Number of objects whose masks are still being found. */
  get following() {
    return this.sorted.filter(isComing).length;
  }

  /** Objects in order of creation. */
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

  /** Selected objects in order of creation. */
  get selected() {
    return this.sorted.filter(({ id }) => this.#selected.has(id));
  }

  /** Objects that a command applies to: the selected ones, else the chosen one. */
  get changed() {
    const { selected, chosen } = this;
    return selected.length ? selected : chosen ? [chosen] : [];
  }

  /** @param {number} id */
  isSelected(id) {
    return this.#selected.has(id);
  }

  /** Select exactly these objects; a single one is also chosen, as it is the one that tools are meant for. @param {number[]} ids */
  select(ids) {
    this.#selected = new Set(ids);
    const [only] = ids;
    if (ids.length === 1 && only !== undefined && only !== this.#current) this.choose(only);
    else this.#say("change");
  }

  /** Store the response to a change, unless the live connection has delivered a newer version. @param {SceneObject} object */
  answered(object) {
    if ((this.get(object.id)?.version ?? -1) < object.version) this.store(object);
  }

  /** Store an object, or remove it if it was deleted. @param {SceneObject} object */
  store(object) {
    if (!object.deleted) this.#all.set(object.id, object);
    else if (this.#all.delete(object.id)) this.#say("gone", { id: object.id });
    if (object.deleted && this.#current === object.id) this.choose(null);
    else this.#say("change");
  }

  /** @param {number | null} id */
  choose(id) {
    this.#current = id !== null && this.#all.has(id) ? id : null;
    if (this.#selected.size === 1 && !this.#selected.has(this.#current ?? NaN)) this.#selected.clear();
    this.#say("choose");
    this.#say("change");
  }

  /** Hide the objects, or show them if all are hidden. @param {number[]} ids */
  hide(ids) {
    const all = ids.every((id) => this.#hidden.has(id));
    for (const id of ids)
      if (all) this.#hidden.delete(id);
      else this.#hidden.add(id);
    this.#say("change");
  }

  /** Show only the chosen object, or all again. */
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
