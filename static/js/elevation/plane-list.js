/** Thumbnails of the scan's planes. Emits "choose" id. */

import { h } from "../dom.js";
import { rectOf, sizeOf } from "../lib/elevation.js";

/** @typedef {import("../api-types").Elevation} Elevation */

export class PlaneList extends EventTarget {
  /** @type {Elevation[]} */
  items = [];
  #list = h("ul", { class: "planes" });
  element = h("aside", { "aria-label": "Planes" }, h("h1", {}, "Planes"), this.#list);

  /** @param {Elevation[]} items */
  fill(items) {
    this.items = items;
    this.#list.replaceChildren(...items.map((item) => h("li", {}, this.#button(item))));
  }

  /** @param {number} id */
  choose(id) {
    for (const button of this.#list.querySelectorAll("button"))
      button.setAttribute("aria-pressed", String(Number(button.dataset.plane) === id));
  }

  /** Show the number of fronts on each plane. @param {number[][][]} fronts corners */
  count(fronts) {
    for (const item of this.items) {
      const count = fronts.filter((corners) => rectOf(item, corners)).length;
      const said = this.#list.querySelector(`[data-plane="${item.id}"] .chip`);
      if (said) said.textContent = count === 1 ? "1 front" : `${count} fronts`;
    }
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
