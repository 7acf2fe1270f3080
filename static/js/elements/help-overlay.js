/** Help overlay (`?`), generated from the keymap. */

import { h, icon } from "../dom.js";
import { plainKeys, setPlainKeys } from "../keyboard.js";
import { KEYMAP, printed } from "../lib/keymap.js";

const TITLES = { annotate: "Annotate", elevation: "Elevation", review: "Review", all: "Everywhere" };
const MOUSE =
  "Left click adds to the object, right click or Shift+click takes away. Click a marker to remove it, drag it to move it. " +
  "Drag a box around a thing to say where it ends. Wheel zooms, middle drag or Alt-drag pans; two fingers do both, and " +
  "Take away makes a tap do what the right button does. Hold Ctrl to place several clicks before the mask is computed. " +
  "In Elevation a drag draws a front, or moves an edge or the chosen front; edges snap to lines and to other fronts, with Alt they " +
  "stay where they are put. Space-drag pans.";

export class HelpOverlay extends HTMLElement {
  #dialog = h("dialog", { class: "help", "aria-label": "Keyboard and mouse" });

  connectedCallback() {
    this.append(this.#dialog);
  }

  toggle() {
    if (this.#dialog.open) this.#dialog.close();
    else {
      this.#dialog.replaceChildren(...content(() => this.#dialog.close()));
      this.#dialog.showModal();
    }
  }
}

/** @param {() => void} close */
function content(close) {
  const plain = h("input", { type: "checkbox", checked: plainKeys() });
  plain.addEventListener("change", () => setPlainKeys(plain.checked));
  const shut = h("button", { type: "button", class: "quiet", "aria-label": "Close", onClick: close }, icon("cross"));
  return [
    h("div", { class: "row" }, h("h1", { class: "grow" }, "Keyboard and mouse"), shut),
    h("p", { class: "muted" }, MOUSE),
    h("label", { class: "row" }, plain, "Single letters are shortcuts (the palette, Ctrl+K, always works)"),
    h("div", { class: "keys" }, ...Object.entries(TITLES).map(([page, title]) => section(page, title))),
  ];
}

/**
 * @param {string} page
 * @param {string} title
 */
function section(page, title) {
  const lines = KEYMAP.filter((binding) => binding.page === page).map(({ keys, text }) =>
    h("tr", {}, h("td", {}, ...printed(keys).map((key) => h("kbd", {}, key))), h("td", {}, text)),
  );
  return h("section", {}, h("h2", {}, title), h("table", {}, h("tbody", {}, ...lines)));
}
