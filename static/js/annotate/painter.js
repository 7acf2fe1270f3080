/**
 * The chosen object's mask in the shown frame, painted: a brush, an eraser, a lasso and a polygon; kept as it is, or said not to
 * be there. What is set right stands, whatever is found later. Says "tool" when another one or none is used.
 */

import * as changes from "../changes.js";
import { say } from "../elements/toasts.js";
import { decodeBox } from "../lib/masks.js";
import { encoded, runsOf, wholeMask } from "../lib/painting.js";

/** @typedef {import("../api-types").MaskBits} MaskBits */
/** @typedef {import("../lib/painting.js").Mask} Mask */
/** @typedef {"brush" | "eraser" | "lasso" | "polygon"} Tool */
/** @typedef {{ x: number, y: number }} Spot in pixels of the frame */
/**
 * @typedef {object} Known
 * @property {import("./scene-objects.js").SceneObjects} objects
 * @property {import("./masks.js").Masks} masks
 * @property {import("./edits.js").Edits} edits
 * @property {import("./player.js").Player} player
 * @property {import("../elements/frame-canvas.js").FrameCanvas} canvas
 */

const PREVIEW_PX = 960; // across, where there is no mask to paint on
const SIZES = { least: 4, most: 160 }; // of the brush, in pixels of the screen

export class Painter extends EventTarget {
  project = "";
  /** @type {Tool | null} */
  tool = null;
  #known;
  #size = 24;
  /** Corners so far. @type {Spot[]} */
  #polygon = [];
  /** One stroke after the other: each is painted over the one before it. */
  #work = Promise.resolve();

  /** @param {Known} known */
  constructor(known) {
    super();
    this.#known = known;
  }

  /** Use a tool, or leave it. @param {Tool | null} tool */
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

  /** A press that did not wander: a corner of the polygon, or a dot. @param {Spot} at @returns {boolean} whether it was for a tool */
  click(at) {
    if (!this.tool) return false;
    if (this.tool === "polygon") {
      this.#polygon = [...this.#polygon, at];
      this.#known.canvas.setPath(this.#polygon);
    } else this.stroke([at, at]);
    return true;
  }

  /** Close the polygon. @returns {boolean} whether there was one */
  close() {
    if (this.#polygon.length < 3) return false;
    const corners = this.#polygon;
    this.#polygon = [];
    this.#known.canvas.setPath([]);
    this.#paint(corners, "lasso");
    return true;
  }

  /** @param {Spot[]} path */
  stroke(path) {
    if (this.tool && this.tool !== "polygon") this.#paint(path, this.tool);
  }

  /** What is shown stands. */
  keep() {
    this.#change((mask) => mask);
  }

  /** The object is not visible in this frame, or it is as found there again. */
  absent() {
    const { object, frame } = this.#now ?? {};
    if (!object || frame === undefined) return say("Choose an object first.");
    const said = object.frames.some((one) => one.frame === frame && !one.visible);
    const change = said
      ? changes.leaveFrame(this.project, object.id, frame)
      : changes.setFrame(this.project, object.id, frame, null);
    this.#local = null;
    this.#store(change, `${object.name}: ${said ? "as found again" : "not visible"} in frame ${frame}`);
    return undefined;
  }

  /** @param {Spot[]} path @param {Tool} tool */
  #paint(path, tool) {
    const width = this.#size / this.#known.canvas.scale;
    this.#change((mask, size) => painted(mask, path, tool, width, size));
  }

  /** @param {(mask: Mask, size: { width: number, height: number }) => Mask} alter */
  #change(alter) {
    const now = this.#now;
    if (!now) return void say("Choose an object first.");
    this.#work = this.#work.then(async () => {
      const mask = alter(await this.#maskOf(now), now.size);
      this.#local = { object: now.object.id, frame: now.frame, mask, bits: await encoded(mask), version: null };
      this.#store(changes.setFrame(this.project, now.object.id, now.frame, runsOf(mask)));
      this.#known.masks.forget(now.object.id, now.frame);
      this.dispatchEvent(new CustomEvent("painted", { detail: now.frame }));
    });
  }

  /** What was painted last: it may not have come back yet. @type {{ object: number, frame: number, mask: Mask, bits: MaskBits, version: number | null } | null} */
  #local = null;

  /** Show what was painted last until it comes back. */
  restore() {
    const last = this.#local;
    if (!last || !this.#isNewest(last) || this.#known.masks.on(last.object, last.frame)) return;
    const { object, frame, bits } = last;
    this.#known.masks.receive({ object, frame, confidence: 1, source: "live", mask: bits });
  }

  /** Whether nothing was changed about the object since. @param {{ object: number, version: number | null }} last */
  #isNewest({ object, version }) {
    return version === null || version === this.#known.objects.get(object)?.version;
  }

  /** @param {{ object: { id: number }, frame: number, size: { width: number, height: number } }} now @returns {Promise<Mask>} */
  async #maskOf({ object, frame, size }) {
    const known = this.#known.masks.on(object.id, frame)?.mask;
    const last = this.#local;
    if (last?.object === object.id && last.frame === frame && this.#isNewest(last)) return last.mask;
    if (known) return wholeMask(known, await decodeBox(known));
    const width = Math.min(PREVIEW_PX, size.width);
    const height = Math.max(Math.round((size.height * width) / size.width), 1);
    return { width, height, pixels: new Uint8Array(width * height) };
  }

  /** @param {import("../changes.js").Change<import("../api-types").SceneObject>} change @param {string} [text] */
  #store(change, text) {
    this.#known.edits.save(change).then(
      (stored) => {
        if (this.#local?.object === stored.id) this.#local.version = stored.version;
        this.#known.objects.answered(stored);
        if (text) say(text);
      },
      () => (this.#local = null), // said where it was refused
    );
  }

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

/**
 * @param {Mask} mask
 * @param {Spot[]} path in pixels of the frame
 * @param {Tool} tool
 * @param {number} brush across, in pixels of the frame
 * @param {{ width: number, height: number }} size of the frame
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
