/** The `?` overlay, printed from the keymap the code uses. */

import { h } from "../dom.js";
import { plainKeys, setPlainKeys } from "../keyboard.js";
import { KEYMAP } from "../lib/keymap.js";

const TITLES = { all: "Everywhere", annotate: "Annotate", review: "Review" };

export class HelpOverlay extends HTMLElement {
  #dialog = h("dialog", { "aria-label": "Keyboard and mouse" });

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
  const sections = /** @type {const} */ (["annotate", "review", "all"]).flatMap((page) => [
    h("h2", {}, TITLES[page]),
    h(
      "table",
      {},
      h(
        "tbody",
        {},
        ...KEYMAP.filter((binding) => binding.page === page).map((binding) =>
          h("tr", {}, h("td", {}, ...binding.keys.map((key) => h("kbd", {}, key))), h("td", {}, binding.text)),
        ),
      ),
    ),
  ]);
  const mouse = h(
    "p",
    {},
    "Left click adds to the object, right click or Shift+click takes away. Click a marker to remove it, drag it to move it. " +
      "Drag a box around a thing to say where it ends. Wheel zooms, middle drag or Alt-drag pans; two fingers do both, and Take away makes a tap do what the right button does. Hold Ctrl to place several clicks before the mask is computed.",
  );
  const plain = h("input", { type: "checkbox", checked: plainKeys() });
  plain.addEventListener("change", () => setPlainKeys(plain.checked));
  return [
    h("h1", {}, "Keyboard and mouse"),
    mouse,
    h("label", { class: "row" }, plain, "Letters alone are commands (the palette, Ctrl+K, works without)"),
    ...sections,
    h("p", {}, h("button", { type: "button", onClick: close }, "Close")),
  ];
}
