/**
 * Edits of the objects, sent through the outbox. Emits "object" {object} for every response, "made" {object} when a click
 * created a new one, "making" {name, coming} when that starts or ends, "clicks" when the unsaved clicks change, "saved"
 * {text, tone} with the saving state.
 */

import { getFoundFronts } from "../api.js";
import * as changes from "../changes.js";
import { say, sayError } from "../elements/toasts.js";
import { arranged } from "../lib/arranged.js";
import { counted } from "../lib/format.js";
import { renamed } from "../lib/front-rows.js";
import { newKey, outbox } from "../outbox.js";
import { saving } from "../saving.js";

/** @typedef {import("../api-types").SceneObject} SceneObject */
/** @typedef {import("../api-types").PointIn} PointIn */
/** @typedef {import("./scene-objects.js").SceneObjects} SceneObjects */
/**
 * @template T
 * @typedef {import("../changes.js").Change<T>} Change
 */

const UNLOCK = "To change one, unlock it in the list, or choose it and press Shift+L.";

export class Edits extends EventTarget {
  project = "";
  #objects;
  /** Provisional id of the object being created; further clicks are added to it. @type {string | null} */
  #coming = null;
  /** @type {Map<string, PointIn[]>} clicks that are not stored yet */
  #clicks = new Map();

  /** @param {SceneObjects} objects */
  constructor(objects) {
    super();
    this.#objects = objects;
  }

  /** Clicks that are not stored yet. */
  get clicks() {
    return [...this.#clicks.values()].flat();
  }

  /** The next click starts a new object, even when the last one has not been stored yet. */
  finish() {
    this.#coming = null;
  }

  /**
   * Add clicks to the current object, or to a new one; without a name, that is called by its category and a number.
   * @param {PointIn[]} points
   * @param {{ category: string, name?: string, infer: boolean }} how
   */
  place(points, { category, name, infer }) {
    const key = newKey();
    const target = this.#objects.current ?? this.#coming;
    this.#onTheirWay(key, points);
    const sent =
      target === null ? this.#make(key, { category, name, points }, infer) : this.#add(key, target, points, infer);
    sent
      .then(
        (object) => this.#say("object", { object }),
        () => {}, // save() has shown the error
      )
      .finally(() => this.#onTheirWay(key, null));
  }

  /**
   * @param {string} key
   * @param {PointIn[] | null} points null once they are stored or refused
   */
  #onTheirWay(key, points) {
    if (points) this.#clicks.set(key, points);
    else this.#clicks.delete(key);
    this.#say("clicks", {});
  }

  /**
   * @param {string} key
   * @param {{ category: string, name?: string, points: PointIn[] }} wanted
   * @param {boolean} infer
   */
  async #make(key, wanted, infer) {
    this.#coming = `{${key}}`;
    this.#say("making", { name: wanted.name, coming: true });
    const isMine = () => this.#coming === `{${key}}`;
    try {
      const object = await this.save(changes.addObject(this.project, wanted, infer), key);
      if (isMine()) this.#say("made", { object });
      return object;
    } finally {
      this.#say("making", { name: wanted.name, coming: false });
      if (isMine()) this.#coming = null; // also after a refusal: the next click tries again
    }
  }

  /**
   * @param {string} key
   * @param {number | string} target
   * @param {PointIn[]} points
   * @param {boolean} infer
   */
  #add(key, target, points, infer) {
    const [only] = points;
    const change =
      points.length === 1 && only
        ? changes.addPoint(this.project, target, only, infer)
        : changes.addPoints(this.project, target, points, infer);
    return this.save(change, key);
  }

  /**
   * @param {number} id of a click
   * @param {{ x: number, y: number }} to
   */
  movePoint(id, to) {
    const owner = this.#objects.ownerOf(id);
    if (owner) this.#tell(changes.changePoint(this.project, owner.id, id, to));
  }

  /** @param {number} id of a click */
  removePoint(id) {
    const owner = this.#objects.ownerOf(id);
    if (owner) this.#tell(changes.deletePoint(this.project, owner.id, id));
  }

  /**
   * @param {number} id
   * @param {{ name?: string, category?: string, assignee?: string | null, locked?: boolean, crop?: import("../api-types").PromptsFileCrop | null }} wanted
   * @param {SceneObject | null} seen the object as the user saw it when changing it
   */
  patch(id, wanted, seen = this.#objects.get(id)) {
    return seen ? this.#tell(changes.changeObject(this.project, seen, wanted)) : Promise.resolve(false);
  }

  /** Lock the objects against changes by anybody, or unlock them if all are locked. @param {SceneObject[]} objects */
  lock(objects) {
    const locked = objects.some(({ locked_by }) => locked_by === null);
    for (const one of objects) if (locked === (one.locked_by === null)) this.patch(one.id, { locked });
  }

  /** The objects that may be changed; a message names the locked ones. @param {SceneObject[]} objects */
  unlocked(objects) {
    const locked = objects.filter(({ locked_by }) => locked_by !== null);
    const named = locked.slice(0, 4).map(({ name, locked_by }) => `${name} (by ${locked_by})`);
    const more = locked.length > named.length ? " …" : "";
    if (locked.length)
      say(`${counted(locked.length, "locked object")} left out: ${named.join(", ")}${more}`, { hint: UNLOCK });
    return objects.filter(({ locked_by }) => locked_by === null);
  }

  /**
   * @param {SceneObject[]} all
   * @param {string | null} name
   */
  async assign(all, name) {
    const objects = this.unlocked(all);
    const answers = await Promise.all(objects.map(({ id }) => this.patch(id, { assignee: name })));
    const count = answers.filter(Boolean).length;
    if (!count) return;
    const what = count === 1 ? objects[answers.indexOf(true)]?.name : counted(count, "object");
    say(name ? `${what}: assigned to ${name}, in their inbox` : `${what}: assigned to nobody`, { kind: "good" });
  }

  /**
   * Give several objects one name, numbered from left to right and top to bottom as they stand in the room.
   * @param {SceneObject[]} all
   * @param {string} name
   */
  async renameAll(all, name) {
    const objects = this.unlocked(all);
    const fronts = await getFoundFronts(this.project).catch((error) => (sayError(error), null));
    if (!fronts) return;
    const mine = arranged(objects, fronts).map((object) => ({ key: String(object.id), name: object.name }));
    const taken = this.#objects.sorted.filter((one) => !objects.includes(one)).map((one) => one.name);
    for (const step of renamed(mine, name, taken))
      if (!(await this.patch(Number(step.key), { name: step.name }))) return;
  }

  /**
   * Merge two objects: the older one keeps its name and gets the other's positive clicks; the other is deleted.
   * @param {number} id
   * @param {number} other
   */
  async merge(id, other) {
    const [kept, gone] = [this.#objects.get(Math.min(id, other)), this.#objects.get(Math.max(id, other))];
    if (!kept || !gone || this.unlocked([kept, gone]).length < 2) return;
    const points = gone.points.flatMap(({ frame, x, y, label }) => (label === 1 ? [{ frame, x, y, label }] : []));
    this.#objects.choose(kept.id);
    const merged = !points.length || (await this.#tell(changes.addPoints(this.project, kept.id, points)));
    if (merged && (await this.#tell(changes.deleteObject(this.project, gone.id))))
      say(`${gone.name} is merged into ${kept.name}`, { hint: "undo twice brings it back" });
  }

  /** @param {SceneObject[]} all */
  async remove(all) {
    const objects = this.unlocked(all);
    const answers = await Promise.all(objects.map(({ id }) => this.#tell(changes.deleteObject(this.project, id))));
    const gone = objects.filter((_, k) => answers[k]);
    if (gone.length === 1) say(`Deleted ${gone[0]?.name}; undo brings it back`);
    if (gone.length > 1) say(`Deleted ${gone.length} objects; each undo brings one back`);
  }

  /** @param {number | string | null} object */
  segment(object = this.#objects.current ?? this.#coming) {
    if (object === null) say("Choose an object first.");
    else this.#tell(changes.segmentObject(this.project, object));
  }

  /** @param {number | null} object */
  stopSegmenting(object = this.#objects.current) {
    if (object === null) say("Choose an object first.");
    else this.#tell(changes.cancelSegment(this.project, object));
  }

  /**
   * Undo or redo the user's newest change of the project, whichever object is chosen.
   * @param {"undo" | "redo"} which
   * @param {number | undefined} frame shown
   */
  undoRedo(which, frame) {
    this.save(changes.undoRedo(this.project, which, { object: null })).then(
      ({ object, text, frame: at }) => {
        this.#say("object", { object });
        const where = at !== null && at !== frame ? ` (frame ${at})` : "";
        say(`${which === "undo" ? "Undone" : "Redone"}: ${text}${where}`);
      },
      () => {},
    );
  }

  /**
   * Send a change and report its saving state; a refusal by the server is shown as a toast.
   * @template T
   * @param {Change<T>} change
   * @param {string} [key]
   * @returns {Promise<T>}
   */
  save(change, key) {
    return saving(change, key, (how) => this.#say("saved", how));
  }

  /** @param {Change<SceneObject>} change */
  #tell(change) {
    return this.save(change).then(
      (object) => (this.#say("object", { object }), true),
      () => false,
    );
  }

  /**
   * @param {string} type
   * @param {object} detail
   */
  #say(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}
