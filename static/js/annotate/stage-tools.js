/**
 * Toolbar beside the frame: effect of a click, painting tools, opacity of the masks; on a narrow screen also the button for
 * depth, shape and comments. Its status (segmenter, last change) is placed among the frames, where it shifts no layout.
 * Emits "opacity" and "sign" when they change, "evidence" when its button is clicked, "paint" with the tool or action.
 */

import { h, icon, segments, slider } from "../dom.js";
import { rove } from "./rove.js";
import { SegmenterChip } from "./segmenter-chip.js";

/** @type {[string, string, string][]} */
const PAINTS = [
  ["brush", "Brush", "Paint the chosen object's mask in this frame (B)"],
  ["eraser", "Eraser", "Erase from its mask in this frame (Shift B)"],
  ["lasso", "Lasso", "Lasso: draw around what belongs to it (L)"],
  ["polygon", "Polygon", "Polygon: click its corners, Enter closes it (O)"],
];
/** @type {[string, string, string, string][]} action, icon, label, tooltip */
const HERE = [
  ["keep", "check", "Mask is right", "Its mask in this frame is right: keep it (W)"],
  ["absent", "eye-off", "Not visible", "It is not visible in this frame; again restores its mask (A)"],
];

export class StageTools extends EventTarget {
  segmenter = new SegmenterChip();
  #saved = h("span", { class: "chip", role: "status" });
  #opacity = h("input", { type: "range", min: "0", max: "100", value: "42", "aria-label": "Mask opacity" });
  /** Chips with the state of the segmenter and of the last change. */
  status = h("div", { class: "status" }, this.segmenter.element, this.#saved);
  #adds = h("button", { type: "button" }, icon("plus"), "Add");
  #takes = h("button", { type: "button" }, icon("minus"), "Take away");
  #evidence = h("button", { type: "button", class: "narrow-only", "aria-expanded": "false" }, "Depth, shape, comments");
  #paints = segments(
    "What a drag paints",
    ...PAINTS.map(([tool, text, title]) =>
      h(
        "button",
        { type: "button", title, "aria-pressed": "false", "data-tool": tool, onClick: () => this.#paint(tool) },
        icon(tool),
        text,
      ),
    ),
  );
  #here = segments(
    "This frame",
    ...HERE.map(([what, shown, text, title]) =>
      h("button", { type: "button", title, onClick: () => this.#paint(what) }, icon(shown), text),
    ),
  );
  /** @type {0 | 1} label of a click: 1 adds, 0 takes away */
  sign = 1;
  element = h(
    "div",
    { class: "rail", role: "toolbar", "aria-label": "Tools" },
    segments("What a click does", this.#adds, this.#takes),
    this.#paints,
    this.#here,
    slider("Masks", this.#opacity),
    this.#evidence,
  );

  constructor() {
    super();
    this.#opacity.addEventListener("input", () => this.dispatchEvent(new Event("opacity")));
    this.#adds.addEventListener("click", () => this.#mean(1));
    this.#takes.addEventListener("click", () => this.#mean(0));
    this.#evidence.addEventListener("click", () => this.dispatchEvent(new Event("evidence")));
    this.#mean(1);
    rove(this.element);
  }

  /** Opacity of the masks, 0 to 1. */
  get opacity() {
    return Number(this.#opacity.value) / 100;
  }

  /** Switch clicks between adding and taking away. */
  switchSign() {
    this.#mean(this.sign === 1 ? 0 : 1);
  }

  /** @param {boolean} on whether depth, shape and comments are shown */
  showEvidence(on) {
    this.#evidence.setAttribute("aria-expanded", String(on));
  }

  /** @param {string | null} tool in use */
  showTool(tool) {
    for (const one of this.#paints.querySelectorAll("button"))
      one.setAttribute("aria-pressed", String(one.dataset.tool === tool));
  }

  /** @param {string} what */
  #paint(what) {
    this.dispatchEvent(new CustomEvent("paint", { detail: what }));
  }

  /**
   * @param {string} text
   * @param {string} [tone]
   */
  saved(text, tone = "") {
    this.#saved.textContent = text;
    this.#saved.className = `chip ${tone}`;
  }

  /** @param {0 | 1} sign */
  #mean(sign) {
    this.sign = sign;
    this.#adds.setAttribute("aria-pressed", String(sign === 1));
    this.#takes.setAttribute("aria-pressed", String(sign === 0));
    this.dispatchEvent(new Event("sign"));
  }
}
