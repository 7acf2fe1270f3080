/**
 * Toolbar of the review's centre: view mode and settings. Emits "change" when the mode or a setting changes, "look" with a
 * viewpoint, "measure" when measuring is toggled, and "keep-length" to store the measured length.
 */

import { h, segments, slider } from "../dom.js";
import { ClipPanel } from "./clip-panel.js";
import { heatLegend } from "./heat-legend.js";

/** @typedef {"candidate" | "compare" | "aligned" | "photo" | "scene" | "cloud"} Mode */

/** @type {[Mode, string][]} */
const MODES = [
  ["photo", "Photos"],
  ["compare", "Compare"],
  ["candidate", "Candidate"],
  ["aligned", "Over the scan"],
  ["scene", "Scene"],
  ["cloud", "Scan"],
];

/** @type {[NonNullable<import("../api-types").ViewerShow["draw"]>, string][]} */
const DRAWN = [
  ["meshes", "Meshes"],
  ["wireframe", "Wireframe"],
  ["colliders", "Colliders"],
  ["both", "Meshes and colliders"],
  ["distance", "Distance to the scan"],
  ["unobserved", "Far from any observation"],
];
/** @type {[NonNullable<import("../api-types").ViewerShow["look"]>, string][]} */
const SIDES = [
  ["run", "front of its run"],
  ["photo", "where its photo was taken"],
  ["front", "front"],
  ["back", "back"],
  ["left", "left"],
  ["right", "right"],
  ["top", "above"],
  ["bottom", "below"],
];

export class ViewBar extends EventTarget {
  element = h("div", { class: "bar" });
  job = h("span", { class: "chip", role: "status", hidden: true });
  /** @type {Mode} */
  mode = "scene";
  moving = false;
  full = false;
  #opacity = h("input", { type: "range", min: "0", max: "100", value: "85", "aria-label": "Opacity of the mesh" });
  #draw_as = h("select", { "aria-label": "Layers of the scene" });
  #look = h("select", { "aria-label": "Look from" });
  #measure = toggle("Measure", () => this.toggleMeasure());
  /** Reading of the tape measure. */
  #reading = h("span", { class: "chip", role: "status", hidden: true });
  #keep = toggle("Keep as true length…", () => this.dispatchEvent(new Event("keep-length")));
  measuring = false;
  clip = new ClipPanel();
  #section = toggle("Section", () => this.clip.toggle());
  /** Colour legend and clip box, below the toolbar. */
  below = h("div", { class: "below" }, this.clip.element);
  #parallel = toggle("Parallel", () => this.toggleParallel());
  #preview = h("span", { class: "chip warn", role: "status", hidden: true });
  #scan = h("input", { type: "checkbox" });
  #reduced = false;
  #isParallel = false;
  #movable = false;
  #modes = MODES.map(([mode, text]) => ({ mode, button: toggle(text, () => this.set(mode)) }));
  #move = toggle("Move it", () => this.move(!this.moving));
  #all = toggle("All points", () => ((this.full = !this.full), this.#say()));
  #see = slider("Opacity", this.#opacity);
  #inScene = [this.#draw_as, h("label", { class: "row" }, this.#scan, "Scan")];

  constructor() {
    super();
    this.#draw_as.append(...DRAWN.map(([value, text]) => h("option", { value }, text)));
    this.#look.append(
      h("option", { value: "" }, "Look from…"),
      ...SIDES.map(([side, text]) => h("option", { value: side }, text)),
    );
    for (const input of [this.#opacity, this.#draw_as, this.#scan]) input.addEventListener("change", () => this.#say());
    this.#look.addEventListener("change", () => {
      if (this.#look.value) this.dispatchEvent(new CustomEvent("look", { detail: this.#look.value }));
      this.#look.value = "";
    });
    this.#section.title = "Cut the scene and the scan by a box, to look inside";
    this.clip.addEventListener("change", () => this.#say());
    this.#parallel.title = "Parallel projection: parallel lines stay parallel";
    const modes = segments("View", ...this.#modes.map(({ button }) => button));
    const spring = h("span", { class: "spring" });
    this.element.append(
      modes,
      spring,
      this.#preview,
      this.job,
      this.#move,
      this.#all,
      this.#see,
      ...this.#inScene,
      this.#look,
      this.#parallel,
      this.#section,
      this.#measure,
      this.#reading,
      this.#keep,
    );
    this.#draw();
  }

  /** Whether the 3D view is shown. */
  get isSolid() {
    return this.mode !== "photo" && this.mode !== "compare";
  }

  /** Whether the mode has an inside, so that it can be clipped. */
  get #inside() {
    return this.mode === "scene" || this.mode === "cloud";
  }

  /** View settings to store with a comment. @returns {Omit<import("../api-types").ViewerLookInput, "camera" | "hidden">} */
  get kept() {
    const { mode, cloud, opacity, draw, parallel, clip } = this.wish;
    return { mode, cloud, opacity, draw: draw ?? "meshes", parallel, clip };
  }

  /** Restore the view settings stored with a comment. @param {import("../api-types").ViewerLookOutput} look */
  restore({ mode, draw, cloud, opacity, parallel, clip }) {
    this.mode = mode;
    this.#draw_as.value = draw;
    if (mode === "scene") this.#scan.checked = cloud;
    this.#opacity.value = String(100 * opacity);
    this.#isParallel = parallel;
    this.clip.restore(clip);
    this.#draw();
  }

  /** Settings to request from the 3D view. */
  get wish() {
    return {
      mode: this.mode === "photo" || this.mode === "compare" ? /** @type {const} */ ("aligned") : this.mode,
      cloud: this.mode === "scene" ? this.#scan.checked : this.mode !== "candidate",
      opacity: Number(this.#opacity.value) / 100,
      draw: /** @type {import("../api-types").ViewerShow["draw"]} */ (this.#draw_as.value),
      parallel: this.#isParallel,
      clip: this.#inside ? this.clip.wish : null,
      full: this.full,
    };
  }

  /** @param {Mode} mode */
  set(mode) {
    this.mode = mode;
    this.full = false;
    if (mode !== "aligned" && mode !== "photo") this.moving = false;
    this.#reduced = false;
    this.#say();
  }

  /** @param {boolean} on */
  move(on) {
    this.moving = on && this.#movable;
    if (this.moving && this.mode !== "photo") this.mode = "aligned";
    this.#say();
  }

  /** @param {boolean} movable whether there is a box to move */
  offer(movable) {
    if (movable === this.#movable) return;
    this.#movable = movable;
    this.#draw();
  }

  toggleMeasure() {
    this.measuring = !this.measuring;
    this.#reading.hidden = !this.measuring;
    this.dispatchEvent(new Event("measure"));
    this.#say();
  }

  /** @param {string} text of the tape measure @param {boolean} whole whether both ends are set */
  read(text, whole) {
    this.#reading.textContent = text;
    this.#keep.dataset.whole = String(whole);
  }

  toggleParallel() {
    this.#isParallel = !this.#isParallel;
    this.#say();
  }

  /** @param {import("../api-types").ViewerShown} shown whether it is simplified, and previews no run has certified yet */
  told(shown) {
    const { reduced, preview, mode } = shown;
    this.clip.told(shown);
    this.#reduced = reduced;
    this.#preview.hidden = mode !== "scene" || !preview.length;
    this.#preview.textContent = `Preview: ${preview.join(", ")}; certified by the next run`;
    this.#draw();
  }

  #draw() {
    const { mode } = this;
    for (const each of this.#modes) press(each.button, each.mode === mode);
    press(this.#move, this.moving);
    press(this.#all, this.full);
    this.#move.hidden = (mode !== "aligned" && mode !== "photo") || !this.#movable;
    this.#see.hidden = mode !== "aligned" && mode !== "candidate";
    for (const label of this.#inScene) label.hidden = mode !== "scene";
    press(this.#parallel, this.#isParallel);
    press(this.#measure, this.measuring);
    press(this.#section, this.clip.on);
    this.#section.hidden = !this.#inside;
    this.clip.element.hidden = !this.#inside || !this.clip.on;
    const legend = mode === "scene" ? heatLegend(this.wish.draw) : null;
    this.below.querySelector(".heat-legend")?.remove(); // keep the clip box in place: a slider may be in use
    if (legend) this.below.prepend(legend);
    this.below.hidden = this.clip.element.hidden && !legend;
    const inWorld = this.isSolid && mode !== "candidate";
    this.#measure.hidden = !inWorld;
    this.#reading.hidden = !this.measuring || this.#measure.hidden;
    this.#keep.hidden = this.#reading.hidden || this.#keep.dataset.whole !== "true";
    this.#look.hidden = this.#parallel.hidden = !inWorld;
    if (mode !== "scene") this.#preview.hidden = true;
    this.#all.hidden = !this.isSolid || !(this.#reduced || this.full);
  }

  #say() {
    this.#draw();
    this.dispatchEvent(new Event("change"));
  }
}

/**
 * @param {string} text
 * @param {() => void} act
 */
function toggle(text, act) {
  return h("button", { type: "button", onClick: act }, text);
}

/**
 * @param {HTMLElement} button
 * @param {boolean} on
 */
function press(button, on) {
  button.setAttribute("aria-pressed", String(on));
}
