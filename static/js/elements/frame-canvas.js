/**
 * Canvas of one frame with masks, clicks and comments. Emits "click-point" {x, y, label, hold}, "draw-box" {from, to, hold},
 * "move-point" {id, x, y}, "remove-point" {id}, "pick-pin" id, and "view" after each redraw; while a brush is set, "paint" path
 * instead of boxes. Zoom with the wheel or a pinch, pan with the middle button, Space- or Alt-drag or two fingers; a crosshair
 * moved by arrow keys replaces the mouse. Masks are tagged with their object's number, the current and the hovered one also
 * with its name.
 */

import { h, LiveElement, wire } from "../dom.js";
import {
  clearOf,
  drawBox,
  drawClick,
  drawPath,
  drawCrosshair,
  drawPin,
  drawTag,
  isOnClick,
  isOnPin,
} from "../lib/frame-marks.js";
import { Gestures } from "../lib/gestures.js";
import { decodeBox, paintBox } from "../lib/masks.js";
import { Newest } from "../lib/newest.js";
import { drawOutline } from "../lib/outlines.js";
import { clamped, fit, isInside, pinch, toImage, toScreen, zoom } from "../lib/view.js";

/** @typedef {import("../api-types").MaskBits} MaskBits */
/** @typedef {import("../api-types").Point} Point */
/** @typedef {import("../lib/gestures.js").At} At */
/** @typedef {{ object: number, number: number, name: string, colour: [number, number, number], mask: MaskBits, current: boolean }} Layer */
/** @typedef {Point & { colour: string, number: number, object: number, current: boolean }} Marker */
/** @typedef {{ layer: Layer, box: MaskBits, pixels: Uint8Array, bitmap: ImageBitmap, close(): void }} Painted */
/** @typedef {{ id: number, x: number, y: number, text: string }} Pin */
/** @typedef {{ points: number[][], handle: number[][], label: string, current: boolean }} Outline */

const STILL_PX = 3; // a press that moves less is a click
const STILL_TOUCH_PX = 10; // a finger is less steady

export class FrameCanvas extends LiveElement {
  #canvas = h("canvas", { tabIndex: 0, role: "img", "aria-label": "Frame" });
  #size = { width: 1, height: 1 };
  /** @type {import("../lib/view.js").View} */
  #view = { scale: 1, x: 0, y: 0 };
  #fitted = true;
  /** @type {HTMLImageElement | null} */
  #image = null;
  /** @type {Newest<Painted>} */
  #painted = new Newest();
  /** @type {Marker[]} */
  #markers = [];
  /** @type {Outline[]} */
  #outlines = [];
  /** @type {Pin[]} */
  #pins = [];
  /** @type {At | null} */
  #crosshair = null;
  #raw = false;
  /** The object under the pointer. @type {number | null} */
  #hovered = null;
  /** Whether Space is down, so that a drag pans, and whether a drag has panned since. */
  #space = { held: false, panned: false };
  /** @type {{ tool: string, px: number } | null} */
  #brush = null;
  /** The stroke being drawn, or the corners of a polygon, in frame pixels. @type {At[]} */
  #path = [];
  /** @type {Gestures<Marker>} */
  #gestures = new Gestures();
  /** Label of a click: 1 adds, 0 subtracts; the right button and Shift invert it. @type {0 | 1} */
  sign = 1;
  opacity = 0.42;

  connected() {
    this.replaceChildren(this.#canvas);
    wire(this, this.#canvas, {
      down: (event) => this.#down(event),
      move: (event) => this.#move(event),
      up: (event) => this.#up(event),
      cancel: (event) => this.#cancel(event),
      wheel: (event) => this.#wheel(event),
      resized: () => this.#resize(),
    });
  }

  focus() {
    this.#canvas.focus();
  }

  // Display

  /**
   * Set the frame; the size is that of the stored frame, not of the preview.
   * @param {HTMLImageElement} image
   * @param {{ width: number, height: number }} size
   * @param {string} label
   */
  setFrame(image, size, label) {
    const changed = size.width !== this.#size.width || size.height !== this.#size.height;
    this.#image = image;
    this.#size = size;
    this.#canvas.setAttribute("aria-label", label);
    if (changed || this.#fitted) this.fit();
    else this.#draw();
  }

  /** Whether the zoom needs a larger picture than the one loaded. */
  get wantsMore() {
    const held = this.#image?.naturalWidth ?? 0;
    return held > 0 && held < this.#size.width && this.#size.width * this.#view.scale * devicePixelRatio > held;
  }

  /** @param {Layer[]} layers */
  async setMasks(layers) {
    const painting = layers.filter(({ mask }) => mask.box_width > 0).map((layer) => paint(layer, this.opacity));
    if (await this.#painted.take(painting)) this.#draw();
  }

  /** @param {Marker[]} markers */
  setMarkers(markers) {
    this.#markers = markers;
    this.#draw();
  }

  /** @param {Outline[]} outlines of the proposals */
  setOutlines(outlines) {
    this.#outlines = outlines;
    this.#draw();
  }

  /** @param {Pin[]} pins comments on this frame */
  setPins(pins) {
    this.#pins = pins;
    this.#draw();
  }

  /** Show the frame alone, or with its overlays. @param {boolean} on */
  showRaw(on) {
    this.#raw = on;
    this.#draw();
  }

  /** Set the brush, `px` wide on the screen; null: a drag draws a box. @param {string | null} tool @param {number} px */
  setBrush(tool, px) {
    this.#brush = tool === null ? null : { tool, px };
    this.#draw();
  }

  /** @param {At[]} path corners so far */
  setPath(path) {
    this.#path = path;
    this.#draw();
  }

  /** Screen pixels per frame pixel. */
  get scale() {
    return this.#view.scale;
  }

  /** Position and scale of the frame on the screen. */
  get view() {
    return this.#view;
  }

  /** Set whether Space is down. @param {boolean} held @returns {boolean} whether a drag panned since it went down */
  holdSpace(held) {
    const { panned } = this.#space;
    if (held !== this.#space.held) this.#space = { held, panned: false };
    return panned;
  }

  /** Ids of the objects whose masks cover a position of the frame, topmost first. @param {At} at @returns {number[]} */
  objectsAt({ x, y }) {
    const there = this.#painted.held.filter(({ box, pixels }) => {
      const step = box.width / this.#size.width;
      const [column, row] = [Math.floor(x * step) - box.left, Math.floor(y * step) - box.top];
      const inside = column >= 0 && row >= 0 && column < box.box_width && row < box.box_height;
      return inside && pixels[row * box.box_width + column] === 1;
    });
    return there.map(({ layer }) => layer.object).toReversed();
  }

  fit() {
    this.#view = fit(this.#size, this.#room);
    this.#fitted = true;
    this.#draw();
  }

  get crosshair() {
    return this.#crosshair;
  }

  /** @param {boolean} on */
  showCrosshair(on) {
    this.#crosshair = on ? { x: this.#size.width / 2, y: this.#size.height / 2 } : null;
    if (on) this.#canvas.focus();
    this.#draw();
  }

  /**
   * @param {number} dx in steps
   * @param {number} dy
   */
  moveCrosshair(dx, dy) {
    if (!this.#crosshair) return;
    const step = this.#size.width / 100;
    const { x, y } = this.#crosshair;
    this.#crosshair = clamped({ x: x + dx * step, y: y + dy * step }, this.#size);
    this.#draw();
  }

  #draw() {
    const context = this.#canvas.getContext("2d");
    if (!context) return;
    const ratio = devicePixelRatio;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, this.clientWidth, this.clientHeight);
    const { scale, x, y } = this.#view;
    if (this.#image) context.drawImage(this.#image, x, y, this.#size.width * scale, this.#size.height * scale);
    if (!this.#raw) this.#drawOver(context);
    this.emit("view", null);
  }

  /** @param {CanvasRenderingContext2D} context */
  #drawOver(context) {
    const { scale, x, y } = this.#view;
    for (const { box, bitmap } of this.#painted.held) {
      const step = (this.#size.width / box.width) * scale; // masks have the preview's size
      context.drawImage(bitmap, x + box.left * step, y + box.top * step, box.box_width * step, box.box_height * step);
    }
    for (const { layer, box } of this.#painted.held) this.#drawTag(context, layer, box);
    for (const outline of this.#outlines) drawOutline(context, this.#view, outline);
    for (const marker of this.#markers) drawClick(context, toScreen(this.#view, marker), marker);
    for (const pin of this.#pins) drawPin(context, toScreen(this.#view, pin));
    if (this.#brush)
      drawPath(
        context,
        this.#path.map((at) => toScreen(this.#view, at)),
        this.#brush,
      );
    const { box } = this.#gestures;
    if (box && !this.#brush) drawBox(context, box.from, box.to);
    if (this.#crosshair) drawCrosshair(context, toScreen(this.#view, this.#crosshair));
  }

  /** @param {CanvasRenderingContext2D} context @param {Layer} layer @param {MaskBits} box */
  #drawTag(context, { object, number, name, colour, current }, box) {
    const step = this.#size.width / box.width;
    const middle = { x: (box.left + box.box_width / 2) * step, y: (box.top + box.box_height / 2) * step };
    const named = current || object === this.#hovered;
    const clicks = this.#markers.map((marker) => toScreen(this.#view, marker));
    drawTag(
      context,
      clearOf(toScreen(this.#view, middle), clicks),
      named ? `${number} ${name}` : String(number),
      colour,
    );
  }

  // Pointer events

  /** @param {PointerEvent} event */
  #down(event) {
    this.#canvas.setPointerCapture(event.pointerId);
    const at = this.#at(event);
    const pan = event.button === 1 || event.altKey || this.#space.held;
    this.#space.panned ||= this.#space.held;
    this.#gestures.press(event.pointerId, at, { pan, held: pan || this.#brush ? null : this.#markerAt(at) });
    if (event.button === 1) event.preventDefault();
  }

  /** @param {PointerEvent} event */
  #move(event) {
    const still = event.pointerType === "touch" ? STILL_TOUCH_PX : STILL_PX;
    const motion = this.#gestures.move(event.pointerId, this.#at(event), still);
    if (!motion) return this.#hover(this.#at(event));
    if (motion.kind === "pan") {
      const { scale, x, y } = this.#view;
      this.#see({ scale, x: x + motion.by.x, y: y + motion.by.y });
    } else if (motion.kind === "pinch") {
      this.#see(pinch(this.#view, motion.before, motion.after, this.#least));
    } else if (motion.kind === "carry") {
      Object.assign(motion.held, this.#inFrame(motion.at));
    } else if (this.#brush && this.#brush.tool !== "polygon") {
      if (!this.#path.length) this.#path = [this.#inFrame(motion.from)];
      this.#path.push(this.#inFrame(motion.to));
    }
    this.#draw();
  }

  /** @param {At} at on the screen */
  #hover(at) {
    const hovered = this.objectsAt(toImage(this.#view, at))[0] ?? null;
    if (hovered === this.#hovered) return;
    this.#hovered = hovered;
    this.#draw();
  }

  /** @param {PointerEvent} event */
  #up(event) {
    const meant = this.#gestures.release(event.pointerId, this.#at(event));
    this.#draw();
    const hold = event.ctrlKey || event.metaKey;
    if (meant?.kind === "drop") this.emit("move-point", { id: meant.held.id, ...this.#inFrame(meant.at) });
    else if (meant?.kind === "pick") this.emit("remove-point", { id: meant.held.id });
    else if (meant?.kind === "box" && this.#brush) this.#endStroke();
    else if (meant?.kind === "box" && event.button === 0)
      this.emit("draw-box", { from: this.#inFrame(meant.from), to: this.#inFrame(meant.to), hold });
    else if (meant?.kind === "click") this.#click(meant.at, event.button === 2 || event.shiftKey, hold);
  }

  /**
   * @param {At} at on the screen
   * @param {boolean} opposite
   * @param {boolean} hold
   */
  #click(at, opposite, hold) {
    const pin = this.#pins.findLast((one) => isOnPin(toScreen(this.#view, one), at));
    if (pin) return this.emit("pick-pin", pin.id);
    const position = toImage(this.#view, at);
    if (!isInside(position, this.#size)) return;
    this.emit("click-point", { ...position, label: opposite ? 1 - this.sign : this.sign, hold });
  }

  #endStroke() {
    const path = this.#path;
    if (this.#brush?.tool === "polygon") return;
    this.setPath([]);
    this.emit("paint", path);
  }

  /** @param {PointerEvent} event */
  #cancel(event) {
    this.#gestures.forget(event.pointerId);
    this.#draw();
  }

  /** @param {WheelEvent} event */
  #wheel(event) {
    event.preventDefault();
    this.#see(zoom(this.#view, Math.exp(-event.deltaY / 400), this.#at(event), this.#least));
    this.#draw();
  }

  /** @param {import("../lib/view.js").View} view set by the user */
  #see(view) {
    this.#view = view;
    this.#fitted = false;
  }

  // Coordinates

  /** @param {MouseEvent} event */
  #at({ clientX, clientY }) {
    const box = this.#canvas.getBoundingClientRect();
    return { x: clientX - box.left, y: clientY - box.top };
  }

  /** @param {At} at on the screen */
  #inFrame(at) {
    return clamped(toImage(this.#view, at), this.#size);
  }

  /** The current object's click at a position, to drag or remove; null if none. @param {At} at on the screen */
  #markerAt(at) {
    return this.#markers.findLast((one) => one.current && isOnClick(toScreen(this.#view, one), at)) ?? null;
  }

  get #room() {
    return { width: Math.max(this.clientWidth, 1), height: Math.max(this.clientHeight, 1) };
  }

  /** Smallest scale allowed. */
  get #least() {
    return 0.8 * fit(this.#size, this.#room).scale;
  }

  #resize() {
    this.#canvas.width = Math.round(this.clientWidth * devicePixelRatio);
    this.#canvas.height = Math.round(this.clientHeight * devicePixelRatio);
    if (this.#fitted) this.fit();
    else this.#draw();
  }
}

/**
 * @param {Layer} layer
 * @param {number} opacity of the current object's mask
 * @returns {Promise<Painted>}
 */
async function paint(layer, opacity) {
  const { mask, colour, current } = layer;
  const pixels = await decodeBox(mask);
  const rgba = paintBox(pixels, mask.box_width, mask.box_height, colour, current ? opacity : 0.6 * opacity);
  const bitmap = await createImageBitmap(new ImageData(rgba, mask.box_width, mask.box_height));
  return { layer, box: mask, pixels, bitmap, close: () => bitmap.close() };
}
