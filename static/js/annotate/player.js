/**
 * Player of the recording: the shown frame, prefetching of its neighbours, playback, jumps to the next frame of interest.
 * Emits "frame" at once on each change, and "settled" when scrubbing rests on a frame.
 */

import { nextDoubtful } from "../lib/lanes.js";
import { remember } from "../router.js";
import { Frames } from "./frames.js";

/** @typedef {import("../api-types").FrameInfo} FrameInfo */

const FRAME_MS = 100;
const SETTLE_MS = 30; // data of frames passed faster while scrubbing is not requested

export class Player extends EventTarget {
  frames = new Frames();
  position = 0;
  #canvas;
  #strip;
  /** @type {FrameInfo | null} frame requested at full resolution */
  #sharpened = null;
  #asDepth = false;
  #playing = 0;
  #settling = 0;

  /**
   * @param {import("../elements/frame-canvas.js").FrameCanvas} canvas
   * @param {import("../elements/film-strip.js").FilmStrip} strip
   */
  constructor(canvas, strip) {
    super();
    this.#canvas = canvas;
    this.#strip = strip;
    canvas.addEventListener("view", () => this.#sharpen());
  }

  /** Show the image preloaded by the HTML until the list of frames is loaded. @param {string} project */
  showFirst(project) {
    const link = document.head.querySelector('link[rel="preload"][as="image"]');
    link?.remove(); // a page that is opened later has its own first frame
    if (!(link instanceof HTMLLinkElement) || !link.href.includes(`/media/${project}/`)) return;
    const image = new Image();
    const show = () => {
      const { naturalWidth: width, naturalHeight: height } = image;
      if (!this.frame) this.#canvas.setFrame(image, { width, height }, "First frame");
    };
    image.addEventListener("load", show, { once: true });
    image.src = link.href;
  }

  /**
   * @param {string} project
   * @param {string} version
   * @param {FrameInfo[]} list
   */
  fill(project, version, list) {
    this.frames.fill(project, version, list);
    this.#strip.setFrames(list, (frame) => this.frames.url(frame, 160));
  }

  get frame() {
    return this.frames.list[this.position];
  }

  get depthUrl() {
    return this.frame ? this.frames.depthUrl(this.frame) : "";
  }

  /** @param {number} position */
  seek(position) {
    this.position = Math.min(Math.max(position, 0), Math.max(this.frames.list.length - 1, 0));
    const frame = this.frame;
    if (!frame) return;
    this.#strip.setPosition(this.position);
    remember({ frame: frame.index });
    this.#showPicture();
    this.dispatchEvent(new Event("frame"));
    clearTimeout(this.#settling);
    this.#settling = window.setTimeout(() => this.#settle(), SETTLE_MS);
  }

  /** @param {number} index of the frame in the recording */
  seekFrame(index) {
    this.seek(this.frames.positionOf(index));
  }

  play() {
    const playing = this.#playing !== 0;
    clearInterval(this.#playing);
    const next = () => this.seek((this.position + 1) % Math.max(this.frames.list.length, 1));
    this.#playing = playing ? 0 : window.setInterval(next, FRAME_MS);
    this.#strip.setPlaying(!playing);
  }

  /** Switch between depth and colour. */
  switchDepth() {
    this.#asDepth = !this.#asDepth;
    this.#showPicture();
  }

  /**
   * Seek the next of the wanted frames in that direction, if there is one.
   * @param {Set<number>} wanted
   * @param {1 | -1} direction
   */
  seekOneOf(wanted, direction) {
    for (let k = this.position + direction; k >= 0 && k < this.frames.list.length; k += direction) {
      if (wanted.has(this.frames.list[k]?.index ?? -1)) return this.seek(k);
    }
  }

  /**
   * Seek the next frame of doubtful confidence in that direction.
   * @param {Map<number, number>} lane confidence by frame
   * @param {1 | -1} direction
   * @returns {boolean} whether there was one
   */
  seekDoubtful(lane, direction) {
    const found = nextDoubtful(this.frames.list, lane, this.position, direction);
    if (found !== null) this.seek(found);
    return found !== null;
  }

  stop() {
    clearInterval(this.#playing);
    clearTimeout(this.#settling);
    this.frames.stop();
  }

  /** Show the frame's image, and a small one until it is loaded. */
  #showPicture() {
    this.#sharpened = null;
    const frame = this.frame;
    if (!frame) return;
    const image = this.#asDepth ? new Image() : this.frames.large(frame);
    if (this.#asDepth) image.src = this.depthUrl;
    const show = () => this.frame === frame && this.#canvas.setFrame(image, frame, `Frame ${frame.index}`);
    if (image.complete && image.naturalWidth) return void show();
    image.addEventListener("load", show, { once: true });
    const meanwhile = this.#asDepth ? null : this.frames.atOnce(this.position);
    if (meanwhile) this.#canvas.setFrame(meanwhile, frame, `Frame ${frame.index}`);
  }

  /** Load the frame at full resolution once it is zoomed into. */
  #sharpen() {
    const frame = this.frame;
    if (!frame || this.#asDepth || this.#sharpened === frame || !this.#canvas.wantsMore) return;
    this.#sharpened = frame;
    const image = this.frames.whole(frame);
    const show = () =>
      this.frame === frame && !this.#asDepth && this.#canvas.setFrame(image, frame, `Frame ${frame.index}`);
    image.addEventListener("load", show, { once: true });
  }

  #settle() {
    this.frames.prefetch(this.position);
    this.dispatchEvent(new Event("settled"));
  }
}
