/**
 * The objects of a project. Emits "pick-object" id|null (not "select": fields fire that themselves, and it bubbles),
 * "rename" {id, name, version}, "categorise" {id, category, version}, "delete" id, "toggle" id, "stop" id,
 * "merge" {id, other}.
 */

import { h, icon, LiveElement, renew } from "../dom.js";
import { inkOn } from "../lib/colour.js";
import { matches } from "../lib/filter.js";
import { counted, usableName } from "../lib/format.js";

/** @typedef {import("../api-types").SceneObject} SceneObject */
/** @typedef {import("../lib/contradictions.js").Said} Said */
/** @typedef {{ current: number | null, isHidden: (object: SceneObject) => boolean, colourOf: (object: SceneObject) => string, contradicted: (object: SceneObject) => Said[] }} View */

const MANY = 9; // objects, from which they are searched through

export class ObjectList extends LiveElement {
  #list = h("ul", { class: "object-list" });
  #categories = h("datalist", { id: "categories" });
  #new = h("button", { type: "button", class: "primary" }, icon("plus"), "New object");
  #search = h("input", { type: "search", placeholder: "Name or category", "aria-label": "Find objects" });
  #found = h("span", { class: "muted", role: "status" });
  #find = h("div", { class: "find", hidden: true }, this.#search, this.#found);
  /** What is drawn again when something else is searched for. */
  #again = () => {};
  #drawn = "";
  /** @type {number | null} whose line was brought into sight */
  #shown = null;
  /** @type {(() => void) | null} what to draw once the person has finished typing */
  #waiting = null;

  connected() {
    this.replaceChildren(h("div", { class: "list-head" }, this.#new, this.#find), this.#list, this.#categories);
    const search = () => {
      this.#again();
      this.parentElement?.scrollTo(0, 0); // to what was found
    };
    this.#search.addEventListener("input", search, { signal: this.signal });
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
   * @param {View} view
   */
  setObjects(objects, view) {
    const { current, isHidden } = view;
    this.#waiting = null;
    if (this.#isTyping(current)) {
      this.#waiting = () => this.setObjects(objects, view);
      return;
    }
    this.#again = () => this.setObjects(objects, view);
    this.#new.setAttribute("aria-pressed", String(current === null));
    const typed = this.#search.value.trim();
    const state = JSON.stringify([typed, objects, current, objects.map(isHidden), objects.map(view.contradicted)]);
    if (state === this.#drawn) return;
    this.#drawn = state;
    const none = h("li", { class: "muted none" }, "Click a drawer, a door or a thing in the picture.");
    const found = objects.flatMap((object, k) => {
      const shown = object.id === current || matches(typed, [object.name, object.category]);
      return shown ? [this.#item(object, k + 1, view)] : [];
    });
    this.#find.hidden = objects.length < MANY && !typed;
    this.#found.textContent = `${found.length} of ${objects.length}`;
    renew(this.#list, ...(objects.length ? found : [none]));
    if (this.#shown !== current) this.#list.querySelector(".current")?.scrollIntoView({ block: "nearest" });
    this.#shown = current;
  }

  /**
   * Whether a field of the current object is being typed in: masks that stream in must not take it away.
   * @param {number | null} current
   */
  #isTyping(current) {
    const field = document.activeElement;
    return field instanceof HTMLInputElement && this.#list.contains(field) && field.dataset.at?.endsWith(`:${current}`);
  }

  /**
   * @param {SceneObject} object
   * @param {number} number
   * @param {View} view
   */
  #item(object, number, { current: chosen, isHidden, colourOf, contradicted }) {
    const { id, name } = object;
    const [current, hidden] = [id === chosen, isHidden(object)];
    const pick = h("button", { class: "pick", "aria-pressed": String(current), title: name }, name);
    const eye = h("button", { class: "quiet", "aria-label": `${hidden ? "Show" : "Hide"} ${name}` });
    eye.append(icon(hidden ? "eye-off" : "eye"));
    const remove = h("button", { class: "quiet danger", "aria-label": `Delete ${name}` }, icon("trash"));
    for (const [button, type] of /** @type {const} */ ([
      [pick, "pick-object"],
      [eye, "toggle"],
      [remove, "delete"],
    ])) {
      button.type = "button";
      button.dataset.at = `${type}:${id}`;
      button.addEventListener("click", () => this.emit(type, id));
    }
    const badge = h("span", { class: "badge" }, String(number));
    badge.style.color = inkOn(colourOf(object));
    const item = h(
      "li",
      { class: current ? "current" : "" },
      h("div", { class: "head" }, badge, pick, eye, remove),
      h("div", { class: "row muted state" }, state(object, current), this.#stop(object)),
      current ? this.#fields(object) : null,
      ...[...contradicted(object), ...object.doubts.map((text) => ({ object: id, text }))].map((said) =>
        h("div", { class: "contradicted", role: "status" }, said.text, this.#merge(said, name)),
      ),
      ...object.notices.map((notice) => h("div", { class: "muted" }, notice)),
    );
    item.style.setProperty("--swatch", colourOf(object));
    return item;
  }

  /** @param {Said} said @param {string} name */
  #merge({ object, mergesWith }, name) {
    if (!mergesWith) return null;
    const other = mergesWith.object;
    const text = `Merge with ${mergesWith.name}`;
    const merge = h("button", { type: "button", class: "merge", "aria-label": `${text}: ${name}` }, text);
    merge.dataset.at = `merge:${object}:${other}`;
    merge.addEventListener("click", () => this.emit("merge", { id: object, other }));
    return merge;
  }

  /** @param {SceneObject} object */
  #stop(object) {
    if (object.segment !== "running" && object.segment !== "waiting") return null;
    const stop = h("button", { type: "button", class: "quiet", "aria-label": `Stop finding ${object.name}` }, "Stop");
    stop.dataset.at = `stop:${object.id}`;
    stop.addEventListener("click", () => this.emit("stop", object.id));
    return stop;
  }

  /** @param {SceneObject} object */
  #fields(object) {
    /** @type {(field: string, label: string, value: string, props?: Record<string, string>) => HTMLElement} */
    const field = (name, label, value, props = {}) => {
      const input = h("input", { type: "text", value, "aria-label": `${label} of ${object.name}`, ...props });
      input.dataset.at = `${name}:${object.id}`;
      input.addEventListener("change", () => {
        input.value = name === "name" ? usableName(input.value) : input.value.trim();
        if (!input.value || input.value === value) return;
        const type = name === "name" ? "rename" : "categorise";
        this.emit(type, { id: object.id, [name]: input.value, version: object.version });
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
  if (!object.points.length && !object.front) return "no click yet";
  const clicks = object.front ? "drawn" : counted(object.points.length, "click");
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
