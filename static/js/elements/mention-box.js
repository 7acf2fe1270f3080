/** Autocomplete of names after @ in a text field: arrows select, Enter or Tab accepts, Esc closes. */

import { h } from "../dom.js";
import { typedName, withName } from "../lib/mentions.js";

const SHOWN = 8; // most names listed

/**
 * @param {HTMLTextAreaElement} field
 * @param {string[]} names
 * @returns {HTMLElement} the list, to be placed below the field
 */
export function mentionBox(field, names) {
  const list = h("ul", { class: "mentions", role: "listbox", id: "mentions", "aria-label": "People", hidden: true });
  /** @type {string[]} */
  let found = [];
  let chosen = 0;
  field.setAttribute("aria-autocomplete", "list");
  field.setAttribute("aria-controls", list.id);

  const draw = () => {
    list.hidden = !found.length;
    list.replaceChildren(...found.map((name, k) => option(name, k)));
    if (found.length) field.setAttribute("aria-activedescendant", `mention-${chosen}`);
    else field.removeAttribute("aria-activedescendant");
  };
  /** @type {(name: string, k: number) => HTMLElement} */
  const option = (name, k) => {
    const made = h("li", { role: "option", id: `mention-${k}`, "aria-selected": String(k === chosen) }, name);
    made.addEventListener("pointerdown", (event) => {
      event.preventDefault(); // keep the focus in the field
      take(name);
    });
    return made;
  };
  /** @param {string} name */
  const take = (name) => {
    const { text, caret } = withName(field.value, field.selectionStart, name);
    field.value = text;
    field.setSelectionRange(caret, caret);
    show([]);
  };
  /** @param {string[]} some */
  const show = (some) => {
    found = some;
    chosen = 0;
    draw();
  };
  field.addEventListener("input", () => {
    const typed = typedName(field.value, field.selectionStart)?.typed;
    show(typed === undefined ? [] : names.filter((name) => name.startsWith(typed)).slice(0, SHOWN));
  });
  field.addEventListener("blur", () => show([]));
  field.addEventListener("keydown", (event) => {
    const name = found[chosen];
    if (!name || event.ctrlKey || event.metaKey) return;
    if (event.key === "ArrowDown" || event.key === "ArrowUp") {
      chosen = (chosen + (event.key === "ArrowDown" ? 1 : found.length - 1)) % found.length;
      draw();
    } else if (event.key === "Enter" || event.key === "Tab") take(name);
    else if (event.key === "Escape") show([]);
    else return;
    event.preventDefault(); // Esc closes the list, not the dialog
  });
  return list;
}
