/**
 * One frame with masks, clicks and comments. Emits "click-point" {x, y, label, hold}, "draw-box" {from, to, hold},
 * "move-point" {id, x, y}, "remove-point" {id}, "pick-pin" id.
 * Zoom with the wheel or two fingers, pan with the middle button, Alt-drag or two fingers; a crosshair moved by arrows
 * replaces the mouse.
 */

import { h, LiveElement } from "../dom.js";
import { decodeBox, paintBox } from "../lib/masks.js";
import { drawOutline } from "../lib/outlines.js";
import { fit, pinch, toImage, toScreen, zoom } from "../lib/view.js";

/** @typedef {import("../api-types").MaskBits} MaskBits */
/** @typedef {import("../api-types").Point} Point */
/** @typedef {{ object: number, colour: [number, number, number], mask: MaskBits, current: boolean }} Layer */
/** @typedef {Point & { colour: string, number: number, object: number, current: boolean }} Marker */
/** @typedef {{ id: number, x: number, y: number, text: string }} Pin */
/** @typedef {{ points: number[][], handle: number[][], label: string, current: boolean }} Outline */

const GRIP_PX = 11;
const STILL_PX = 3; // a press that wanders less is a click
const STILL_TOUCH_PX = 10; // a finger is less steady

export class FrameCanvas extends LiveElement {
  #canvas = h("canvas", { tabIndex: 0, role: "img", "aria-label": "Frame" });
  #size = { width: 1, height: 1 };
  /** @type {import("../lib/view.js").View} */
  #view = { scale: 1, x: 0, y: 0 };
  #fitted = true;
  /** @type {HTMLImageElement | null} */
  #image = null;
  /** @type {{ box: MaskBits, bitmap: ImageBitmap, current: boolean }[]} */
  #painted = [];
  /** @type {Marker[]} */
  #markers = [];
  /** @type {Outline[]} */
  #outlines = [];
  /** @type {Pin[]} */
  #pins = [];
  /** @type {{ x: number, y: number } | null} */
  #crosshair = null;
  /** @type {{ marker: Marker | null, x: number, y: number, start: { x: number, y: number }, pan: boolean, moved: boolean } | null} */
  #drag = null;
  #paintings = 0;
  /** Fingers and pens that are down. @type {Map<number, { x: number, y: number }>} */
  #pressed = new Map();
  /** What a click says: 1 adds, 0 takes away; the right button and Shift say the opposite. @type {0 | 1} */
  sign = 1;
  opacity = 0.42;
  raw = false;

  connected() {
    this.replaceChildren(this.#canvas);
    const { signal } = this;
    const canvas = this.#canvas;
    canvas.addEventListener("pointerdown", (event) => this.#down(event), { signal });
    canvas.addEventListener("pointermove", (event) => this.#move(event), { signal });
    canvas.addEventListener("pointerup", (event) => this.#up(event), { signal });
    canvas.addEventListener("pointercancel", (event) => this.#cancel(event), { signal });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault(), { signal });
    canvas.addEventListener("wheel", (event) => this.#wheel(event), { signal, passive: false });
    const observer = new ResizeObserver(() => this.#resize());
    observer.observe(this);
    signal.addEventListener("abort", () => observer.disconnect());
  }

  /**
   * The frame to show; its size is that of the stored frame, whatever the preview's.
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
    this.draw();
  }

  /** @param {Layer[]} layers */
  async setMasks(layers) {
    const painting = ++this.#paintings;
    const painted = await Promise.all(
      layers
        .filter((layer) => layer.mask.box_width > 0)
        .map(async ({ mask, colour, current }) => {
          const pixels = await decodeBox(mask);
          const opacity = current ? this.opacity : this.opacity * 0.6;
          const rgba = paintBox(pixels, mask.box_width, mask.box_height, colour, opacity);
          const bitmap = await createImageBitmap(new ImageData(rgba, mask.box_width, mask.box_height));
          return { box: mask, bitmap, current };
        }),
    );
    if (painting !== this.#paintings) return; // a newer set is on its way
    for (const { bitmap } of this.#painted) bitmap.close();
    this.#painted = painted;
    this.draw();
  }

  /** @param {Marker[]} markers */
  setMarkers(markers) {
    this.#markers = markers;
    this.draw();
  }

  /** @param {Outline[]} outlines of what is proposed */
  setOutlines(outlines) {
    this.#outlines = outlines;
    this.draw();
  }

  /** @param {Pin[]} pins comments on this frame */
  setPins(pins) {
    this.#pins = pins;
    this.draw();
  }

  fit() {
    this.#view = fit(this.#size, { width: Math.max(this.clientWidth, 1), height: Math.max(this.clientHeight, 1) });
    this.#fitted = true;
    this.draw();
  }

  get crosshair() {
    return this.#crosshair;
  }

  /** @param {boolean} on */
  showCrosshair(on) {
    this.#crosshair = on ? { x: this.#size.width / 2, y: this.#size.height / 2 } : null;
    if (on) this.#canvas.focus();
    this.draw();
  }

  /**
   * @param {number} dx
   * @param {number} dy
   */
  moveCrosshair(dx, dy) {
    if (!this.#crosshair) return;
    const step = this.#size.width / 100;
    this.#crosshair.x = Math.min(Math.max(this.#crosshair.x + dx * step, 0.5), this.#size.width - 0.5);
    this.#crosshair.y = Math.min(Math.max(this.#crosshair.y + dy * step, 0.5), this.#size.height - 0.5);
    this.draw();
  }

  draw() {
    const context = this.#canvas.getContext("2d");
    if (!context) return;
    const ratio = devicePixelRatio;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, this.clientWidth, this.clientHeight);
    const { scale, x, y } = this.#view;
    if (this.#image) context.drawImage(this.#image, x, y, this.#size.width * scale, this.#size.height * scale);
    if (this.raw) return;
    for (const { box, bitmap } of this.#painted) {
      const step = (this.#size.width / box.width) * scale; // masks come at preview size
      context.drawImage(bitmap, x + box.left * step, y + box.top * step, box.box_width * step, box.box_height * step);
    }
    for (const outline of this.#outlines) drawOutline(context, this.#view, outline);
    for (const marker of this.#markers) this.#drawMarker(context, marker);
    for (const pin of this.#pins) this.#drawPin(context, toScreen(this.#view, pin));
    this.#drawBox(context);
    if (this.#crosshair) this.#drawCrosshair(context, toScreen(this.#view, this.#crosshair));
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Marker} marker
   */
  #drawMarker(context, marker) {
    const { x, y } = toScreen(this.#view, marker);
    context.globalAlpha = marker.current ? 1 : 0.55;
    context.beginPath();
    context.arc(x, y, 9, 0, 2 * Math.PI);
    context.fillStyle = marker.label ? marker.colour : "#ffffff";
    context.fill();
    context.lineWidth = 2.5;
    context.strokeStyle = marker.label ? "#ffffff" : "#d0241b";
    context.stroke();
    context.beginPath(); // plus or minus: never colour alone
    context.moveTo(x - 4, y);
    context.lineTo(x + 4, y);
    if (marker.label) {
      context.moveTo(x, y - 4);
      context.lineTo(x, y + 4);
    }
    context.lineWidth = 2;
    context.strokeStyle = marker.label ? "#10131a" : "#d0241b";
    context.stroke();
    context.globalAlpha = 1;
  }

  /**
   * A speech bubble whose tip is the spot.
   * @param {CanvasRenderingContext2D} context
   * @param {{ x: number, y: number }} at
   */
  #drawPin(context, { x, y }) {
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(x + 5, y - 8);
    context.roundRect(x - 2, y - 26, 24, 18, 5);
    context.fillStyle = "#ffe14d";
    context.fill();
    context.lineWidth = 1.5;
    context.strokeStyle = "#10131a";
    context.stroke();
    context.fillStyle = "#10131a";
    for (const dot of [4, 10, 16]) context.fillRect(x + dot - 1, y - 18, 3, 3);
  }

  /** The box being drawn. @param {CanvasRenderingContext2D} context */
  #drawBox(context) {
    const drag = this.#drag;
    if (!drag || !drag.moved || drag.pan || drag.marker) return;
    for (const [width, style] of /** @type {const} */ ([
      [3, "#10131a"],
      [1.5, "#ffe14d"],
    ])) {
      context.lineWidth = width;
      context.strokeStyle = style;
      context.strokeRect(drag.start.x, drag.start.y, drag.x - drag.start.x, drag.y - drag.start.y);
    }
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {{ x: number, y: number }} at
   */
  #drawCrosshair(context, { x, y }) {
    for (const [width, style] of /** @type {const} */ ([
      [4, "#000000"],
      [2, "#ffe14d"],
    ])) {
      context.beginPath();
      context.moveTo(x - 18, y);
      context.lineTo(x + 18, y);
      context.moveTo(x, y - 18);
      context.lineTo(x, y + 18);
      context.lineWidth = width;
      context.strokeStyle = style;
      context.stroke();
    }
  }

  /** @param {PointerEvent | WheelEvent} event */
  #at(event) {
    const box = this.#canvas.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  /** @param {{ x: number, y: number }} at */
  #markerAt(at) {
    return this.#markers.findLast((marker) => {
      const screen = toScreen(this.#view, marker);
      return marker.current && Math.hypot(screen.x - at.x, screen.y - at.y) <= GRIP_PX;
    });
  }

  /** @param {PointerEvent} event */
  #down(event) {
    this.#canvas.setPointerCapture(event.pointerId);
    const at = this.#at(event);
    this.#pressed.set(event.pointerId, at);
    if (this.#pressed.size > 1) return this.#cancel(); // two fingers zoom and pan
    const pan = event.button === 1 || event.altKey;
    this.#drag = { ...at, start: at, marker: pan ? null : (this.#markerAt(at) ?? null), pan, moved: false };
    if (event.button === 1) event.preventDefault();
  }

  /** @param {PointerEvent} event */
  #move(event) {
    const drag = this.#drag;
    const at = this.#at(event);
    if (this.#pressed.size > 1) return this.#pinch(event.pointerId, at);
    if (!drag) return;
    const still = event.pointerType === "touch" ? STILL_TOUCH_PX : STILL_PX;
    if (Math.hypot(at.x - drag.start.x, at.y - drag.start.y) > still) drag.moved = true;
    if (!drag.moved) return;
    if (drag.pan) {
      this.#view = { ...this.#view, x: this.#view.x + at.x - drag.x, y: this.#view.y + at.y - drag.y };
      this.#fitted = false;
      this.#drag = { ...drag, ...at };
    } else if (drag.marker) {
      Object.assign(drag.marker, this.#clamped(toImage(this.#view, at)));
    } else Object.assign(drag, at);
    this.draw();
  }

  /** @param {PointerEvent} event */
  #up(event) {
    const drag = this.#drag;
    this.#drag = null;
    this.#pressed.delete(event.pointerId);
    if (!drag || drag.pan) return;
    const position = toImage(this.#view, this.#at(event));
    if (drag.marker && drag.moved) this.emit("move-point", { id: drag.marker.id, ...this.#clamped(position) });
    else if (drag.marker) this.emit("remove-point", { id: drag.marker.id });
    else if (drag.moved) this.#endBox(drag.start, position, event);
    else if (this.#pinAt(this.#at(event))) this.emit("pick-pin", this.#pinAt(this.#at(event))?.id);
    else if (this.#inside(position)) {
      const label = event.button === 2 || event.shiftKey ? (this.sign === 1 ? 0 : 1) : this.sign;
      this.emit("click-point", { ...position, label, hold: event.ctrlKey || event.metaKey });
    }
  }

  /** Forget what was being pressed. @param {PointerEvent} [event] */
  #cancel(event) {
    if (event) this.#pressed.delete(event.pointerId);
    this.#drag = null;
    this.draw();
  }

  /**
   * @param {number} pointer that moved
   * @param {{ x: number, y: number }} to
   */
  #pinch(pointer, to) {
    const before = [...this.#pressed.values()].slice(0, 2);
    this.#pressed.set(pointer, to);
    this.#view = pinch(this.#view, before, [...this.#pressed.values()].slice(0, 2), this.#least);
    this.#fitted = false;
    this.draw();
  }

  /** The smallest scale worth having. */
  get #least() {
    return 0.8 * fit(this.#size, { width: this.clientWidth, height: this.clientHeight }).scale;
  }

  /**
   * @param {{ x: number, y: number }} start on the screen
   * @param {{ x: number, y: number }} end in the image
   * @param {PointerEvent} event
   */
  #endBox(start, end, event) {
    this.draw();
    if (event.button !== 0) return;
    const [from, to] = [this.#clamped(toImage(this.#view, start)), this.#clamped(end)];
    this.emit("draw-box", { from, to, hold: event.ctrlKey || event.metaKey });
  }

  /** @param {{ x: number, y: number }} at on the screen */
  #pinAt(at) {
    return this.#pins.findLast((pin) => {
      const tip = toScreen(this.#view, pin);
      return at.x >= tip.x - 4 && at.x <= tip.x + 24 && at.y >= tip.y - 28 && at.y <= tip.y;
    });
  }

  /** @param {{ x: number, y: number }} position */
  #inside({ x, y }) {
    return x >= 0 && y >= 0 && x < this.#size.width && y < this.#size.height;
  }

  /** @param {{ x: number, y: number }} position */
  #clamped({ x, y }) {
    return {
      x: Math.min(Math.max(x, 0.5), this.#size.width - 0.5),
      y: Math.min(Math.max(y, 0.5), this.#size.height - 0.5),
    };
  }

  /** @param {WheelEvent} event */
  #wheel(event) {
    event.preventDefault();
    this.#view = zoom(this.#view, Math.exp(-event.deltaY / 400), this.#at(event), this.#least);
    this.#fitted = false;
    this.draw();
  }

  #resize() {
    this.#canvas.width = Math.round(this.clientWidth * devicePixelRatio);
    this.#canvas.height = Math.round(this.clientHeight * devicePixelRatio);
    if (this.#fitted) this.fit();
    else this.draw();
  }
}
