/**
 * Checklist of the objects still to be clicked, with editable fields for the name and category of the next object, filled in
 * from the selected entry.
 */

import { h, renew } from "../dom.js";
import { following, remaining } from "../lib/checklist.js";
import { usableName } from "../lib/format.js";

/** @typedef {import("../lib/checklist.js").Listed} Listed */

const UNSAID = "drawer"; // category where neither the user nor a proposal says one

export class Checklist {
  #category = h("input", {
    type: "text",
    placeholder: "auto",
    list: "categories",
    "aria-label": "Category of the next object",
    title: `Category of the next object; empty: that of the proposal it is clicked in, else ${UNSAID}`,
  });
  #name = h("input", {
    type: "text",
    placeholder: "numbered",
    "aria-label": "Name of the next object",
    title: "Name of the next object; empty: its category and a number",
  });
  #lines = h("ul", { class: "plain" });
  #count = h("summary");
  #named = h("label", { class: "next-name", hidden: true }, h("span", { class: "muted" }, "called"), this.#name);
  /** @type {Listed[]} */
  #listed = [];
  /** @type {{ name: string }[]} */
  #objects = [];
  /** Names of objects being created. @type {Set<string>} */
  #coming = new Set();
  /** @type {string | null} name of the selected entry */
  #chosen = null;
  /** Whether the user deselected the list, so that the next object is not taken from it. */
  #free = false;
  #drawn = ""; // last rendered state: streamed masks must not replace a row that is being pressed
  fields = [this.#category, this.#named];
  element = h("details", { class: "checklist", open: true, hidden: true }, this.#count, this.#lines);

  /** Category and name of the next object. @param {string | undefined} proposed category of a proposal where it is clicked */
  next(proposed) {
    const category = this.#category.value.trim() || proposed || UNSAID;
    return { category, name: usableName(this.#name.value) || undefined };
  }

  /** @param {string} category */
  set category(category) {
    this.#category.value = category;
  }

  /** Entries without an object, neither stored nor being created. */
  get left() {
    return remaining(this.#listed, [...this.#objects, ...[...this.#coming].map((name) => ({ name }))]);
  }

  /** @param {Listed[]} listed */
  set listed(listed) {
    this.#listed = listed;
    this.#draw();
  }

  /** Stored objects. @param {{ name: string }[]} objects */
  set objects(objects) {
    this.#objects = objects;
    this.#draw();
  }

  /** Mark an object of that name as being created, or no longer. @param {string | undefined} name @param {boolean} coming */
  making(name, coming) {
    if (name && coming) this.#coming.add(name);
    else if (name) this.#coming.delete(name);
    if (coming) this.#fill(this.#turn);
    this.#draw();
  }

  /** Select the next entry; after the last one, none. */
  step() {
    const { left } = this;
    const at = left.findIndex(({ name }) => name === this.#chosen);
    this.choose(left[at + 1]?.name ?? null);
  }

  /** @param {string | null} name null: none of the list */
  choose(name) {
    this.#free = name === null;
    this.#fill(this.left.find((entry) => entry.name === name) ?? null);
    this.#chosen = name;
    this.#draw();
  }

  /** Entry that is next: the selected one, or the one after it once that is clicked. @returns {Listed | null} */
  get #turn() {
    const { left } = this;
    if (this.#free) return null;
    return left.find(({ name }) => name === this.#chosen) ?? following(this.#listed, left, this.#chosen);
  }

  #draw() {
    const { left } = this;
    const turn = this.#turn;
    if ((turn?.name ?? null) !== this.#chosen) this.#fill(turn);
    this.#chosen = turn?.name ?? null;
    this.#named.hidden = this.element.hidden = !left.length;
    if (!left.length) this.#name.value = "";
    this.#count.textContent = `Still to click: ${left.length} of ${this.#listed.length}`;
    const drawn = JSON.stringify([left, this.#chosen]);
    if (drawn !== this.#drawn) renew(this.#lines, ...left.map((entry) => this.#line(entry)));
    this.#drawn = drawn;
  }

  /** @param {Listed | null} entry */
  #fill(entry) {
    this.#name.value = entry?.name ?? "";
    if (entry || this.#chosen) this.category = entry?.category ?? "";
  }

  /** @param {Listed} entry */
  #line({ name, category }) {
    const chosen = name === this.#chosen;
    const button = h(
      "button",
      { type: "button", class: "quiet", "aria-pressed": String(chosen), "data-at": `listed:${name}` },
      h("span", {}, name),
      h("span", { class: "muted" }, category),
    );
    button.addEventListener("click", () => this.choose(chosen ? null : name));
    return h("li", {}, button);
  }
}
