/**
 * Where in the recording the page is: the frame shown, its neighbours fetched ahead, playing, the way to the next frame of
 * interest. Says "frame" at once, and "settled" when scrubbing rests on one.
 */

import { nextDoubtful } from "../lib/lanes.js";
import { remember } from "../router.js";
import { Frames } from "./frames.js";

/** @typedef {import("../api-types").FrameInfo} FrameInfo */

const FRAME_MS = 100;
const SETTLE_MS = 30; // scrubbing passes frames faster: what belongs to them is not asked for

export class Player extends EventTarget {
  frames = new Frames();
  position = 0;
  #canvas;
  #strip;
  /** @type {FrameInfo | null} whose every pixel was asked for */
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

  /** Show the picture that the HTML asked for, until the table of frames is here. @param {string} project */
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

  /** Depth instead of colour, or back. */
  switchDepth() {
    this.#asDepth = !this.#asDepth;
    this.#showPicture();
  }

  /**
   * The next of the wanted frames in that direction; stays when there is none.
   * @param {Set<number>} wanted
   * @param {1 | -1} direction
   */
  seekOneOf(wanted, direction) {
    for (let k = this.position + direction; k >= 0 && k < this.frames.list.length; k += direction) {
      if (wanted.has(this.frames.list[k]?.index ?? -1)) return this.seek(k);
    }
  }

  /**
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

  /** The frame's picture, or what is at hand until it is here. */
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

  /** A frame that is zoomed into is shown with all its pixels. */
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
