/**
 * Editor of the chosen object's crop box over the frame: sides are dragged, or moved with arrow keys (1 mm, with Shift 10 mm).
 * Emits "use" when editing starts or ends.
 */

import * as api from "../api.js";
import { h, shape } from "../dom.js";
import { say, sayError } from "../elements/toasts.js";
import { edges, moved, sides, sizes } from "../lib/crop-box.js";
import { toScreen } from "../lib/view.js";

/** @typedef {import("../lib/crop-box.js").Crop} Crop */
/** @typedef {import("../lib/crop-box.js").Side} Side */
/** @typedef {import("../api-types").FrameCamera} FrameCamera */

const PAUSE_MS = 400; // debounce: key presses in quick succession are stored as one change
const APART_PX = 34; // minimum distance of handles from the centre of a small box, so that they do not overlap
const LEAST_PX_PER_M = 40; // a side that moves along the line of sight cannot be dragged

export class Cropper extends EventTarget {
  project = "";
  #objects;
  #edits;
  #player;
  #canvas;
  #lines = shape("svg");
  #size = h("output", { class: "crop-size" });
  element = h("div", { class: "crop", role: "group", "aria-label": "Crop box" });
  /** @type {number | null} id of the object whose box is shown */
  #object = null;
  /** @type {Crop | null} */
  #crop = null;
  /** @type {Map<number, Promise<FrameCamera>>} */
  #cameras = new Map();
  /** @type {FrameCamera | null} camera of the shown frame */
  #camera = null;
  #timer = 0;
  /** @type {{ side: Side, from: { x: number, y: number }, crop: Crop } | null} */
  #drag = null;

  /**
   * @param {{ objects: import("./scene-objects.js").SceneObjects, edits: import("./edits.js").Edits, player: import("./player.js").Player, canvas: import("../elements/frame-canvas.js").FrameCanvas }} parts
   */
  constructor({ objects, edits, player, canvas }) {
    super();
    this.#objects = objects;
    this.#edits = edits;
    this.#player = player;
    this.#canvas = canvas;
    this.element.hidden = true;
    this.#lines.setAttribute("aria-hidden", "true");
    canvas.addEventListener("view", () => this.#draw());
    player.addEventListener("frame", () => this.#frame());
    objects.addEventListener("change", () => this.#follow());
  }

  get on() {
    return this.#object !== null;
  }

  /** Show the chosen object's box, or one around its points if it has none; close it if shown. */
  async use() {
    if (this.on) return this.#end();
    const { chosen } = this.#objects;
    if (!chosen) return say("Choose a thing first.");
    if (chosen.front) return say("A crop box is for things. Correct a front on the Elevation page.");
    const crop = chosen.crop ?? (await this.#around(chosen.id));
    if (!crop) return say("It has no points yet: click the object first.");
    this.#object = chosen.id;
    this.#crop = crop;
    this.dispatchEvent(new Event("use"));
    this.#frame();
  }

  /** Remove the object's crop box, which restores the object as found. */
  remove() {
    const object = this.#object ?? this.#objects.current;
    if (object !== null && this.#objects.get(object)?.crop) this.#edits.patch(object, { crop: null });
    this.#end();
  }

  #end() {
    this.#flush();
    this.#object = this.#crop = null;
    this.element.hidden = true;
    this.element.replaceChildren();
    this.dispatchEvent(new Event("use"));
  }

  /** @param {number} object */
  async #around(object) {
    try {
      return (await api.getObjectPoints(this.project, object)).around;
    } catch (error) {
      sayError(error);
      return null;
    }
  }

  /** Adopt a box changed by another user or by undo; close when another object is chosen. */
  #follow() {
    if (this.#object === null) return;
    if (this.#objects.current !== this.#object) return this.#end();
    const crop = this.#objects.get(this.#object)?.crop;
    if (crop && !this.#drag && !this.#timer) ((this.#crop = crop), this.#draw());
  }

  async #frame() {
    const { frame } = this.#player;
    if (!this.on || !frame) return;
    const asked = this.#cameras.get(frame.index) ?? api.getCamera(this.project, frame.index);
    this.#cameras.set(frame.index, asked);
    try {
      const camera = await asked;
      if (frame === this.#player.frame) ((this.#camera = camera), this.#draw());
    } catch (error) {
      this.#cameras.delete(frame.index);
      sayError(error);
    }
  }

  #draw() {
    const [crop, camera] = [this.#crop, this.#camera];
    if (!crop || !camera) return;
    this.element.hidden = false;
    this.#lines.replaceChildren(
      ...["halo", "line"].flatMap((name) => edges(crop, camera).map((edge) => this.#line(name, edge))),
    );
    const held = document.activeElement instanceof HTMLElement ? document.activeElement.dataset.side : undefined;
    const shown = sides(crop, camera).map((side) => this.#handle(side));
    this.#size.textContent = `${sizes(crop)
      .map((side) => (100 * side).toFixed(1))
      .join(" × ")} cm`;
    if (!this.#drag) this.element.replaceChildren(this.#lines, this.#size, ...shown.map(({ handle }) => handle));
    else for (const { side, handle } of shown) this.#keep(side, handle);
    if (held) /** @type {HTMLElement | null} */ (this.element.querySelector(`[data-side="${held}"]`))?.focus();
  }

  /** Move an existing handle instead of replacing it, while a side is dragged. @param {Side} side @param {HTMLElement} made */
  #keep(side, made) {
    const there = /** @type {HTMLElement | null} */ (this.element.querySelector(`[data-side="${nameOf(side)}"]`));
    if (there) Object.assign(there.style, { left: made.style.left, top: made.style.top });
  }

  /** @param {string} name @param {{ from: { x: number, y: number }, to: { x: number, y: number } }} edge */
  #line(name, { from, to }) {
    const [a, b] = [toScreen(this.#canvas.view, from), toScreen(this.#canvas.view, to)];
    return shape("line", { x1: a.x, y1: a.y, x2: b.x, y2: b.y, class: name });
  }

  /** @param {Side} side */
  #handle(side) {
    const millimetres = Math.round(1000 * side.extent);
    const handle = h("button", {
      type: "button",
      class: "crop-side",
      role: "slider",
      title: `${side.name}: drag, or arrow keys`,
      "aria-label": `${side.name} of the crop box`,
      "aria-valuenow": String(millimetres),
      "aria-valuemin": "20",
      "aria-valuemax": "10000",
      "aria-valuetext": `${millimetres} mm to the opposite side`,
      "data-side": nameOf(side),
    });
    const { x, y } = this.#placeOf(side);
    Object.assign(handle.style, { left: `${x}px`, top: `${y}px` });
    handle.addEventListener("pointerdown", (event) => this.#press(event, side, handle));
    handle.addEventListener("pointermove", (event) => this.#move(event));
    for (const type of ["pointerup", "pointercancel"])
      handle.addEventListener(type, () => this.#drag && ((this.#drag = null), this.#store(), this.#draw()));
    handle.addEventListener("keydown", (event) => this.#key(event, side));
    return { side, handle };
  }

  /** Screen position of a side's handle: the side's middle, or farther outwards on a small box. @param {Side} side */
  #placeOf({ at, middle, perMetre }) {
    const [from, to] = [toScreen(this.#canvas.view, middle), toScreen(this.#canvas.view, at)];
    const length = Math.hypot(perMetre.x, perMetre.y) || 1;
    const missing = Math.max(APART_PX - Math.hypot(to.x - from.x, to.y - from.y), 0);
    return { x: to.x + (perMetre.x / length) * missing, y: to.y + (perMetre.y / length) * missing };
  }

  /** @param {PointerEvent} event @param {Side} side @param {HTMLElement} handle */
  #press(event, side, handle) {
    if (!this.#crop) return;
    handle.setPointerCapture(event.pointerId);
    handle.focus();
    this.#drag = { side, from: { x: event.clientX, y: event.clientY }, crop: this.#crop };
    event.preventDefault();
  }

  /** @param {PointerEvent} event */
  #move(event) {
    if (!this.#drag) return;
    const { side, from, crop } = this.#drag;
    const { scale } = this.#canvas.view;
    const [vx, vy] = [side.perMetre.x * scale, side.perMetre.y * scale];
    const squared = vx * vx + vy * vy;
    if (squared < LEAST_PX_PER_M ** 2) return;
    const metres = ((event.clientX - from.x) * vx + (event.clientY - from.y) * vy) / squared;
    this.#crop = moved(crop, side, metres);
    this.#draw();
  }

  /** @param {KeyboardEvent} event @param {Side} side */
  #key(event, side) {
    const way = { ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1 }[event.key];
    if (!way || !this.#crop) return;
    event.preventDefault();
    event.stopPropagation();
    this.#crop = moved(this.#crop, side, way * (event.shiftKey ? 0.01 : 0.001));
    this.#draw();
    clearTimeout(this.#timer);
    this.#timer = window.setTimeout(() => this.#flush(), PAUSE_MS);
  }

  /** Store pending key presses now. */
  #flush() {
    if (!this.#timer) return;
    clearTimeout(this.#timer);
    this.#timer = 0;
    this.#store();
  }

  #store() {
    if (this.#object !== null && this.#crop) this.#edits.patch(this.#object, { crop: this.#crop });
  }

  stop() {
    this.#flush();
  }
}

/** @param {Side} side */
const nameOf = ({ axis, away }) => `${axis}${away ? "+" : "-"}`;
