/** Thumbnails of the scan's planes; those without a front are folded. Emits "choose" id. */

import { h } from "../dom.js";
import { rectOf, sizeOf } from "../lib/elevation.js";
import { counted } from "../lib/format.js";

/** @typedef {import("../api-types").Elevation} Elevation */

export class PlaneList extends EventTarget {
  /** @type {Elevation[]} */
  items = [];
  /** Entries by plane id. @type {Map<number, HTMLElement>} */
  #entries = new Map();
  #arranged = false;
  #list = h("ul", { class: "planes" });
  #summary = h("summary");
  #others = h("ul", { class: "planes" });
  #more = h("details", { hidden: true }, this.#summary, this.#others);
  element = h("aside", { "aria-label": "Planes" }, h("h1", {}, "Planes"), this.#list, this.#more);

  /** @param {Elevation[]} items */
  fill(items) {
    this.items = items;
    this.#entries = new Map(items.map((item) => [item.id, h("li", {}, this.#button(item))]));
    this.#list.replaceChildren(...this.#entries.values());
    this.#arranged = false;
  }

  /** @param {number} id */
  choose(id) {
    for (const button of this.element.querySelectorAll("button"))
      button.setAttribute("aria-pressed", String(Number(button.dataset.plane) === id));
    if (this.#entries.get(id)?.parentElement === this.#others) this.#more.open = true;
  }

  /** Show the number of fronts on each plane; at first, fold the planes without any. @param {number[][][]} fronts corners */
  count(fronts) {
    const counts = this.items.map((item) => fronts.filter((corners) => rectOf(item, corners)).length);
    for (const [k, { id }] of this.items.entries()) {
      const said = this.#entries.get(id)?.querySelector(".chip");
      if (said) said.textContent = counted(counts[k] ?? 0, "front");
    }
    if (!this.#arranged) this.#arrange(counts);
  }

  /** Arrange the planes once: one that somebody works on later must not move. @param {number[]} counts */
  #arrange(counts) {
    const any = counts.some((count) => count > 0);
    const useful = this.items.map(({ cells }, k) => (any ? Boolean(counts[k]) : cells.length > 0));
    const entries = [...this.#entries.values()];
    const others = useful.includes(true) ? entries.filter((_, k) => !useful[k]) : [];
    this.#others.replaceChildren(...others);
    this.#more.hidden = !others.length;
    this.#summary.textContent = `${counted(others.length, "plane")} without a front`;
    this.#arranged = this.items.length > 0;
  }

  /** @param {Elevation} item */
  #button(item) {
    const { width, height } = sizeOf(item);
    const size = `${width.toFixed(2)} × ${height.toFixed(2)} m`;
    const picture = h("img", { src: item.url, alt: `Plane ${item.id + 1},`, loading: "lazy" });
    const choose = () => this.dispatchEvent(new CustomEvent("choose", { detail: item.id }));
    return h(
      "button",
      { type: "button", "data-plane": String(item.id), onClick: choose },
      picture,
      h("span", {}, size, " ", h("span", { class: "chip" }, "0 fronts")),
    );
  }
}
