/** Images of the recording: neighbours of a frame are prefetched, and small images of all, so that scrubbing never waits. */

/** @typedef {import("../api-types").FrameInfo} FrameInfo */

const NEAR = 12;
const KEPT = 6 * NEAR;
const SMALL_WIDTH = 320;
const MOST_SMALL = 300; // in a long recording, every n-th frame
const AT_ONCE = 3;

export class Frames {
  /** @type {FrameInfo[]} */
  list = [];
  #project = "";
  #version = "";
  /** @type {Map<number, HTMLImageElement>} */
  #large = new Map();
  /** @type {Map<number, HTMLImageElement>} by position */
  #small = new Map();
  /** @type {number[]} positions whose small image is still to be loaded */
  #waiting = [];

  /**
   * @param {string} project
   * @param {string} version
   * @param {FrameInfo[]} list
   */
  fill(project, version, list) {
    Object.assign(this, { list });
    this.#project = project;
    this.#version = version;
    const step = Math.max(Math.ceil(list.length / MOST_SMALL), 1);
    this.#waiting = list.flatMap((_, position) => (position % step === 0 ? [position] : []));
    for (let k = 0; k < AT_ONCE; k += 1) this.#fetchSmall();
  }

  /** Stop loading further small images. */
  stop() {
    this.#waiting = [];
  }

  /** @param {number} index of the frame in the recording */
  positionOf(index) {
    return this.list.findIndex((frame) => frame.index === index);
  }

  /**
   * @param {FrameInfo} frame
   * @param {number} width
   */
  url(frame, width) {
    return `/media/${this.#project}/frames/${frame.index}.jpg?w=${width}&v=${this.#version}`;
  }

  /** @param {FrameInfo} frame */
  depthUrl(frame) {
    return `/media/${this.#project}/depth/${frame.index}.png?v=${this.#version}`;
  }

  /** @param {FrameInfo} frame */
  large(frame) {
    const held = this.#large.get(frame.index);
    if (held) return held;
    const image = new Image();
    image.src = this.url(frame, 960);
    this.#large.set(frame.index, image);
    if (this.#large.size > KEPT) this.#large.delete(/** @type {number} */ (this.#large.keys().next().value));
    return image;
  }

  /** Image at full resolution, for zooming in. @param {FrameInfo} frame */
  whole(frame) {
    const image = new Image();
    image.src = `/media/${this.#project}/frames/${frame.index}.jpg?v=${this.#version}`;
    return image;
  }

  /**
   * Image to show immediately for a frame that is not loaded yet: its small image, or a near frame's; null without one.
   * @param {number} position
   */
  atOnce(position) {
    for (let away = 0; away <= 4; away += 1) {
      for (const near of [position - away, position + away]) {
        const image = this.#small.get(near);
        if (image?.complete && image.naturalWidth) return image;
      }
    }
    return null;
  }

  /** @param {number} position */
  prefetch(position) {
    for (let k = 1; k <= NEAR; k += 1) {
      for (const near of [position + k, position - k]) {
        const frame = this.list[near];
        if (frame) this.large(frame);
      }
    }
  }

  #fetchSmall() {
    const position = this.#waiting.shift();
    const frame = position === undefined ? undefined : this.list[position];
    if (position === undefined || !frame) return;
    const image = new Image();
    this.#small.set(position, image);
    image.addEventListener("load", () => this.#fetchSmall(), { once: true });
    image.addEventListener("error", () => this.#fetchSmall(), { once: true });
    image.fetchPriority = "low";
    image.src = this.url(frame, SMALL_WIDTH);
  }
}
