/**
 * The fronts of a project as the elevation page knows them, and what a person does to them. What is done shows at once, is kept
 * by the outbox until it is stored, and is taken back gesture by gesture. Says "change", "choose", "saved" {text, tone}.
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
 * `seen` is the handle that was found, `edges` how sure its edges are (left, right, top, bottom); `key` never changes; `id` is null until the object is stored; `pending` changes are on their way.
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
  /** @type {string[]} the chosen ones, the last one leads */
  #chosen = [];
  /** @type {string[][]} gestures to take back: the fronts each changed, in order */
  #done = [];
  /** @type {string[][]} */
  #undone = [];
  #made = 0;
  /** Deleted here: what is said of them on the way says less. @type {Set<number>} */
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
   * What is stored, and where fronts were found that nobody drew.
   * @param {SceneObject[]} objects
   * @param {FoundFront[]} found
   */
  fill(objects, found) {
    const known = new Map(found.map((one) => [one.object, one]));
    for (const object of objects) this.take(object, known.get(object.id));
    const there = new Set(objects.map(({ id }) => id));
    const newest = Math.max(0, ...there); // what was made since they were asked for is not among them
    for (const { id, key } of this.all) if (id !== null && id <= newest && !there.has(id)) this.#all.delete(key);
    this.#say("change");
  }

  /**
   * An object as it is stored now; while changes of it are on their way, those are newer.
   * @param {SceneObject} object
   * @param {FoundFront} [found]
   */
  take(object, found) {
    const known = this.all.find(({ id }) => id === object.id);
    if (known && (known.pending > 0 || known.version > object.version)) return;
    if (!known && (this.#gone.has(object.id) || this.all.some(({ id }) => id === null))) return; // it may be one of those
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

  /** @param {string | null} key @param {boolean} [also] beside those chosen */
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
   * New fronts, changed ones and ones that go, as one gesture; one that changes nothing is none: there is nothing to take back.
   * @param {{ make?: Making[], change?: { front: Front, wanted: Wanted }[], remove?: Front[] }} gesture
   * @returns {Front[]} the new ones
   */
  do({ make = [], change = [], remove = [] }) {
    const changed = change.filter(({ front, wanted }) => isNews(front, wanted));
    if (!make.length && !changed.length && !remove.length) return [];
    const made = make.map((one) => this.#make(one));
    for (const { front, wanted } of changed) this.#change(front, wanted);
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

  /** Numbers of fronts, also of those that are gone. @type {Map<string, number>} */
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
      // said where it was refused
    }
  }

  /** @param {Front} front @param {string} key it had before it went */
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

  /** What an object is called in an address while it is not stored. @type {Map<string, string>} */
  #refs = new Map();

  /** @param {Front} front @param {Wanted} wanted */
  #change(front, wanted) {
    const seen = { name: front.name, category: front.category, front: front.drawn ? drawnOf(front) : null };
    Object.assign(front, wanted.category === undefined ? {} : { category: wanted.category });
    if (wanted.name !== undefined) front.name = wanted.name;
    if (wanted.front) {
      front.corners = wanted.front.corners_m;
      front.handle = wanted.front.handle;
      front.hinge = wanted.front.hinge;
      front.drawn = true;
    }
    const ref = front.id ?? this.#refs.get(front.key) ?? "";
    const version = front.id === null ? undefined : front.version + front.pending;
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
        front.version = object.version; // those on their way are counted from here
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

/** Whether anything of it is not so already. @param {Front} front @param {Wanted} wanted */
function isNews(front, { name = front.name, category = front.category, front: drawn }) {
  const redrawn = drawn !== undefined && !(front.drawn && sameFront(drawn, drawnOf(front)));
  return redrawn || name !== front.name || category !== front.category;
}

/** @param {Front} front @returns {Drawn} as prompts.json holds it */
export function drawnOf({ corners, handle, hinge }) {
  return { corners_m: corners, handle, hinge };
}
