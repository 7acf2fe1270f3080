/** The objects of the project as the page knows them: which is chosen, which are hidden, in which colour each is drawn. */

/** @typedef {import("../api-types").SceneObject} SceneObject */

export class SceneObjects {
  /** @type {Map<number, SceneObject>} */
  #all = new Map();
  /** @type {number | null} */
  current = null;
  /** @type {Set<number>} */
  hidden = new Set();
  /** @type {string[]} */
  palette = ["#e69f00"];

  /** @param {SceneObject[]} objects */
  fill(objects) {
    this.#all = new Map(objects.map((object) => [object.id, object]));
    this.choose(this.current);
  }

  get size() {
    return this.#all.size;
  }

  /** In the order they were made. */
  get sorted() {
    return [...this.#all.values()].toSorted((a, b) => a.id - b.id);
  }

  get chosen() {
    return this.current === null ? null : this.get(this.current);
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

  /**
   * Whether an answer to a change is news: what the live connection said of the same change may be newer.
   * @param {SceneObject} object
   */
  isNews(object) {
    return (this.get(object.id)?.version ?? -1) < object.version;
  }

  /** @param {SceneObject} object one that was deleted goes */
  store(object) {
    if (object.deleted) this.#all.delete(object.id);
    else this.#all.set(object.id, object);
  }

  /** @param {number | null} id */
  choose(id) {
    this.current = id !== null && this.#all.has(id) ? id : null;
  }

  /** @param {number} id */
  toggle(id) {
    if (!this.hidden.delete(id)) this.hidden.add(id);
  }

  /** The chosen one alone, or all again. */
  solo() {
    if (this.current === null) return;
    const others = [...this.#all.keys()].filter((id) => id !== this.current);
    const alone = others.every((id) => this.hidden.has(id));
    this.hidden = new Set(alone ? [] : others);
  }
}
