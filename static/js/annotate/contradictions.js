/**
 * What the masks on the frame shown contradict, said beside the objects concerned as soon as it can be seen.
 * Says "change" when that is another than before.
 */

import { contradictionsOn } from "../lib/contradictions.js";
import { decodeBox } from "../lib/masks.js";

/** @typedef {import("./scene-objects.js").SceneObjects} SceneObjects */
/** @typedef {import("./masks.js").Masks} Masks */
/** @typedef {import("../api-types").FrameInfo} FrameInfo */
/** @typedef {import("../lib/contradictions.js").Said} Said */

const SOON_MS = 200; // masks arrive by the dozen

export class Contradictions extends EventTarget {
  #objects;
  #masks;
  #looks = 0;
  #timer = 0;
  /** @type {Said[]} */
  #said = [];

  /**
   * @param {SceneObjects} objects
   * @param {Masks} masks
   */
  constructor(objects, masks) {
    super();
    this.#objects = objects;
    this.#masks = masks;
  }

  /**
   * The lines about an object.
   * @param {number} object
   */
  about(object) {
    return this.#said.filter((said) => said.object === object);
  }

  /** In a moment, at this frame with what changes until then. @param {FrameInfo} frame */
  lookSoon(frame) {
    clearTimeout(this.#timer);
    this.#timer = window.setTimeout(() => this.#look(frame), SOON_MS);
  }

  stop() {
    clearTimeout(this.#timer);
  }

  /** @param {FrameInfo} frame */
  async #look(frame) {
    const shown = this.#objects.sorted.flatMap((object) => {
      const mask = this.#masks.on(object.id, frame.index)?.mask;
      if (!mask?.box_width) return [];
      const scale = mask.width / frame.width;
      const here = object.points.filter((point) => point.frame === frame.index);
      const clicks = here.map(({ x, y, label }) => ({ x: x * scale, y: y * scale, label }));
      return [{ object: object.id, name: object.name, mask, clicks }];
    });
    const look = ++this.#looks;
    const decoded = await Promise.all(shown.map(async (one) => ({ ...one, pixels: await decodeBox(one.mask) })));
    if (look !== this.#looks) return; // a newer one is under way
    const said = contradictionsOn(decoded);
    if (JSON.stringify(said) === JSON.stringify(this.#said)) return;
    this.#said = said;
    this.dispatchEvent(new Event("change"));
  }
}
