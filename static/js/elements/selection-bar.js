/**
 * Toolbar for the selected objects. Calls `tell` with "categorise-all" {ids, category}, "rename-all" {ids, name},
 * "assign" {ids, name}, and "hide", "lock", "delete" or "choose-several" ids.
 */

import { h } from "../dom.js";
import { counted, usableName } from "../lib/format.js";

const NOBODY = "nobody "; // trailing space: no account can have this name

export class SelectionBar {
  /** @type {(type: string, detail: unknown) => void} */
  tell = () => {};
  /** @type {number[]} */
  #ids = [];
  #count = h("strong", { role: "status" });
  #hide = h("button", { type: "button" });
  #lock = h("button", { type: "button" });
  #category = h("input", {
    type: "text",
    list: "categories",
    placeholder: "Category",
    "aria-label": "Category for all",
  });
  #name = h("input", {
    type: "text",
    placeholder: "Name, numbered",
    "aria-label": "Name for all, numbered",
    title: "Numbered from left to right, each column from the top down, wall after wall; then what has no front",
  });
  #assign = h("select", { "aria-label": "Assign all to", hidden: true });
  element = h(
    "div",
    { class: "selection", role: "group", "aria-label": "Selected objects", hidden: true },
    this.#count,
    this.#assign,
    this.#hide,
    this.#lock,
    h("button", { type: "button", class: "danger", onClick: () => this.tell("delete", this.#ids) }, "Delete"),
    h("button", { type: "button", class: "quiet", onClick: () => this.tell("choose-several", []) }, "None"),
    this.#category,
    this.#name,
  );

  constructor() {
    this.#hide.addEventListener("click", () => this.tell("hide", this.#ids));
    this.#lock.addEventListener("click", () => this.tell("lock", this.#ids));
    this.#onTyped(this.#category, (category) => this.tell("categorise-all", { ids: this.#ids, category }));
    this.#onTyped(this.#name, (name) => this.tell("rename-all", { ids: this.#ids, name: usableName(name) }));
    this.#assign.addEventListener("change", () => {
      this.tell("assign", { ids: this.#ids, name: this.#assign.value === NOBODY ? null : this.#assign.value });
      this.#assign.value = "";
    });
  }

  /** Possible assignees; an empty list hides the menu. @param {string[]} names */
  set names(names) {
    this.#assign.hidden = !names.length;
    this.#assign.replaceChildren(
      h("option", { value: "" }, "Assign to…"),
      ...[...names, NOBODY].map((name) => h("option", { value: name }, name)),
    );
  }

  /** @param {{ object: { id: number }, hidden: boolean, locked: boolean }[]} selected */
  show(selected) {
    this.#ids = selected.map(({ object }) => object.id);
    this.element.hidden = selected.length === 0;
    this.#count.textContent = `${counted(selected.length, "object")}`;
    this.#hide.textContent = selected.every(({ hidden }) => hidden) ? "Show" : "Hide";
    this.#lock.textContent = selected.every(({ locked }) => locked) ? "Unlock" : "Lock";
  }

  /** @param {HTMLInputElement} input @param {(typed: string) => void} use */
  #onTyped(input, use) {
    input.addEventListener("change", () => {
      const typed = input.value.trim();
      input.value = "";
      if (typed) use(typed);
    });
  }
}
