/**
 * Overlay of an object's mesh on the photos it was seen in: outline, ghost, distance to the measured depth, before and after
 * the fit, opened as far as it was filmed open. The photo's comments are pins; the view zooms to the object or the whole photo.
 * Emits "pin-point" {frame, x, y} on a double click, "mark" {leaf, frame, value} when the user marks a leaf's opening.
 */

import { getPhotos } from "../api.js";
import { detailOf, h, LiveElement, renew, segments, shape, slider, spinner } from "../dom.js";
import { Answers } from "../lib/answers.js";
import { boxEdges } from "../lib/box-view.js";
import { sheetOf } from "../lib/crop-view.js";
import { holdAt, leafAt, openingAt } from "../lib/leaf.js";
import { MODELS } from "../lib/words.js";
import { OpeningMarks } from "./opening-marks.js";
import { sayError } from "./toasts.js";

/** @typedef {import("../api-types").ObjectPhotos} ObjectPhotos */
/** @typedef {import("../api-types").Photo} Photo */
/** @typedef {ObjectPhotos["of"][number]} Of */
/** @typedef {"ghost" | "outline" | "residual"} Look */

/** @type {Record<Look, string>} */
const LEGENDS = {
  outline: "Lines: edges of the model; faint where something covers them.",
  ghost: "The model over the photo; faint where something covers it.",
  residual: "Red: the mesh stands before the measured surface. Blue: behind it. Full colour at 3 cm. Pale: they agree.",
};
/** @type {Record<Look, string>} */
const LOOKS = { outline: "Outline", ghost: "Ghost", residual: "Distance" };
const PIN_R = 0.008; // fraction of the photo's width
const HOLD_PX = 9; // radius on the screen

export class PhotoCheck extends LiveElement {
  project = "";
  #answers = new Answers();
  #object = -1;
  /** @type {ObjectPhotos | null} */
  #all = null;
  #at = 0;
  /** @type {Of} */
  #of = "fitted";
  /** @type {Look} */
  #look = "outline";
  /** Whether the view is zoomed to the object instead of the whole photo. */
  #near = true;
  /** @type {import("../api-types").Comment[]} */
  #comments = [];
  #pinned = ""; // key of the comments drawn
  /** @type {{ pose: number[][], size: number[] } | null} box with a correction applied */
  #preview = null;
  #photo = h("img", { alt: "" });
  #under = h("img", { class: "over", alt: "" });
  #over = h("img", { class: "over", alt: "" });
  #lines = shape("svg", { class: "over", "aria-hidden": "true" });
  #box = shape("g");
  #pins = shape("g");
  #leaves = shape("g");
  marks = new OpeningMarks();
  #said = ""; // key of the object's marks
  #opacity = h("input", { type: "range", min: "0", max: "100", value: "75", "aria-label": "Opacity over the photo" });
  #split = h("input", { type: "range", min: "0", max: "100", value: "100", "aria-label": "Before and after the fit" });
  #tools = h("div", { class: "bar" });
  #sheet = h("div", { class: "sheet" }, this.#photo, this.#under, this.#over);
  #waiting = spinner("Loading the photos…");
  #pictures = h("div", { class: "pictures" }, this.#sheet, this.#waiting);
  #strip = h("div", { class: "thumbs" });
  #legend = h("p", { class: "muted legend" });

  connected() {
    this.#lines.append(this.#pins, this.#box, this.#leaves);
    this.#sheet.append(this.#lines);
    const observer = new ResizeObserver(() => (this.#place(), this.#drawLeaves(), this.marks.draw()));
    observer.observe(this.#pictures);
    this.signal.addEventListener("abort", () => observer.disconnect());
    this.replaceChildren(this.#tools, this.#pictures, this.#legend, this.marks.element, this.#strip);
    /** @type {(type: string, act: (detail: any) => void) => void} */
    const onMarks = (type, act) =>
      this.marks.addEventListener(type, (event) => act(detailOf(event)), { signal: this.signal });
    onMarks("turn", () => this.#drawLeaves());
    onMarks("seek", ({ frame }) => this.seek(frame));
    onMarks("mark", (mark) => this.emit("mark", { ...mark, frame: this.frame }));
    for (const slider of [this.#opacity, this.#split])
      slider.addEventListener("input", () => this.#fade(), { signal: this.signal });
    for (const type of ["load", "error"])
      this.#photo.addEventListener(type, () => this.#wait(false), { signal: this.signal });
    this.#pictures.addEventListener("dblclick", (event) => this.#pin(event), { signal: this.signal });
  }

  /** @param {number} object */
  async show(object) {
    const same = object === this.#object;
    this.#object = object;
    if (!same) {
      this.#at = 0;
      this.#all = null;
      this.#wait(true);
    }
    try {
      await this.#answers.take(getPhotos(this.project, object), (found) => {
        if (this.#object !== object) return;
        const { frame } = this;
        this.#all = found;
        if (frame !== null) this.#at = nearest(found.photos, frame); // marks can add photos
        if (!found.of.includes(this.#of)) this.#of = found.of.at(-1) ?? "placed";
        this.#draw();
      });
    } catch (error) {
      sayError(error);
      this.#wait(false);
    }
  }

  /** Show that there is no object whose photos could be shown. @param {string} why */
  none(why) {
    this.#object = -1;
    this.#all = null;
    this.#draw();
    this.#wait(false);
    this.#legend.textContent = why;
  }

  /** @param {boolean} waiting for the list of photos, or for the photo */
  #wait(waiting) {
    this.#waiting.hidden = !waiting;
    this.#sheet.hidden = waiting;
  }

  /**
   * Set the object's marks, and why marking is not allowed (empty if it is).
   * @param {number} object
   * @param {import("../lib/opening-marks.js").States} states
   * @param {string} refusal
   */
  about(object, states, refusal) {
    const said = JSON.stringify([object, states]);
    const again = object === this.#object && this.#said !== said && this.#said.startsWith(`[${object},`);
    this.#said = said;
    if (refusal !== this.marks.refusal) {
      this.marks.refusal = refusal;
      this.#draw();
    }
    if (again) this.show(object);
  }

  /** An object's box in the finished scene; null if there is none or it is not loaded yet. @param {number} object */
  boxOf(object) {
    const { world_from_object: pose, dimensions_m: size } = (object === this.#object && this.#all) || {};
    return pose && size ? { pose, size } : null;
  }

  /** Draw a corrected box; null draws the stored one. @param {{ pose: number[][], size: number[] } | null} box */
  preview(box) {
    this.#preview = box;
    this.#drawBox();
  }

  /** @param {import("../api-types").Comment[]} comments open ones */
  setComments(comments) {
    this.#comments = comments;
    this.#drawPins();
  }

  /** @param {number} step */
  move(step) {
    const count = this.#all?.photos.length ?? 0;
    if (count) this.#at = (this.#at + step + count) % count;
    this.#draw();
  }

  /** Show the photo of a frame, or of the nearest one. @param {number} frame */
  seek(frame) {
    this.#at = nearest(this.#all?.photos ?? [], frame);
    this.#draw();
  }

  /** @param {boolean} on whether to hide the mesh while a key is down */
  blink(on) {
    this.#pictures.classList.toggle("blink", on);
  }

  /** Frame of the photo shown; null if there is none. */
  get frame() {
    return this.#current?.frame ?? null;
  }

  /** Whether no photo is loaded; masks may have arrived before the page listened. */
  get isEmpty() {
    return !this.#all?.photos.length;
  }

  get #current() {
    return this.#all?.photos[this.#at];
  }

  #draw() {
    const all = this.#all;
    const photo = this.#current;
    this.#pictures.hidden = all !== null && !photo;
    if (!all || !photo || !all.of.length) {
      this.#tools.replaceChildren();
      this.marks.element.hidden = true;
      this.#legend.textContent = all ? missing(all) : "";
      return this.#strip.replaceChildren();
    }
    this.#photo.src = this.#frameUrl(photo, this.#near ? photo.width : 960);
    if (!this.#photo.naturalWidth) this.#wait(!this.#photo.complete); // a photo before it stays until the next is there
    this.#photo.alt = `Frame ${photo.frame}`;
    this.#over.src = this.#overlayUrl(photo, this.#of, this.#look);
    this.#over.alt = `${MODELS[this.#of]}, ${LOOKS[this.#look].toLowerCase()}`;
    const before = this.#of === "fitted" ? "primitive" : "placed";
    this.#under.hidden = this.#look !== "ghost" || this.#of === before;
    if (!this.#under.hidden) this.#under.src = this.#overlayUrl(photo, before, "ghost");
    this.#drawTools(all, before);
    this.marks.show(all.leaves, photo);
    this.#place();
    this.#drawLeaves();
    this.#drawPins();
    this.#drawBox();
    this.#fade();
    const keys = `Frame ${photo.frame}, photo ${this.#at + 1} of ${all.photos.length}. Hold B for the photo alone; double click pins a comment.`;
    this.#legend.textContent = `${LEGENDS[this.#look]} ${this.#look === "residual" ? "" : keys}`.trim();
    this.#strip.replaceChildren(...all.photos.map((other, k) => this.#thumb(other, k)));
  }

  /** Place the photo on the screen. */
  #place() {
    const photo = this.#current;
    const room = { width: this.#pictures.clientWidth, height: this.#pictures.clientHeight };
    if (!photo || !room.width || !room.height) return;
    const sheet = sheetOf(photo, room, this.#near ? photo.box : null);
    for (const side of /** @type {const} */ (["left", "top", "width", "height"]))
      this.#sheet.style[side] = `${sheet[side]}px`;
  }

  /**
   * @param {ObjectPhotos} all
   * @param {Of} before
   */
  #drawTools(all, before) {
    /** @type {(text: string, on: boolean, act: () => void) => HTMLElement} */
    const button = (text, on, act) => {
      const made = h("button", { type: "button", "aria-pressed": String(on) }, text);
      made.dataset.at = `look:${text}`;
      made.addEventListener("click", () => (act(), this.#draw()));
      return made;
    };
    const looks = /** @type {Look[]} */ (Object.keys(LOOKS));
    renew(
      this.#tools,
      segments("Model", ...all.of.map((of) => button(MODELS[of], of === this.#of, () => (this.#of = of)))),
      segments("Look", ...looks.map((look) => button(LOOKS[look], look === this.#look, () => (this.#look = look)))),
      segments(
        "What fills the picture",
        button("Object", this.#near, () => (this.#near = true)),
        button("Photo", !this.#near, () => (this.#near = false)),
      ),
      h("span", { class: "spring" }),
      slider("Opacity", this.#opacity),
      this.#under.hidden ? "" : slider(`${MODELS[before]} ↔ ${MODELS[this.#of].toLowerCase()}`, this.#split),
    );
  }

  /**
   * @param {Photo} photo
   * @param {number} k
   */
  #thumb(photo, k) {
    const image = h("img", { src: this.#frameUrl(photo, 160), alt: "" });
    const button = h(
      "button",
      { type: "button", "aria-label": `Photo ${photo.frame}`, "aria-current": String(k === this.#at) },
      image,
    );
    button.addEventListener("click", () => ((this.#at = k), this.#draw()));
    return button;
  }

  #fade() {
    const share = Number(this.#split.value);
    this.#over.style.opacity = this.#under.style.opacity = String(Number(this.#opacity.value) / 100);
    this.#over.style.clipPath = this.#under.hidden ? "" : `inset(0 ${100 - share}% 0 0)`;
    this.#under.style.clipPath = `inset(0 0 0 ${share}%)`;
  }

  #drawBox() {
    const photo = this.#current;
    const box = this.#preview;
    this.#box.replaceChildren(...(photo && box ? boxLines(box.pose, box.size, photo) : []));
  }

  /** Draw the drag handle of each leaf, and the outline of leaves with unsaved values. */
  #drawLeaves() {
    const photo = this.#current;
    const leaves = photo && !this.marks.element.hidden ? this.marks.leaves : [];
    const held = this.#leaves.querySelector(":scope > .hold.held"); // reuse the handle being dragged
    const parts = leaves.flatMap(({ leaf, value, turned }) => {
      const lines = photo && turned ? boxLines(leafAt(leaf, value), leaf.size_m, photo) : [];
      const at = photo && !this.marks.refusal ? holdAt(leaf, value, photo) : null;
      const hold = at && this.#hold(leaf, at, held instanceof SVGElement ? held : null);
      return hold ? [...lines, hold] : lines;
    });
    this.#leaves.replaceChildren(...parts);
  }

  /**
   * @param {import("../api-types").Leaf} leaf
   * @param {[number, number]} at
   * @param {SVGElement | null} held
   */
  #hold(leaf, at, held) {
    const hold = held?.dataset.joint === leaf.joint ? held : shape("circle");
    const scale = this.#sheet.clientWidth / (this.#current?.width ?? 1) || 1;
    for (const [name, value] of Object.entries({ cx: at[0], cy: at[1], r: HOLD_PX / scale }))
      hold.setAttribute(name, String(value));
    if (hold === held) return hold;
    hold.setAttribute("class", "hold");
    hold.dataset.joint = leaf.joint;
    hold.addEventListener("pointerdown", (event) => this.#drag(/** @type {PointerEvent} */ (event), hold, leaf));
    return hold;
  }

  /**
   * Drag a leaf by its edge; on release, its opening in this photo is marked.
   * @param {PointerEvent} event
   * @param {SVGElement} hold
   * @param {import("../api-types").Leaf} leaf
   */
  #drag(event, hold, leaf) {
    const photo = this.#current;
    if (!photo) return;
    event.preventDefault();
    const ends = new AbortController();
    let to = NaN;
    const on = (/** @type {string} */ type, /** @type {(event: PointerEvent) => void} */ act) =>
      window.addEventListener(type, (moved) => act(/** @type {PointerEvent} */ (moved)), { signal: ends.signal });
    const end = () => (ends.abort(), hold.classList.remove("held"));
    hold.classList.add("held");
    on("pointermove", (moved) => {
      const { x, y } = this.#pixel(moved, photo);
      to = openingAt(leaf, photo, x, y);
      this.marks.turn(leaf, to);
    });
    on("pointerup", () => (end(), Number.isNaN(to) || this.marks.mark(leaf, to)));
    on("pointercancel", () => (end(), this.marks.drop()));
    this.signal.addEventListener("abort", end, { signal: ends.signal });
  }

  /** Draw the photo's comments, only when they change, so that a tooltip being read stays open. */
  #drawPins() {
    const photo = this.#current;
    const here = this.#comments.filter(({ frame, object }) => frame === photo?.frame && object === this.#object);
    const drawn = JSON.stringify([photo?.frame, photo?.width, here]);
    if (!photo || drawn === this.#pinned) return;
    this.#pinned = drawn;
    this.#lines.setAttribute("viewBox", `0 0 ${photo.width} ${photo.height}`);
    this.#pins.replaceChildren(...here.map((comment) => this.#commentPin(comment, photo)));
  }

  /** @param {import("../api-types").Comment} comment @param {Photo} photo */
  #commentPin({ x, y, text, who }, { width }) {
    const at = { cx: x ?? 0, cy: y ?? 0, r: PIN_R * width, class: "pin" };
    return shape("circle", at, shape("title", {}, `${who}: ${text}`));
  }

  /** @param {MouseEvent} event */
  #pin(event) {
    const photo = this.#current;
    if (!photo) return;
    this.emit("pin-point", { frame: photo.frame, ...this.#pixel(event, photo) });
  }

  /** @param {MouseEvent} event @param {Photo} photo */
  #pixel(event, { width, height }) {
    const shown = this.#photo.getBoundingClientRect();
    return {
      x: ((event.clientX - shown.left) / shown.width) * width,
      y: ((event.clientY - shown.top) / shown.height) * height,
    };
  }

  /**
   * @param {Photo} photo
   * @param {number} width
   */
  #frameUrl(photo, width) {
    return `/media/${this.project}/frames/${photo.frame}.jpg?w=${width}`;
  }

  /**
   * @param {Photo} photo
   * @param {Of} of
   * @param {Look} look
   */
  #overlayUrl(photo, of, look) {
    return `/media/${this.project}/overlay/${this.#object}/${photo.frame}.png?of=${of}&look=${look}&v=${this.#all?.version ?? ""}`;
  }
}

/** Message for a missing overlay. @param {ObjectPhotos} all */
function missing({ of }) {
  return of.length
    ? "No mask yet: the photos appear once the object is found."
    : "No model to lay over the photos yet: run the pipeline first.";
}

/** Index of the photo of a frame, or of the nearest one. @param {Photo[]} photos @param {number} frame */
function nearest(photos, frame) {
  const away = photos.map((photo) => Math.abs(photo.frame - frame));
  return Math.max(away.indexOf(Math.min(...away)), 0);
}

/** @param {number[][]} pose @param {number[]} size @param {Photo} photo */
function boxLines(pose, size, photo) {
  return boxEdges(pose, size, photo).map(({ from, to, front }) => {
    const at = { x1: from[0], y1: from[1], x2: to[0], y2: to[1] };
    return shape("line", { ...at, class: front ? "front" : "side" });
  });
}
