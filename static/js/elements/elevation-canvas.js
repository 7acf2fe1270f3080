/**
 * Canvas of a plane of the scan with its fronts. Emits "draw" Rect, "enclose" Rect (Shift-drag), "pick" {key, side, also},
 * "move" {key, rect} and "use-tool" {x, y}, all in metres from the plane's top left corner.
 * Zoom with the wheel or a pinch, pan with the middle button, Space-drag or two fingers; Alt turns snapping off.
 */

import { h, LiveElement, wire } from "../dom.js";
import { heightOf, middleOf, seenAfter, widthOf } from "../lib/elevation.js";
import { carried, drawn, heldAt, isLarge, settled, smallestAt } from "../lib/front-hits.js";
import { edgeMiddle, edgeOf, hingeLine, labelCorner, slideArrow } from "../lib/front-marks.js";
import { Gestures } from "../lib/gestures.js";
import { fit, pinch, toImage, toScreen, zoom } from "../lib/view.js";

/** @typedef {import("../lib/elevation.js").Rect} Rect */
/** @typedef {import("../lib/elevation.js").Side} Side */
/** @typedef {import("../lib/elevation.js").Box} Box */
/** @typedef {import("../lib/gestures.js").At} At */
/**
 * @typedef {{
 *   key: string, rect: Rect, name: string, paint: string, chosen: boolean, drawn: boolean,
 *   handle: Box | null, detected: boolean, hinge: Side | null, slides: boolean, overlaps: boolean, asked: Side[],
 * }} Shown
 */
/** @typedef {import("../lib/front-hits.js").Held} Held */
/** @typedef {(side: Side, at: number, rect: Rect, key: string | null, reach: number) => number} Snap */

const STILL_PX = 3;
const STILL_TOUCH_PX = 10;
const EDGE_PX = 7; // hit distance of an edge
const SNAP_PX = 9;
const ASKED_PX = 9;
const LOW_PX = 80; // height of a front up to which its label is one line

export class ElevationCanvas extends LiveElement {
  #canvas = h("canvas", { tabIndex: 0, role: "img", "aria-label": "Elevation" });
  /** @type {HTMLImageElement | null} */
  #image = null;
  #size = { width: 1, height: 1 };
  #cell = 1;
  /** @type {import("../lib/view.js").View} */
  #view = { scale: 1, x: 0, y: 0 };
  #fitted = true;
  /** @type {Shown[]} */
  #fronts = [];
  /** @type {Rect[]} */
  #cut = [];
  /** @type {Gestures<Held>} */
  #gestures = new Gestures();
  /** The front being drawn (key null) or dragged, as it would be stored. @type {{ key: string | null, rect: Rect } | null} */
  #preview = null;
  #from = { x: 0, y: 0 };
  #space = false;
  /** Pointer position in metres; null outside the canvas. @type {{ x: number, y: number } | null} */
  pointer = null;
  /** The edge moved by the arrow keys; null: the whole front. @type {Side | null} */
  edge = null;
  /** Whether a click applies the active tool. */
  tooled = false;
  /** @type {Snap} */
  snap = (_side, at) => at;

  connected() {
    this.replaceChildren(this.#canvas);
    wire(this, this.#canvas, {
      down: (event) => this.#down(event),
      move: (event) => this.#move(event),
      up: (event) => this.#up(event),
      cancel: (event) => this.#drop(event),
      wheel: (event) => this.#wheel(event),
      resized: () => this.#resize(),
    });
    const { signal } = this;
    this.#canvas.addEventListener("pointerleave", () => (this.pointer = null), { signal });
    const space = (/** @type {boolean} */ on) => (/** @type {KeyboardEvent} */ event) => {
      if (event.key === " ") this.#space = on;
    };
    document.addEventListener("keydown", space(true), { signal });
    document.addEventListener("keyup", space(false), { signal });
  }

  /**
   * @param {HTMLImageElement} image
   * @param {number} cell metres per pixel
   * @param {string} label
   */
  setPlane(image, cell, label) {
    this.#image = image;
    this.#cell = cell;
    this.#size = { width: image.naturalWidth * cell, height: image.naturalHeight * cell };
    this.#canvas.setAttribute("aria-label", label);
    this.fit();
  }

  /** @param {Shown[]} fronts @param {Rect[]} cut panels without a front */
  setFronts(fronts, cut) {
    this.#fronts = fronts;
    this.#cut = cut;
    this.draw();
  }

  /** Clear the preview of a drawing or drag. */
  stop() {
    this.#preview = null;
    this.draw();
  }

  get busy() {
    return this.#preview !== null;
  }

  fit() {
    const room = { width: Math.max(this.clientWidth - 32, 1), height: Math.max(this.clientHeight - 32, 1) };
    const { scale, x, y } = fit(this.#size, room);
    this.#view = { scale, x: x + 16, y: y + 16 };
    this.#fitted = true;
    this.draw();
  }

  /** @param {number} factor */
  zoomBy(factor) {
    this.#see(zoom(this.#view, factor, { x: this.clientWidth / 2, y: this.clientHeight / 2 }, this.#least));
  }

  /** Centre of the viewport, in metres. */
  get middle() {
    return toImage(this.#view, { x: this.clientWidth / 2, y: this.clientHeight / 2 });
  }

  draw() {
    const context = this.#canvas.getContext("2d");
    if (!context) return;
    const ratio = devicePixelRatio;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, this.clientWidth, this.clientHeight);
    const { scale, x, y } = this.#view;
    context.imageSmoothingEnabled = this.#cell * scale < 3;
    if (this.#image) context.drawImage(this.#image, x, y, this.#size.width * scale, this.#size.height * scale);
    for (const rect of this.#cut) this.#outline(context, rect, "#ffffff", 1, [3, 5]);
    for (const front of this.#fronts.toSorted((a, b) => Number(a.chosen) - Number(b.chosen)))
      this.#drawFront(context, front);
    if (this.#preview?.key === null) this.#drawSized(context, this.#preview.rect, "#ffffff", "");
  }

  /** @param {CanvasRenderingContext2D} context @param {Shown} front */
  #drawFront(context, front) {
    const rect = this.#preview?.key === front.key ? this.#preview.rect : front.rect;
    const { left, top, right, bottom } = this.#onScreen(rect);
    if (front.chosen) {
      context.fillStyle = `${front.paint}33`;
      context.fillRect(left, top, right - left, bottom - top);
    }
    this.#outline(context, rect, "#0d0f12", front.chosen ? 5 : 4, []);
    this.#outline(
      context,
      rect,
      front.overlaps ? "#ff5f52" : front.paint,
      front.chosen ? 3 : 2,
      front.drawn ? [] : [8, 4],
    );
    const handle = front.handle && front.detected ? seenAfter(front.handle, front.rect, rect) : front.handle;
    const covered = handle && this.#drawHandle(context, rect, handle, front.paint);
    if (front.hinge && front.slides)
      this.#stroke(context, slideArrow(this.#onScreen(rect), front.hinge), 2.5, front.paint);
    else if (front.hinge) this.#drawHinge(context, rect, front.hinge, front.paint);
    if (front.chosen && this.edge) this.#stroke(context, [edgeOf(this.#onScreen(rect), this.edge)], 6, "#ffffff");
    for (const side of front.asked) this.#drawAsked(context, rect, side);
    this.#drawLabel(context, rect, front.name, covered);
  }

  /** Draw the question mark of an edge. @param {CanvasRenderingContext2D} context @param {Rect} rect @param {Side} side */
  #drawAsked(context, rect, side) {
    const [x, y] = edgeMiddle(this.#onScreen(rect), side);
    context.beginPath();
    context.arc(x, y, ASKED_PX, 0, 2 * Math.PI);
    context.fillStyle = "#ffd166";
    context.fill();
    context.lineWidth = 1.5;
    context.strokeStyle = context.fillStyle = "#0d0f12";
    context.stroke();
    context.font = "bold 13px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText("?", x, y + 0.5);
    context.textAlign = "start";
    context.textBaseline = "alphabetic";
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Rect} rect
   * @param {string} colour
   * @param {number} width
   * @param {number[]} dashes
   */
  #outline(context, rect, colour, width, dashes) {
    const { left, top, right, bottom } = this.#onScreen(rect);
    context.lineWidth = width;
    context.strokeStyle = colour;
    context.setLineDash(dashes);
    context.strokeRect(left, top, right - left, bottom - top);
    context.setLineDash([]);
  }

  /**
   * Draw a handle and return its rectangle on the screen.
   * @param {CanvasRenderingContext2D} context
   * @param {Rect} rect
   * @param {Box} box
   * @param {string} colour
   */
  #drawHandle(context, rect, box, colour) {
    const { x, y } = middleOf(rect);
    const at = { left: x + box.left_m, right: x + box.right_m, top: y - box.top_m, bottom: y - box.bottom_m };
    const shown = this.#onScreen(at);
    context.fillStyle = colour;
    context.fillRect(shown.left, shown.top, shown.right - shown.left, shown.bottom - shown.top);
    this.#outline(context, at, "#0d0f12", 1, []);
    return shown;
  }

  /** @param {CanvasRenderingContext2D} context @param {Rect} rect @param {Side} side @param {string} colour */
  #drawHinge(context, rect, side, colour) {
    context.setLineDash([6, 5]);
    this.#stroke(context, [hingeLine(this.#onScreen(rect), side)], 1.5, colour);
    context.setLineDash([]);
  }

  /** @param {CanvasRenderingContext2D} context @param {[number, number][][]} lines @param {number} width @param {string} colour */
  #stroke(context, lines, width, colour) {
    context.beginPath();
    for (const line of lines) for (const [k, [x, y]] of line.entries()) k ? context.lineTo(x, y) : context.moveTo(x, y);
    context.lineWidth = width;
    context.strokeStyle = colour;
    context.stroke();
  }

  /** @param {CanvasRenderingContext2D} context @param {Rect} rect @param {string} colour @param {string} name */
  #drawSized(context, rect, colour, name) {
    this.#outline(context, rect, "#0d0f12", 4, []);
    this.#outline(context, rect, colour, 2, []);
    this.#drawLabel(context, rect, name, null);
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Rect} rect
   * @param {string} name
   * @param {Rect | null} handle on the screen
   */
  #drawLabel(context, rect, name, handle) {
    const { left, top, right, bottom } = this.#onScreen(rect);
    const lines = [name, `${Math.round(1000 * widthOf(rect))} × ${Math.round(1000 * heightOf(rect))}`].filter(Boolean);
    context.font = "12px system-ui, sans-serif";
    const fits = (/** @type {string} */ line) => context.measureText(line).width + 12 < right - left;
    const line = lines.join("  ");
    const low = bottom - top < LOW_PX && fits(line); // two lines would lie over its handle
    const shown = low ? [line] : bottom - top > 36 && lines.every(fits) ? lines : lines.slice(-1).filter(fits);
    if (bottom - top < 17 * shown.length + 4) return;
    const widths = shown.map((line) => context.measureText(line).width + 8);
    const size = { width: Math.max(...widths) + 8, height: 17 * shown.length + 8 };
    const { x, y } = labelCorner({ left, top, right, bottom }, size, handle);
    for (const [k, line] of shown.entries()) {
      context.fillStyle = "rgb(10 12 16 / 78%)";
      context.fillRect(x + 4, y + 4 + 17 * k, widths[k] ?? 0, 16);
      context.fillStyle = "#f2f5fa";
      context.fillText(line, x + 8, y + 16 + 17 * k);
    }
  }

  /** @param {PointerEvent} event */
  #down(event) {
    this.#canvas.focus({ preventScroll: true });
    this.#canvas.setPointerCapture(event.pointerId);
    const at = this.#at(event);
    const pan = event.button === 1 || this.#space;
    this.#from = toImage(this.#view, at);
    const held = pan || this.tooled || event.shiftKey ? null : this.#heldAt(at, event.pointerType === "touch" ? 2 : 1);
    this.#gestures.press(event.pointerId, at, { pan, held });
    if (event.button === 1) event.preventDefault();
  }

  /** @param {PointerEvent} event */
  #move(event) {
    const at = this.#at(event);
    this.pointer = toImage(this.#view, at);
    const motion = this.#gestures.move(event.pointerId, at, event.pointerType === "touch" ? STILL_TOUCH_PX : STILL_PX);
    if (!motion) return this.#point(at);
    if (motion.kind === "pan") {
      const { scale, x, y } = this.#view;
      this.#see({ scale, x: x + motion.by.x, y: y + motion.by.y });
    } else if (motion.kind === "pinch") this.#see(pinch(this.#view, motion.before, motion.after, this.#least));
    else
      this.#preview =
        motion.kind === "carry"
          ? this.#carried(motion.held, motion.at, event.altKey)
          : {
              key: null,
              rect: drawn(this.#from, this.pointer, event.altKey || event.shiftKey ? null : this.#snapOf(null)),
            };
    this.draw();
  }

  /** @param {PointerEvent} event */
  #up(event) {
    const meant = this.#gestures.release(event.pointerId, this.#at(event));
    const preview = this.#preview;
    this.stop();
    if (meant?.kind === "drop" && preview?.key) this.emit("move", { key: preview.key, rect: preview.rect });
    else if (meant?.kind === "box" && preview && event.shiftKey) this.emit("enclose", preview.rect);
    else if (meant?.kind === "box" && preview && !this.tooled && isLarge(preview.rect)) this.emit("draw", preview.rect);
    else if (meant?.kind === "pick") this.emit("pick", { key: meant.held.key, side: meant.held.side, also: false });
    else if (meant?.kind === "click") this.#click(toImage(this.#view, meant.at), event);
  }

  /** @param {{ x: number, y: number }} at @param {PointerEvent} event */
  #click(at, event) {
    if (this.tooled) return this.emit("use-tool", at);
    const front = smallestAt(this.#fronts, at);
    this.emit("pick", { key: front?.key ?? null, side: null, also: event.shiftKey });
  }

  /** @param {PointerEvent} event */
  #drop(event) {
    this.#gestures.forget(event.pointerId);
    this.stop();
  }

  /** @param {WheelEvent} event */
  #wheel(event) {
    event.preventDefault();
    this.#see(zoom(this.#view, Math.exp(-event.deltaY / 400), this.#at(event), this.#least));
  }

  /** @param {import("../lib/view.js").View} view */
  #see(view) {
    this.#view = view;
    this.#fitted = false;
    this.draw();
  }

  /** Set the cursor to match what a press would drag. @param {At} at */
  #point(at) {
    const held = this.tooled ? null : this.#heldAt(at, 1);
    const level = held?.side === "top" || held?.side === "bottom";
    this.#canvas.style.cursor = !held ? "crosshair" : held.side === null ? "move" : level ? "ns-resize" : "ew-resize";
  }

  /** @param {Held} held @param {At} at @param {boolean} free */
  #carried({ key, side }, at, free) {
    const front = this.#fronts.find((one) => one.key === key);
    const snap = free ? null : this.#snapOf(key);
    return front ? { key, rect: carried(front.rect, side, this.#from, toImage(this.#view, at), snap) } : null;
  }

  /** Snap a new front of this size to nearby lines. @param {Rect} rect */
  settled(rect) {
    return settled(rect, this.#snapOf(null));
  }

  /**
   * Snap function of a front's edges.
   * @param {string | null} key null: a new front
   * @returns {import("../lib/front-hits.js").Snap}
   */
  #snapOf(key) {
    return (side, at, rect) => this.snap(side, at, rect, key, this.reach);
  }

  /** @param {At} at @param {number} fingers */
  #heldAt(at, fingers) {
    return heldAt(this.#fronts, toImage(this.#view, at), (fingers * EDGE_PX) / this.#view.scale);
  }

  /** Snapping distance of edges and tool clicks, in metres. */
  get reach() {
    return SNAP_PX / this.#view.scale;
  }

  /** @param {Rect} rect */
  #onScreen(rect) {
    const from = toScreen(this.#view, { x: rect.left, y: rect.top });
    const to = toScreen(this.#view, { x: rect.right, y: rect.bottom });
    return { left: from.x, top: from.y, right: to.x, bottom: to.y };
  }

  /** @param {MouseEvent} event */
  #at({ clientX, clientY }) {
    const box = this.#canvas.getBoundingClientRect();
    return { x: clientX - box.left, y: clientY - box.top };
  }

  get #least() {
    return (
      0.5 * fit(this.#size, { width: Math.max(this.clientWidth, 1), height: Math.max(this.clientHeight, 1) }).scale
    );
  }

  #resize() {
    this.#canvas.width = Math.round(this.clientWidth * devicePixelRatio);
    this.#canvas.height = Math.round(this.clientHeight * devicePixelRatio);
    if (this.#fitted) this.fit();
    else this.draw();
  }
}
