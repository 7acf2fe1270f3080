/** Layout of the page: objects, tools, image, evidence, and the frames below, resizable by splitters between them. */

import { h } from "../dom.js";
import { Splitter } from "../elements/splitter.js";

/** @type {import("../lib/panels.js").Panel[]} */
const PANELS = [
  { name: "list", label: "Width of the list of objects", along: "x", grows: 1, least: 200, most: 480 },
  { name: "evidence", label: "Width of depth, shape and comments", along: "x", grows: -1, least: 160, most: 480 },
  { name: "lanes", label: "Height of the lanes", along: "y", grows: -1, least: 26, most: 400 },
];

export class Layout {
  element = h("div", { class: "annotate" });
  #bars = PANELS.map((panel) => new Splitter(this.element, panel));

  /** @param {HTMLElement[]} parts the list, the tools, the stage, the evidence, the frames */
  fill(...parts) {
    this.element.replaceChildren(...parts, ...this.#bars.map(({ element }) => element));
  }

  /** Collapse all panels except the image and its tools, or restore them. */
  fold() {
    const folded = !this.#bars.every((bar) => bar.folded);
    for (const bar of this.#bars) bar.fold(folded);
  }
}
