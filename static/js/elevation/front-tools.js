/** Tools for a click on the plane, instead of choosing a front: seam, handle or hinge; at most one is active. */

import { h, segments } from "../dom.js";

/** @typedef {"seam" | "level-seam" | "handle" | "hinge"} Tool */

/** @type {[Tool, string, string][]} */
const TOOLS = [
  ["seam", "Seam │", "Click a front to split it by a vertical seam (S at the pointer)"],
  ["level-seam", "Seam ─", "Click a front to split it by a horizontal seam (Shift S at the pointer)"],
  ["handle", "Handle", "Click where the handle is (K at the pointer)"],
  ["hinge", "Hinge", "Click near the side it turns on (J at the pointer)"],
];

export class FrontTools {
  /** @type {Tool | null} */
  chosen = null;
  #edits;
  #canvas;
  element = segments(
    "What a click does",
    ...TOOLS.map(([tool, text, title]) =>
      h(
        "button",
        { type: "button", title, "aria-pressed": "false", "data-tool": tool, onClick: () => this.use(tool) },
        text,
      ),
    ),
  );

  /**
   * @param {import("./edits.js").FrontEdits} edits
   * @param {import("../elements/elevation-canvas.js").ElevationCanvas} canvas
   */
  constructor(edits, canvas) {
    this.#edits = edits;
    this.#canvas = canvas;
  }

  /** Activate a tool, or deactivate it if it is active. @param {Tool} tool */
  use(tool) {
    this.chosen = this.chosen === tool ? null : tool;
    this.#canvas.tooled = this.chosen !== null;
    for (const one of this.element.querySelectorAll("button"))
      one.setAttribute("aria-pressed", String(one.dataset.tool === this.chosen));
  }

  /** @param {{ x: number, y: number }} at of the click */
  clicked(at) {
    if (this.chosen === "seam") this.#edits.split("upright", at);
    else if (this.chosen === "level-seam") this.#edits.split("level", at);
    else if (this.chosen === "handle") this.#edits.setHandle(at);
    else if (this.chosen === "hinge") this.#edits.setHinge(at);
  }
}
