/**
 * Splitter between two panels: a drag or the arrow keys resize one of them, Enter or a double click folds it.
 * The size is kept in local storage.
 */

import { h } from "../dom.js";
import { moved, read } from "../lib/panels.js";

/** @typedef {import("../lib/panels.js").Panel} Panel */

const STEP = 16; // pixels per key press

export class Splitter {
  /** @type {Panel} */
  #panel;
  /** @type {HTMLElement} */
  #grid;
  #size;
  element = h("div", { class: "splitter", role: "separator", tabIndex: 0 });

  /**
   * @param {HTMLElement} grid whose custom property `--NAME` sets the panel's size
   * @param {Panel} panel
   */
  constructor(grid, panel) {
    this.#grid = grid;
    this.#panel = panel;
    this.#size = read(localStorage.getItem(this.#kept), panel);
    this.element.classList.add(`by-${panel.name}`);
    this.element.setAttribute("aria-label", panel.label);
    this.element.setAttribute("aria-orientation", panel.along === "x" ? "vertical" : "horizontal");
    this.element.addEventListener("pointerdown", (event) => this.#grasp(event));
    this.element.addEventListener("dblclick", () => this.fold(!this.folded));
    this.element.addEventListener("keydown", (event) => this.#press(event));
    this.element.addEventListener("focus", () => this.element.setAttribute("aria-valuenow", String(this.#shown)));
    this.#draw();
  }

  get folded() {
    return this.#size.folded;
  }

  /** @param {boolean} folded */
  fold(folded) {
    this.#change({ ...this.#size, folded });
  }

  get #kept() {
    return `r2c2r-panel-${this.#panel.name}`;
  }

  /** @param {PointerEvent} event */
  #grasp(event) {
    event.preventDefault();
    this.element.setPointerCapture(event.pointerId);
    const { along, grows } = this.#panel;
    const from = { at: along === "x" ? event.clientX : event.clientY, px: this.#shown };
    const done = new AbortController();
    const follow = (/** @type {PointerEvent} */ { clientX, clientY }) =>
      this.#change(moved(from.px + grows * ((along === "x" ? clientX : clientY) - from.at), this.#panel));
    this.element.addEventListener("pointermove", follow, { signal: done.signal });
    this.element.addEventListener("lostpointercapture", () => done.abort(), { once: true });
  }

  /** @param {KeyboardEvent} event */
  #press(event) {
    const { along, grows } = this.#panel;
    const [less, more] = along === "x" ? ["ArrowLeft", "ArrowRight"] : ["ArrowUp", "ArrowDown"];
    const step = { [less]: -STEP, [more]: STEP }[event.key];
    if (event.key === "Enter") this.fold(!this.folded);
    else if (step) this.#change(moved(this.#shown + grows * step, this.#panel));
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** Size of the panel in pixels; the style sheet's value until the bar is moved. */
  get #shown() {
    if (this.folded) return 0;
    return this.#size.px ?? Number.parseFloat(getComputedStyle(this.#grid).getPropertyValue(`--${this.#panel.name}`));
  }

  /** @param {import("../lib/panels.js").Size} size */
  #change(size) {
    this.#size = { px: size.px ?? this.#size.px, folded: size.folded };
    localStorage.setItem(this.#kept, JSON.stringify(this.#size));
    this.#draw();
  }

  #draw() {
    const { name, least, most } = this.#panel;
    const { px, folded } = this.#size;
    if (px === null) this.#grid.style.removeProperty(`--${name}`);
    else this.#grid.style.setProperty(`--${name}`, `${px}px`);
    this.#grid.classList.toggle(`no-${name}`, folded);
    const value = folded ? 0 : (px ?? least);
    for (const [what, is] of Object.entries({ valuenow: value, valuemin: 0, valuemax: most }))
      this.element.setAttribute(`aria-${what}`, String(is));
    this.element.title = `${this.#panel.label}: drag, or double-click to ${folded ? "unfold" : "fold"} it`;
  }
}
