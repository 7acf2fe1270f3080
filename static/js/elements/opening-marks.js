/**
 * Opening of each leaf of an object in a photo: the measured or marked value, and controls to mark another.
 * Emits "turn" while a leaf is dragged, before anything is stored, "mark" {leaf, value, stops, alone} to store a value (null
 * removes the mark) and, with `stops`, the limit of the joint, and "seek" {frame} when its plot is pressed.
 */

import { h, renew } from "../dom.js";
import { jointValue } from "../lib/format.js";
import { isMarked } from "../lib/opening-marks.js";
import { drawOpening } from "../lib/opening-view.js";
import { stateIn } from "../lib/openings.js";
import { sourceChip, sourceWord } from "../source-chip.js";

/** @typedef {import("../api-types").Leaf} Leaf */
/** @typedef {import("../api-types").Photo} Photo */
/** @typedef {{ leaf: Leaf, element: HTMLElement, canvas: HTMLCanvasElement, set: (value: number) => void }} Row */

const DEGREE = Math.PI / 180;
/** Step of the slider, in radians or metres; a key moves by KEY_STEPS of them. */
const STEP = { revolute: DEGREE, prismatic: 0.005 };
const KEY_STEPS = 2;

export class OpeningMarks extends EventTarget {
  element = h("div", { class: "opening-marks", role: "group", "aria-label": "How far it stands open in this photo" });
  /** Why marking is not allowed; empty if it is. */
  refusal = "";
  /** @type {Row[]} */
  #rows = [];
  /** @type {Photo | undefined} */
  #photo;
  #at = 0;
  /** Unsaved values of dragged leaves, by joint. @type {Map<string, number>} */
  #turned = new Map();
  #shown = "";

  /** @param {Leaf[]} leaves @param {Photo} photo */
  show(leaves, photo) {
    const shown = JSON.stringify([leaves, photo.frame, photo.states, this.refusal]);
    if (shown !== this.#shown) {
      this.#shown = shown;
      this.#photo = photo;
      this.#turned.clear();
      this.#at = Math.min(this.#at, Math.max(leaves.length - 1, 0));
      this.#rows = leaves.map((leaf, k) => this.#row(leaf, k, leaves.length > 1));
      renew(this.element, ...this.#rows.map(({ element }) => element));
      this.#choose(this.#at);
    }
    this.element.hidden = leaves.length === 0;
    this.draw();
  }

  /** Draw the plots at their current size. */
  draw() {
    const { color: ink } = getComputedStyle(this.element);
    for (const { leaf, canvas } of this.#rows) {
      const { opening } = leaf;
      if (!opening || !this.#photo) continue;
      const frames = opening.states.map(({ frame }) => frame);
      const size = { width: canvas.clientWidth, height: canvas.clientHeight };
      const { color: colour } = getComputedStyle(canvas);
      drawOpening(canvas, size, { opening, colour }, frames, frames.indexOf(this.#photo.frame), ink);
    }
  }

  /** Leaves as drawn over the photo. @returns {{ leaf: Leaf, value: number, turned: boolean }[]} */
  get leaves() {
    return this.#rows.map(({ leaf }) => ({ leaf, value: this.#value(leaf), turned: this.#turned.has(leaf.joint) }));
  }

  /** @param {Leaf} leaf @param {number} value */
  turn(leaf, value) {
    const within = Math.min(Math.max(value, 0), leaf.most);
    this.#turned.set(leaf.joint, within);
    this.#rows.find((row) => row.leaf.joint === leaf.joint)?.set(within);
    this.dispatchEvent(new Event("turn"));
  }

  /** Discard unsaved values. */
  drop() {
    const turned = this.#rows.filter(({ leaf }) => this.#turned.delete(leaf.joint));
    for (const { leaf, set } of turned) set(this.#value(leaf));
    if (turned.length) this.dispatchEvent(new Event("turn"));
  }

  /** @param {1 | -1} way to open it, or to close it */
  step(way) {
    const leaf = this.#chosen;
    if (leaf && !this.refusal) this.turn(leaf, this.#value(leaf) + way * KEY_STEPS * STEP[leaf.type]);
  }

  closed() {
    if (this.#chosen) this.mark(this.#chosen, 0);
  }

  open() {
    if (this.#chosen) this.mark(this.#chosen, this.#value(this.#chosen));
  }

  /** Mark it as open by what is shown, and as unable to open further. */
  stops() {
    if (this.#chosen && this.#value(this.#chosen) > 0) this.mark(this.#chosen, this.#value(this.#chosen), true);
  }

  remove() {
    if (this.#chosen && isMarked(this.#state(this.#chosen))) this.mark(this.#chosen, null);
  }

  next() {
    if (this.#rows.length) this.#choose((this.#at + 1) % this.#rows.length);
  }

  /** @param {Leaf} leaf @param {number | null} value @param {boolean} [stops] */
  mark(leaf, value, stops = false) {
    this.dispatchEvent(new CustomEvent("mark", { detail: { leaf, value, stops, alone: this.#rows.length === 1 } }));
  }

  get #chosen() {
    return this.#rows[this.#at]?.leaf;
  }

  /** @param {number} k */
  #choose(k) {
    this.#at = k;
    const several = this.#rows.length > 1;
    this.#rows.forEach(({ element }, at) => element.setAttribute("aria-current", String(several && at === k)));
  }

  /** @param {Leaf} leaf */
  #state({ joint }) {
    return this.#photo?.states.find((state) => state.joint === joint);
  }

  /** @param {Leaf} leaf */
  #value(leaf) {
    return this.#turned.get(leaf.joint) ?? this.#state(leaf)?.value ?? 0;
  }

  /**
   * @param {Leaf} leaf
   * @param {number} k
   * @param {boolean} named
   * @returns {Row}
   */
  #row(leaf, k, named) {
    const name = named ? `${leaf.part.replaceAll("_", " ")}: ` : "";
    const about = name ? ` (${name.slice(0, -2)})` : "";
    const not = { disabled: this.refusal !== "", title: this.refusal };
    /** @type {(text: string, act: () => void, at: string) => HTMLButtonElement} */
    const button = (text, act, at) => {
      const made = h("button", { type: "button", ...not, onClick: () => (this.#choose(k), act()) }, text);
      if (about) made.setAttribute("aria-label", text + about);
      made.dataset.at = `${at}:${leaf.joint}`;
      return made;
    };
    const closed = button("Closed here", () => this.closed(), "closed");
    const open = button("", () => this.open(), "open");
    const stops = button("Stops here", () => this.stops(), "stops");
    const remove = button("Remove this mark", () => this.remove(), "unmark");
    remove.hidden = !isMarked(this.#state(leaf));
    const slider = h("input", {
      type: "range",
      min: "0",
      max: String(leaf.most),
      step: String(STEP[leaf.type]),
      "aria-label": `How far it stands open in this photo${about}`,
      ...not,
    });
    slider.dataset.at = `turn:${leaf.joint}`;
    slider.addEventListener("focus", () => this.#choose(k));
    slider.addEventListener("input", () => this.turn(leaf, Number(slider.value)));
    /** @type {(value: number) => void} */
    const set = (value) => {
      slider.value = String(value);
      slider.setAttribute("aria-valuetext", jointValue(leaf.type, value));
      open.textContent = `Open here: ${jointValue(leaf.type, value)}`;
      if (about) open.setAttribute("aria-label", open.textContent + about);
      stops.disabled = this.refusal !== "" || value <= 0;
    };
    set(this.#value(leaf));
    const canvas = this.#plot(leaf, about);
    const element = h(
      "div",
      { class: "leaf", role: "group", "aria-label": `Opening${about}` },
      h("span", { class: "said" }, h("output", {}, name + this.#words(leaf)), this.#chip(leaf)),
      closed,
      slider,
      open,
      stops,
      remove,
      canvas,
    );
    return { leaf, element, canvas, set };
  }

  /** @param {Leaf} leaf */
  #words(leaf) {
    const state = this.#state(leaf);
    if (!state || !leaf.opening) return "no opening was filmed: mark how far it is open here";
    return state.value === null ? "not known in this photo" : stateIn(leaf.opening, this.#photo?.frame ?? -1);
  }

  /** @param {Leaf} leaf */
  #chip(leaf) {
    const state = this.#state(leaf);
    if (!state || state.value === null) return null;
    return sourceChip(isMarked(state) ? "person" : (leaf.opening?.source ?? "measured"));
  }

  /** @param {Leaf} leaf @param {string} about */
  #plot({ opening }, about) {
    if (!opening) return h("canvas", { hidden: true });
    const marks = opening.states.filter(isMarked).length;
    const widest = `${jointValue(opening.kind, opening.largest)}, ${sourceWord("at_least")}`;
    const label = `Opening over the frames${about}: up to ${widest}; marked in ${marks}`;
    const canvas = h("canvas", { role: "img", "aria-label": label, title: label });
    canvas.addEventListener("pointerdown", (event) => {
      const at = Math.floor((event.offsetX / Math.max(canvas.clientWidth, 1)) * opening.states.length);
      const state = opening.states[Math.min(at, opening.states.length - 1)];
      if (state) this.dispatchEvent(new CustomEvent("seek", { detail: { frame: state.frame } }));
    });
    return canvas;
  }
}
