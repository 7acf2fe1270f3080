/**
 * Fronts of a project and their edits on the elevation page. Edits show at once, stay in the outbox until stored, and are
 * undone one gesture at a time. Emits "change", "choose", "refused", "saved" {text, tone}.
 */

import * as changes from "../changes.js";
import { say } from "../elements/toasts.js";
import { sameFront } from "../lib/elevation.js";
import { newKey, outbox } from "../outbox.js";
import { saving } from "../saving.js";

/** @typedef {import("../api-types").SceneObject} SceneObject */
/** @typedef {import("../api-types").FoundFront} FoundFront */
/** @typedef {import("../api-types").PromptsFileFrontOutput} Drawn */
/** @typedef {{ name?: string, category?: string, front?: Drawn }} Wanted */
/** @typedef {{ category: string, corners: number[][], handle?: "none" | null, hinge?: Drawn["hinge"] }} Making */
/**
 * `seen` is the detected handle, `edges` the confidence of the edges (left, right, top, bottom); `key` never changes; `id` is
 * null until the object is stored; `pending` counts changes not stored yet.
 * @typedef {{
 *   key: string, id: number | null, name: string, category: string, colour: number, version: number, corners: number[][],
 *   handle: Drawn["handle"], seen: FoundFront["handle"], hinge: Drawn["hinge"], drawn: boolean, pending: number,
 *   edges: number[],
 * }} Front
 */

export class Fronts extends EventTarget {
  project = "";
  /** @type {Map<string, Front>} */
  #all = new Map();
  /** @type {string[]} keys of the chosen fronts; the last one leads */
  #chosen = [];
  /** @type {string[][]} gestures to undo: keys of the fronts each changed, in order */
  #done = [];
  /** @type {string[][]} */
  #undone = [];
  #made = 0;
  /** Ids of objects deleted here; messages about them still in transit are outdated. @type {Set<number>} */
  #gone = new Set();

  get all() {
    return [...this.#all.values()];
  }

  get chosen() {
    return this.#chosen.map((key) => this.#all.get(key)).filter((one) => one !== undefined);
  }

  get leading() {
    return this.chosen.at(-1) ?? null;
  }

  /** @param {string} key */
  get(key) {
    return this.#all.get(key) ?? null;
  }

  /**
   * Load the stored objects, and the detected fronts of those nobody drew.
   * @param {SceneObject[]} objects
   * @param {FoundFront[]} found
   */
  fill(objects, found) {
    const known = new Map(found.map((one) => [one.object, one]));
    for (const object of objects) this.take(object, known.get(object.id));
    const there = new Set(objects.map(({ id }) => id));
    const newest = Math.max(0, ...there); // objects created after the request are not among them
    for (const { id, key } of this.all) if (id !== null && id <= newest && !there.has(id)) this.#all.delete(key);
    this.#say("change");
  }

  /**
   * Update a front from the stored object; ignored while the front has pending or newer changes.
   * @param {SceneObject} object
   * @param {FoundFront} [found]
   */
  take(object, found) {
    const known = this.all.find(({ id }) => id === object.id);
    if (known && (known.pending > 0 || known.version > object.version)) return;
    if (!known && (this.#gone.has(object.id) || this.all.some(({ id }) => id === null))) return; // it may be one of the fronts being stored
    const corners =
      object.front?.corners_m ?? found?.corners_m ?? (object.front === null && !known?.drawn ? known?.corners : null);
    if (object.deleted || !corners) {
      if (known) this.#all.delete(known.key);
      return;
    }
    const key = known?.key ?? `o${object.id}`;
    this.#all.set(key, {
      key,
      id: object.id,
      name: object.name,
      category: object.category,
      colour: object.colour,
      version: object.version,
      corners,
      handle: object.front?.handle ?? null,
      seen: found?.handle ?? null,
      hinge: object.front?.hinge ?? null,
      drawn: object.front !== null,
      pending: 0,
      edges: found?.edges ?? known?.edges ?? [],
    });
  }

  /** @param {string | null} key @param {boolean} [also] toggle it in the selection instead of replacing that */
  choose(key, also = false) {
    if (key === null) this.#chosen = [];
    else if (!also) this.#chosen = [key];
    else this.#chosen = this.#chosen.includes(key) ? this.#chosen.filter((one) => one !== key) : [...this.#chosen, key];
    this.#say("choose");
  }

  /** @param {string[]} keys the last one leads */
  chooseAll(keys) {
    this.#chosen = keys;
    this.#say("choose");
  }

  /**
   * Create, change and remove fronts as one gesture; a gesture without effect is not recorded for undo.
   * @param {{ make?: Making[], change?: { front: Front, wanted: Wanted, seen?: Front }[], remove?: Front[] }} gesture `seen`:
   *   a front as the user saw it, where another person may have changed it since
   * @returns {Front[]} the new fronts
   */
  do({ make = [], change = [], remove = [] }) {
    const changed = change.filter(({ front, wanted }) => isNews(front, wanted));
    if (!make.length && !changed.length && !remove.length) return [];
    const made = make.map((one) => this.#make(one));
    for (const { front, wanted, seen } of changed) this.#change(front, wanted, seen);
    for (const front of remove) this.#remove(front);
    this.#done.push([
      ...changed.map(({ front }) => front.key),
      ...remove.map(({ key }) => key),
      ...made.map(({ key }) => key),
    ]);
    this.#undone = [];
    this.#say("change");
    return made;
  }

  /** @param {"undo" | "redo"} which */
  async step(which) {
    const [from, to] = which === "undo" ? [this.#done, this.#undone] : [this.#undone, this.#done];
    await outbox.settled;
    const gesture = from.pop();
    if (!gesture) return this.#stepOf(which, null);
    to.push(gesture);
    for (const key of which === "undo" ? gesture.toReversed() : gesture) {
      const id = this.#ids.get(key);
      if (id !== undefined) await this.#stepOf(which, id);
    }
  }

  /** Object ids by front key, including deleted fronts. @type {Map<string, number>} */
  #ids = new Map();

  /** @param {"undo" | "redo"} which @param {number | null} object */
  async #stepOf(which, object) {
    try {
      const { object: stored, text } = await this.#send(changes.undoRedo(this.project, which, { object }));
      this.#gone.delete(stored.id);
      const known = this.all.find(({ id }) => id === stored.id);
      if (known) known.version = Math.min(known.version, stored.version);
      const key = known?.key ?? [...this.#ids].find(([, id]) => id === stored.id)?.[0];
      this.take(stored);
      const back = this.all.find(({ id }) => id === stored.id);
      if (back && key && back.key !== key) this.#rename(back, key);
      this.#say("change");
      say(`${which === "undo" ? "Undone" : "Redone"}: ${text}`);
    } catch {
      // the error has been shown by `saving`
    }
  }

  /** @param {Front} front @param {string} key its key before deletion */
  #rename(front, key) {
    this.#all.delete(front.key);
    this.#all.set(key, { ...front, key });
  }

  /** @param {Making} making */
  #make({ category, corners, handle = null, hinge = null }) {
    const key = `n${++this.#made}-${newKey()}`;
    const sent = newKey();
    const name = `${category} …`;
    /** @type {Front} */
    const front = {
      key,
      id: null,
      name,
      category,
      colour: this.#all.size,
      version: 0,
      corners,
      handle,
      seen: null,
      hinge,
      drawn: true,
      pending: 1,
      edges: [],
    };
    this.#all.set(key, front);
    this.#refs.set(key, `{${sent}}`);
    this.#follow(front, this.#send(changes.addObject(this.project, { category, front: drawnOf(front) }), sent));
    return front;
  }

  /** References used in addresses for objects not stored yet, by front key. @type {Map<string, string>} */
  #refs = new Map();

  /** @param {Front} front @param {Wanted} wanted @param {Front} [known] the front as the user saw it */
  #change(front, wanted, known = front) {
    const seen = { name: known.name, category: front.category, front: front.drawn ? drawnOf(front) : null };
    Object.assign(front, wanted.category === undefined ? {} : { category: wanted.category });
    if (wanted.name !== undefined) front.name = wanted.name;
    if (wanted.front) {
      front.corners = wanted.front.corners_m;
      front.handle = wanted.front.handle;
      front.hinge = wanted.front.hinge;
      front.drawn = true;
    }
    const ref = front.id ?? this.#refs.get(front.key) ?? "";
    const version = front.id === null ? undefined : known.version + front.pending;
    front.pending += 1;
    this.#follow(front, this.#send(changes.changeFront(this.project, ref, wanted, version, seen)));
  }

  /** @param {Front} front */
  #remove(front) {
    this.#all.delete(front.key);
    this.#chosen = this.#chosen.filter((key) => key !== front.key);
    const ref = front.id ?? this.#refs.get(front.key) ?? "";
    if (front.id !== null) this.#gone.add(front.id);
    this.#send(changes.deleteObject(this.project, ref)).then(
      (object) => (this.#ids.set(front.key, object.id), this.#gone.add(object.id)),
      () => {
        this.#gone.clear();
        this.#say("refused");
      },
    );
  }

  /** @param {Front} front @param {Promise<SceneObject>} sent */
  #follow(front, sent) {
    sent.then(
      (object) => {
        this.#ids.set(front.key, object.id);
        front.pending -= 1;
        front.id = object.id;
        front.version = object.version; // pending changes are numbered from this version
        if (front.pending === 0) Object.assign(front, { name: object.name, colour: object.colour });
        this.#say("change");
      },
      () => {
        front.pending = 0;
        this.#say("refused");
      },
    );
  }

  /**
   * @template T
   * @param {import("../changes.js").Change<T>} change
   * @param {string} [key]
   * @returns {Promise<T>}
   */
  #send(change, key) {
    return saving(change, key, (how) => this.#say("saved", how));
  }

  /**
   * @param {string} type
   * @param {object} [detail]
   */
  #say(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}

/** Whether the wanted values differ from the front. @param {Front} front @param {Wanted} wanted */
function isNews(front, { name = front.name, category = front.category, front: drawn }) {
  const redrawn = drawn !== undefined && !(front.drawn && sameFront(drawn, drawnOf(front)));
  return redrawn || name !== front.name || category !== front.category;
}

/** @param {Front} front @returns {Drawn} in the format of prompts.json */
export function drawnOf({ corners, handle, hinge }) {
  return { corners_m: corners, handle, hinge };
}
