/**
 * The objects of a project. Emits "pick-object" id|null (not "select": fields fire that themselves, and it bubbles),
 * "rename" {id, name, version}, "categorise" {id, category, version}, "delete" id, "toggle" id, "stop" id.
 */

import { h, icon, LiveElement } from "../dom.js";
import { counted } from "../lib/format.js";

/** @typedef {import("../api-types").SceneObject} SceneObject */

export class ObjectList extends LiveElement {
  #list = h("ul", { class: "object-list" });
  #categories = h("datalist", { id: "categories" });
  #new = h("button", { type: "button", class: "primary" }, icon("plus"), "New object");
  #drawn = "";
  /** @type {number | null} whose line was brought into sight */
  #shown = null;
  /** @type {(() => void) | null} what to draw once the person has finished typing */
  #waiting = null;

  connected() {
    this.replaceChildren(this.#new, this.#list, this.#categories);
    this.#new.addEventListener("click", () => this.emit("pick-object", null), { signal: this.signal });
    this.addEventListener("focusout", () => setTimeout(() => this.#waiting?.()), { signal: this.signal });
  }

  /** @param {{ name: string, label: string }[]} categories */
  setCategories(categories) {
    this.#categories.replaceChildren(
      ...categories.map((category) => h("option", { value: category.name }, category.label)),
    );
  }

  /**
   * @param {SceneObject[]} objects
   * @param {{ current: number | null, hidden: Set<number>, colourOf: (object: SceneObject) => string }} view
   */
  setObjects(objects, { current, hidden, colourOf }) {
    this.#waiting = null;
    if (this.#isTyping(current)) {
      this.#waiting = () => this.setObjects(objects, { current, hidden, colourOf });
      return;
    }
    this.#new.setAttribute("aria-pressed", String(current === null));
    const state = JSON.stringify([objects, current, [...hidden]]);
    if (state === this.#drawn) return;
    this.#drawn = state;
    this.#list.replaceChildren(
      ...objects.map((object, k) =>
        this.#item(object, k + 1, object.id === current, hidden.has(object.id), colourOf(object)),
      ),
    );
    if (this.#shown !== current) this.#list.querySelector(".current")?.scrollIntoView({ block: "nearest" });
    this.#shown = current;
    if (!objects.length) {
      this.#list.replaceChildren(h("li", { class: "muted" }, "Click a drawer, a door or a thing in the picture."));
    }
  }

  /**
   * Whether a field of the current object is being typed in: masks that stream in must not take it away.
   * @param {number | null} current
   */
  #isTyping(current) {
    const field = document.activeElement;
    return (
      field instanceof HTMLInputElement && this.#list.contains(field) && field.dataset.field?.endsWith(`-${current}`)
    );
  }

  /**
   * @param {SceneObject} object
   * @param {number} number
   * @param {boolean} current
   * @param {boolean} hidden
   * @param {string} colour
   */
  #item(object, number, current, hidden, colour) {
    const pick = h("button", { type: "button", class: "pick", "aria-pressed": String(current) }, object.name);
    pick.title = object.name;
    pick.addEventListener("click", () => this.emit("pick-object", object.id));
    const eye = h(
      "button",
      { type: "button", class: "quiet", "aria-label": `${hidden ? "Show" : "Hide"} ${object.name}` },
      icon(hidden ? "eye-off" : "eye"),
    );
    eye.addEventListener("click", () => this.emit("toggle", object.id));
    const remove = h(
      "button",
      { type: "button", class: "quiet danger", "aria-label": `Delete ${object.name}` },
      icon("trash"),
    );
    remove.addEventListener("click", () => this.emit("delete", object.id));
    const badge = h("span", { class: "badge" }, String(number));
    const item = h(
      "li",
      { class: current ? "current" : "" },
      h("div", { class: "head" }, badge, pick, eye, remove),
      h("div", { class: "row muted state" }, state(object, current), this.#stop(object)),
      current ? this.#fields(object) : null,
      ...object.notices.map((notice) => h("div", { class: "muted" }, notice)),
    );
    item.style.setProperty("--swatch", colour);
    return item;
  }

  /** @param {SceneObject} object */
  #stop(object) {
    if (object.segment !== "running" && object.segment !== "waiting") return null;
    const stop = h("button", { type: "button", class: "quiet", "aria-label": `Stop finding ${object.name}` }, "Stop");
    stop.addEventListener("click", () => this.emit("stop", object.id));
    return stop;
  }

  /** @param {SceneObject} object */
  #fields(object) {
    /** @type {(field: string, label: string, value: string, props?: Record<string, string>) => HTMLElement} */
    const field = (name, label, value, props = {}) => {
      const input = h("input", { type: "text", value, "aria-label": `${label} of ${object.name}`, ...props });
      input.dataset.field = `${name}-${object.id}`;
      input.addEventListener("change", () => {
        if (!input.value.trim() || input.value === value) return;
        const type = name === "name" ? "rename" : "categorise";
        this.emit(type, { id: object.id, [name]: input.value.trim(), version: object.version });
      });
      input.addEventListener("keydown", (event) => {
        if (event.key === "Enter") input.blur();
        if (event.key === "Escape") input.value = value;
      });
      return h("label", {}, h("span", { class: "muted" }, label), input);
    };
    return h(
      "div",
      { class: "fields" },
      field("category", "Category", object.category, { list: "categories" }),
      field("name", "Name", object.name),
    );
  }
}

/**
 * @param {SceneObject} object
 * @param {boolean} current
 */
function state(object, current) {
  if (!object.points.length) return "no click yet";
  const clicks = counted(object.points.length, "click");
  if (object.segment === "running" || object.segment === "waiting") return `${clicks} · finding it in all frames…`;
  if (object.segment === "failed") return h("span", { class: "chip bad" }, "no mask");
  if (object.mask_frames) {
    if (object.segment === "partial") return `${clicks} · stopped after ${counted(object.mask_frames, "frame")}`;
    const text = `${clicks} · ${counted(object.mask_frames, "frame")} `;
    if (!current) return text;
    const drawn = h("span", { class: "chip", title: "the segmenter that drew its masks" }, object.mask_backend);
    return h("span", {}, text, drawn);
  }
  return clicks;
}
