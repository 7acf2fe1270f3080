/**
 * Pane with the properties of the leading front and the list of fronts on the plane. Emits "choose" key, "size" {side, metres},
 * "category", "hinge" and "handle" with the new value, "name" {name, seen} with the front as it was when typing began, "divide"
 * {way, text}, "next", "copy" and "adopt".
 */

import { h, renew } from "../dom.js";
import { byOpening, synonyms } from "../lib/categories.js";
import { heightOf, widthOf } from "../lib/elevation.js";
import { usableName } from "../lib/format.js";
import { inOrder } from "../lib/front-rows.js";

/** @typedef {import("../api-types").Category} Category */
/** @typedef {import("../elevation/fronts.js").Front} Front */
/** @typedef {Front & { rect: import("../lib/elevation.js").Rect }} Placed */
/**
 * `cut` is the number of panels without a front.
 * @typedef {{ leading: Placed | null, chosen: Set<string>, cut: number, paint: (front: Front) => string }} How
 */

/** Categories chosen by digit keys. */
const QUICK = ["cabinet", "drawer", "wall_cabinet", "double-door cabinet", "dishwasher", "oven", "refrigerator"];

export class FrontPane extends EventTarget {
  #list = h("ul", { class: "front-list" });
  #name = h("input", { type: "text", spellcheck: false });
  #width = h("input", { type: "number", min: "20", max: "10000", step: "1" });
  #height = h("input", { type: "number", min: "20", max: "10000", step: "1" });
  #across = h("input", { type: "text", inputMode: "numeric", placeholder: "3 or 600 450" });
  #down = h("input", { type: "text", inputMode: "numeric", placeholder: "3 or 140 280" });
  #category = h("select");
  #side = h("span", { class: "muted" }, "Hinge");
  /** Categories that slide along their front; the hinge side is then the side they slide to. @type {Set<string>} */
  #sideways = new Set();
  #hinge = h("select", {}, ...options({ "": "inferred", left: "left", right: "right", top: "top", bottom: "bottom" }));
  #handle = h("select", {}, ...options({ "": "detected", none: "none", drawn: "drawn" }));
  #adopt = h("button", { type: "button", hidden: true, onClick: () => this.#say("adopt") });
  #copy = h("button", { type: "button", hidden: true, onClick: () => this.#say("copy") }, "Copy handle and hinge (C)");
  #fields = h(
    "fieldset",
    { class: "front-fields", disabled: true },
    h("legend", {}, "Front"),
    label("Name", this.#name),
    label("Kind", this.#category),
    label("Width mm", this.#width),
    label("Height mm", this.#height),
    label("Handle", this.#handle),
    h("label", {}, this.#side, this.#hinge),
    label("Divide width", this.#across),
    label("Divide height", this.#down),
  );
  element = h("aside", { class: "fronts", "aria-label": "Fronts" }, this.#fields, this.#copy, this.#adopt, this.#list);
  /** @type {Placed | null} */
  #shown = null;
  /** The front as it was when typing of its name began. @type {Placed | null} */
  #named = null;

  constructor() {
    super();
    this.#width.title = this.#height.title = "The edge chosen with E moves; without one, the less certain edge";
    this.#field(this.#width, () => this.#size(this.#width, "width"));
    this.#field(this.#height, () => this.#size(this.#height, "height"));
    this.#field(this.#name, () => {
      this.#name.value = usableName(this.#name.value);
      if (this.#name.value) this.#say("name", { name: this.#name.value, seen: this.#named });
    });
    this.#name.addEventListener("focus", () => (this.#named = this.#shown && { ...this.#shown }));
    this.#field(this.#across, () => this.#divide(this.#across, "upright"));
    this.#field(this.#down, () => this.#divide(this.#down, "level"));
    this.#category.addEventListener("change", () => this.#say("category", this.#category.value));
    this.#hinge.addEventListener("change", () => this.#say("hinge", this.#hinge.value || null));
    this.#handle.addEventListener(
      "change",
      () => this.#handle.value !== "drawn" && this.#say("handle", this.#handle.value || null),
    );
  }

  /**
   * Wire a text field: Enter accepts, Ctrl+Enter accepts and goes to the next front, Escape reverts.
   * @param {HTMLInputElement} input
   * @param {() => void} take
   */
  #field(input, take) {
    input.addEventListener("change", take);
    input.addEventListener("keydown", ({ key, ctrlKey, metaKey }) => {
      if (key === "Escape") input.value = input.defaultValue;
      if (key !== "Enter" && key !== "Escape") return;
      input.blur();
      if (key === "Enter" && (ctrlKey || metaKey)) {
        this.#say("next");
        this.#type(input);
      }
    });
  }

  /** @param {HTMLInputElement} input @param {"upright" | "level"} way */
  #divide(input, way) {
    const text = input.value.trim();
    input.value = "";
    if (text) this.#say("divide", { way, text });
  }

  /** @param {Category[]} categories */
  setCategories(categories) {
    this.#sideways = new Set(categories.filter(({ sideways }) => sideways).map(({ name }) => name));
    const option = (/** @type {{ name: string, label: string }} */ { name, label }) =>
      h("option", { value: name }, label);
    this.#category.replaceChildren(
      ...QUICK.map((name, k) => h("option", { value: name }, `${k + 1}  ${name}`)),
      ...byOpening(categories).map(({ text, of }) =>
        h("optgroup", { label: text }, ...of.filter(({ name }) => !QUICK.includes(name)).map(option)),
      ),
      h("optgroup", { label: "other names" }, ...synonyms(categories).map(option)),
    );
  }

  /** Whether a category slides along its front. @param {string} category */
  slides(category) {
    return this.#sideways.has(category);
  }

  /** @param {number} digit */
  pickCategory(digit) {
    const name = QUICK[digit - 1];
    if (name && this.#shown) this.#say("category", name);
  }

  /** Focus a field for typing. @param {"name" | "width" | "height" | "across" | "down"} what */
  type(what) {
    if (!this.#fields.disabled)
      this.#type(
        { name: this.#name, width: this.#width, height: this.#height, across: this.#across, down: this.#down }[what],
      );
  }

  /** @param {HTMLInputElement} input */
  #type(input) {
    input.focus();
    input.select();
  }

  /** @param {Placed[]} fronts @param {How} how */
  show(fronts, { leading, chosen, cut, paint }) {
    this.#shown = leading;
    this.#fields.disabled = leading === null;
    const set = (/** @type {HTMLInputElement | HTMLSelectElement} */ field, /** @type {string} */ value) => {
      if (field instanceof HTMLInputElement) field.defaultValue = value;
      if (document.activeElement !== field) field.value = value;
    };
    if (leading && ![...this.#category.options].some(({ value }) => value === leading.category))
      this.#category.append(h("option", { value: leading.category }, leading.category));
    set(this.#name, leading?.name ?? "");
    set(this.#category, leading?.category ?? "");
    set(this.#width, leading ? String(Math.round(1000 * widthOf(leading.rect))) : "");
    set(this.#height, leading ? String(Math.round(1000 * heightOf(leading.rect))) : "");
    this.#side.textContent = this.slides(leading?.category ?? "") ? "Slides to" : "Hinge";
    set(this.#hinge, leading?.hinge ?? "");
    set(this.#handle, leading?.handle === "none" ? "none" : leading?.handle && leading.drawn ? "drawn" : "");
    this.#copy.hidden = !leading || chosen.size < 2;
    this.#copy.title = `Copy those of ${leading?.name} to the other chosen fronts`;
    this.#adopt.hidden = cut === 0;
    this.#adopt.textContent = cut === 1 ? "Take the cut panel (A)" : `Take ${cut} cut panels (A)`;
    renew(this.#list, ...inOrder(fronts).map((front) => this.#row(front, chosen.has(front.key), paint(front))));
  }

  /** @param {Placed} front @param {boolean} chosen @param {string} paint */
  #row(front, chosen, paint) {
    const size = `${Math.round(1000 * widthOf(front.rect))} × ${Math.round(1000 * heightOf(front.rect))}`;
    const button = h(
      "button",
      {
        type: "button",
        "aria-pressed": String(chosen),
        "data-at": `front:${front.key}`,
        onClick: () => this.#say("choose", front.key),
      },
      h("span", { class: "swatch" }),
      h("span", { class: "what" }, front.name),
      h("span", { class: "muted" }, front.drawn ? size : `${size} found`),
    );
    button.style.setProperty("--object", paint);
    return h("li", {}, button);
  }

  /** @param {HTMLInputElement} input @param {"width" | "height"} side */
  #size(input, side) {
    if (input.checkValidity() && input.value) this.#say("size", { side, metres: Number(input.value) / 1000 });
  }

  /** @param {string} type @param {unknown} [detail] */
  #say(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}

/** @param {string} text @param {HTMLElement} field */
function label(text, field) {
  return h("label", {}, h("span", { class: "muted" }, text), field);
}

/** @param {Record<string, string>} texts by value */
function options(texts) {
  return Object.entries(texts).map(([value, text]) => h("option", { value }, text));
}
