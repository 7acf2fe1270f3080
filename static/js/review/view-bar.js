/** What the middle of the review shows, and how. Says "change" when the person wants another view or another setting of it. */

import { h, segments, slider } from "../dom.js";

/** @typedef {"candidate" | "aligned" | "photo" | "scene" | "cloud"} Mode */

/** @type {[Mode, string][]} */
const MODES = [
  ["photo", "Photos"],
  ["candidate", "Candidate"],
  ["aligned", "Over the scan"],
  ["scene", "Scene"],
  ["cloud", "Scan"],
];

export class ViewBar extends EventTarget {
  element = h("div", { class: "bar" });
  job = h("span", { class: "chip", role: "status", hidden: true });
  /** @type {Mode} */
  mode = "scene";
  moving = false;
  full = false;
  #opacity = h("input", { type: "range", min: "0", max: "100", value: "85", "aria-label": "Opacity of the mesh" });
  #collision = h("input", { type: "checkbox" });
  #scan = h("input", { type: "checkbox" });
  #reduced = false;
  #movable = false;
  #modes = MODES.map(([mode, text]) => ({ mode, button: toggle(text, () => this.set(mode)) }));
  #move = toggle("Move it", () => this.move(!this.moving));
  #all = toggle("All points", () => ((this.full = !this.full), this.#say()));
  #see = slider("Opacity", this.#opacity);
  #inScene = [this.#collision, this.#scan].map((input, k) =>
    h("label", { class: "row" }, input, ["Colliders", "Scan"][k]),
  );

  constructor() {
    super();
    for (const input of [this.#opacity, this.#collision, this.#scan])
      input.addEventListener("change", () => this.#say());
    const modes = segments("View", ...this.#modes.map(({ button }) => button));
    const spring = h("span", { class: "spring" });
    this.element.append(modes, spring, this.job, this.#move, this.#all, this.#see, ...this.#inScene);
    this.#draw();
  }

  /** What is asked of the 3D view. */
  get wish() {
    return {
      mode: this.mode === "photo" ? /** @type {const} */ ("aligned") : this.mode,
      cloud: this.mode === "scene" ? this.#scan.checked : this.mode !== "candidate",
      opacity: Number(this.#opacity.value) / 100,
      collision: this.#collision.checked,
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

  /** @param {boolean} reduced whether the 3D view left something out */
  told(reduced) {
    this.#reduced = reduced;
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
    this.#all.hidden = mode === "photo" || !(this.#reduced || this.full);
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
