/**
 * Manual editing of the chosen object's mask in the shown frame: brush, eraser, lasso, polygon, keep as it is, or mark as not
 * visible. A corrected mask is not replaced by later segmentation. Emits "tool" when the active tool changes, "painted" with
 * the frame's index when a mask does.
 */

import { getMasks } from "../api.js";
import * as changes from "../changes.js";
import { say, sayError } from "../elements/toasts.js";
import { isComing } from "../lib/listing.js";
import { decodeBox } from "../lib/masks.js";
import { encoded, isEmpty, runsOf, wholeMask } from "../lib/painting.js";
import { outbox } from "../outbox.js";

/** @typedef {import("../api-types").MaskBits} MaskBits */
/** @typedef {import("../lib/painting.js").Mask} Mask */
/** @typedef {"brush" | "eraser" | "lasso" | "polygon"} Tool */
/** @typedef {{ x: number, y: number }} Spot in pixels of the frame */
/** @typedef {{ width: number, height: number }} Size */
/** @typedef {{ object: import("../api-types").SceneObject, frame: number, size: Size }} Place an object in a frame */
/** @typedef {(mask: Mask, size: Size) => Mask} Alter */
/**
 * @typedef {object} Known
 * @property {import("./scene-objects.js").SceneObjects} objects
 * @property {import("./masks.js").Masks} masks
 * @property {import("./edits.js").Edits} edits
 * @property {import("./player.js").Player} player
 * @property {import("../elements/frame-canvas.js").FrameCanvas} canvas
 */

const PREVIEW_PX = 960; // width of a blank mask, where there is none to paint on
const SIZES = { least: 4, most: 160 }; // of the brush, in pixels of the screen

export class Painter extends EventTarget {
  project = "";
  /** @type {Tool | null} */
  tool = null;
  #known;
  #size = 24;
  /** Corners placed so far, of one object in one frame. @type {Spot[]} */
  #polygon = [];
  /** Queue of strokes: each is painted over the result of the one before it. */
  #work = Promise.resolve();

  /** @param {Known} known */
  constructor(known) {
    super();
    this.#known = known;
    known.player.addEventListener("frame", () => this.#drop());
    known.objects.addEventListener("choose", () => this.#drop());
  }

  /** Activate a tool, or deactivate it if it is active. @param {Tool | null} tool */
  use(tool) {
    this.tool = this.tool === tool ? null : tool;
    this.#polygon = [];
    this.#show();
    this.dispatchEvent(new Event("tool"));
  }

  /** @param {number} factor */
  resize(factor) {
    this.#size = Math.min(Math.max(this.#size * factor, SIZES.least), SIZES.most);
    this.#show();
  }

  /** Handle a press without a drag: a polygon corner, or a dot. @param {Spot} at @returns {boolean} whether a tool is active */
  click(at) {
    if (!this.tool) return false;
    if (this.tool !== "polygon") this.stroke([at, at]);
    else if (!this.#now) say("Choose an object first.");
    else this.#setPolygon([...this.#polygon, at]);
    return true;
  }

  /** Discard the corners: they belong to the object and the frame they were clicked in. */
  #drop() {
    if (this.#polygon.length) this.#setPolygon([]);
  }

  /** @param {Spot[]} corners */
  #setPolygon(corners) {
    this.#polygon = corners;
    this.#known.canvas.setPath(corners);
  }

  /** Close the polygon. @returns {boolean} whether there was one */
  close() {
    if (this.#polygon.length < 3) return false;
    const corners = this.#polygon;
    this.#setPolygon([]);
    this.#paint(corners, "lasso");
    return true;
  }

  /** @param {Spot[]} path */
  stroke(path) {
    if (this.tool && this.tool !== "polygon") this.#paint(path, this.tool);
  }

  /** Keep the shown mask as it is. */
  keep() {
    this.#change((mask) => mask, false);
  }

  /** Mark the object as not visible in this frame, or restore its mask as found if it is already marked. */
  absent() {
    const { object, frame } = this.#now ?? {};
    if (!object || frame === undefined) return say("Choose an object first.");
    const said = object.frames.some((one) => one.frame === frame && !one.visible);
    const change = said
      ? changes.leaveFrame(this.project, object.id, frame)
      : changes.setFrame(this.project, object.id, frame, null);
    this.#local = null;
    this.#store(change, `${object.name}: ${said ? "mask as found" : "not visible"} in frame ${frame}`);
    return undefined;
  }

  /** @param {Spot[]} path @param {Tool} tool */
  #paint(path, tool) {
    const width = this.#size / this.#known.canvas.scale;
    this.#change((mask, size) => painted(mask, path, tool, width, size), tool !== "eraser");
  }

  /** @param {Alter} alter @param {boolean} fromNothing whether it needs no mask to begin with */
  #change(alter, fromNothing) {
    const now = this.#now;
    if (!now) return void say("Choose an object first.");
    this.#work = this.#work.then(() => this.#alter(now, alter, fromNothing)).catch(sayError);
  }

  /** @param {Place} now @param {Alter} alter @param {boolean} fromNothing */
  async #alter(now, alter, fromNothing) {
    const { object, frame, size } = now;
    const coming = this.#isComing(object.id); // checked first: a mask still missing after that will not arrive
    const before = await this.#maskOf(now);
    const where = `${object.name} in frame ${frame}`;
    if (!before && coming) return say(`The mask of ${where} is still loading: try again in a moment.`);
    if (!before && !fromNothing) return say(`There is no mask of ${where}.`);
    const mask = alter(before ?? blank(size), size);
    const gone = isEmpty(mask);
    this.#local = { object: object.id, frame, mask, bits: await encoded(mask), version: null };
    const change = changes.setFrame(this.project, object.id, frame, gone ? null : runsOf(mask));
    this.#store(change, gone ? `${object.name}: not visible in frame ${frame}` : undefined);
    this.#known.masks.forget(object.id, frame);
    this.dispatchEvent(new CustomEvent("painted", { detail: frame }));
    return undefined;
  }

  /** Whether the object's masks may change: it is being segmented, or changes are not stored yet. @param {number} object */
  #isComing(object) {
    return outbox.waiting > 0 || isComing(this.#known.objects.get(object) ?? { segment: "" });
  }

  /**
   * Last painted mask, which the server may not have returned yet.
   * @type {{ object: number, frame: number, mask: Mask, bits: MaskBits, version: number | null } | null}
   */
  #local = null;

  /** Show the last painted mask until the server returns it. */
  restore() {
    const last = this.#local;
    if (!last || !this.#isNewest(last) || this.#known.masks.on(last.object, last.frame)) return;
    const { object, frame, bits } = last;
    this.#known.masks.receive({ object, frame, confidence: 1, source: "live", mask: bits });
  }

  /** Whether the object has not changed since. @param {{ object: number, version: number | null }} last */
  #isNewest({ object, version }) {
    return version === null || version === this.#known.objects.get(object)?.version;
  }

  /**
   * Mask to paint on: the last painted one, else the cached one, else the stored one; null without one.
   * @param {Place} now
   * @returns {Promise<Mask | null>}
   */
  async #maskOf({ object, frame }) {
    const last = this.#local;
    if (last?.object === object.id && last.frame === frame && this.#isNewest(last)) return last.mask;
    const known = this.#known.masks.on(object.id, frame) ?? (await this.#stored(object.id, frame));
    return known ? wholeMask(known.mask, await decodeBox(known.mask)) : null;
  }

  /** @param {number} object @param {number} frame */
  async #stored(object, frame) {
    if (outbox.waiting) return undefined; // pending changes may replace it
    return (await getMasks(this.project, frame)).find((mask) => mask.object === object);
  }

  /** @param {import("../changes.js").Change<import("../api-types").SceneObject>} change @param {string} [text] */
  #store(change, text) {
    this.#known.edits.save(change).then(
      (stored) => {
        if (this.#local?.object === stored.id) this.#local.version = stored.version;
        this.#known.objects.answered(stored);
        if (text) say(text);
      },
      () => (this.#local = null), // save() has shown the error
    );
  }

  /** @returns {Place | null} */
  get #now() {
    const { objects, player } = this.#known;
    const { chosen } = objects;
    const { frame } = player;
    return chosen && frame
      ? { object: chosen, frame: frame.index, size: { width: frame.width, height: frame.height } }
      : null;
  }

  #show() {
    this.#known.canvas.setBrush(this.tool, this.#size);
    this.#known.canvas.setPath(this.#polygon);
  }
}

/** Empty mask to paint on. @param {Size} size of the frame @returns {Mask} */
function blank(size) {
  const width = Math.min(PREVIEW_PX, size.width);
  const height = Math.max(Math.round((size.height * width) / size.width), 1);
  return { width, height, pixels: new Uint8Array(width * height) };
}

/**
 * @param {Mask} mask
 * @param {Spot[]} path in pixels of the frame
 * @param {Tool} tool
 * @param {number} brush across, in pixels of the frame
 * @param {Size} size of the frame
 * @returns {Mask}
 */
function painted({ width, height, pixels }, path, tool, brush, size) {
  const canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  if (!context) throw new Error("this browser cannot paint");
  const image = context.createImageData(width, height);
  for (let i = 0; i < pixels.length; i++) image.data[4 * i + 3] = pixels[i] ? 255 : 0;
  context.putImageData(image, 0, 0);
  context.scale(width / size.width, height / size.height);
  context.globalCompositeOperation = tool === "eraser" ? "destination-out" : "source-over";
  context.lineWidth = brush;
  context.lineCap = "round";
  context.lineJoin = "round";
  context.beginPath();
  for (const { x, y } of path) context.lineTo(x, y);
  if (tool === "lasso") context.fill();
  else context.stroke();
  const { data } = context.getImageData(0, 0, width, height);
  return { width, height, pixels: pixels.map((_, i) => ((data[4 * i + 3] ?? 0) > 127 ? 1 : 0)) };
}
