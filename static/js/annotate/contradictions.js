/**
 * Contradictions between the masks of the shown frame, grouped by object and updated live.
 * Emits "change" when they differ from before.
 */

import { contradictionsOn, shownOn, unseenOn } from "../lib/contradictions.js";

/** @typedef {import("./scene-objects.js").SceneObjects} SceneObjects */
/** @typedef {import("./live-masks.js").LiveMasks} LiveMasks */
/** @typedef {import("../api-types").FrameInfo} FrameInfo */
/** @typedef {import("../lib/contradictions.js").Said} Said */

const SOON_MS = 200; // masks arrive in bursts

export class Contradictions extends EventTarget {
  #objects;
  #masks;
  #looks = 0;
  #timer = 0;
  /** @type {Said[]} */
  #said = [];

  /**
   * @param {SceneObjects} objects
   * @param {LiveMasks} masks
   */
  constructor(objects, masks) {
    super();
    this.#objects = objects;
    this.#masks = masks;
  }

  /**
   * Contradictions of one object.
   * @param {number} object
   */
  about(object) {
    return this.#said.filter((said) => said.object === object);
  }

  /** Check this frame after a short delay, which each further call restarts. @param {FrameInfo} frame */
  lookSoon(frame) {
    clearTimeout(this.#timer);
    this.#timer = window.setTimeout(() => this.#look(frame), SOON_MS);
  }

  stop() {
    clearTimeout(this.#timer);
  }

  /** @param {FrameInfo} frame */
  async #look(frame) {
    const objects = this.#objects.sorted;
    const masks = objects.flatMap((object) => {
      const mask = this.#masks.stored.on(object.id, frame.index)?.mask;
      return mask ? [{ object, mask }] : [];
    });
    const look = ++this.#looks;
    const shown = await shownOn(masks, frame, this.#masks.openings);
    if (look !== this.#looks) return; // a newer check has started
    const unseen = unseenOn(objects, frame.index, (object) => this.#masks.stored.lane(object).has(frame.index));
    const said = [...contradictionsOn(shown), ...unseen];
    if (JSON.stringify(said) === JSON.stringify(this.#said)) return;
    this.#said = said;
    this.dispatchEvent(new Event("change"));
  }
}
