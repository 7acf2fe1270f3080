/** Cache of masks loaded per frame or received live, with the frames on which each object is visible. */

/** @typedef {import("../api-types").FrameMask} FrameMask */
/** @typedef {import("../api-types").Lane} Lane */

/** Confidence by frame. @param {Lane} lane */
const confidencesOf = (lane) => new Map(lane.frames.map((frame, k) => [frame, lane.confidences[k] ?? 0]));

export class Masks {
  /** @type {Map<string, FrameMask>} by "object/frame" */
  #masks = new Map();
  /** @type {Map<number, Map<number, number>>} object -> frame -> confidence */
  #lanes = new Map();

  /** @param {Lane[]} lanes */
  fill(lanes) {
    this.#masks.clear();
    this.#lanes = new Map(lanes.map((lane) => [lane.object, confidencesOf(lane)]));
  }

  /** @param {FrameMask} mask */
  keep(mask) {
    this.#masks.set(`${mask.object}/${mask.frame}`, mask);
  }

  /**
   * Store a mask received live. A first mask can arrive before the response that names its object.
   * @param {FrameMask} mask
   */
  receive(mask) {
    const lane = this.#lanes.get(mask.object) ?? new Map();
    this.#lanes.set(mask.object, lane);
    if (mask.mask.box_width) lane.set(mask.frame, mask.confidence);
    this.keep(mask);
  }

  /** Drop the masks of an object that is segmented again. @param {number} object */
  restart(object) {
    this.#lanes.set(object, new Map());
    for (const key of [...this.#masks.keys()]) if (key.startsWith(`${object}/`)) this.#masks.delete(key);
  }

  /** Drop all masks of an object, or only its mask in one frame. @param {number} object @param {number} [frame] */
  forget(object, frame) {
    if (frame !== undefined) return void this.#masks.delete(`${object}/${frame}`);
    this.restart(object);
    this.#lanes.delete(object);
    return undefined;
  }

  /**
   * @param {number} object
   * @param {number} frame
   */
  on(object, frame) {
    return this.#masks.get(`${object}/${frame}`);
  }

  /**
   * Confidence by frame.
   * @param {number} object
   * @returns {Map<number, number>}
   */
  lane(object) {
    return this.#lanes.get(object) ?? new Map();
  }
}
