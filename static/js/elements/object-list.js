/**
 * List of a project's objects. Emits "pick-object" id|null (null: a new one), "choose-several" ids, "find-alike" id,
 * "rename" {seen, name}, "categorise" {seen, category} with the object as the user saw it, "rename-all" {ids, name},
 * "categorise-all" {ids, category}, "assign" {ids, name}, "hide" ids, "lock" ids, "delete" ids, "stop" id,
 * "merge" {id, other}. A row is rebuilt only when its content changes, and painted once it is visible.
 */

import { h, icon, LiveElement, renew, reveal } from "../dom.js";
import { usedFirst } from "../lib/categories.js";
import { inkOn } from "../lib/colour.js";
import { counted, usableName } from "../lib/format.js";
import { isComing, listed, OF_PEOPLE, ORDERS, span, STATES } from "../lib/listing.js";
import { SelectionBar } from "./selection-bar.js";

/** @typedef {import("../api-types").SceneObject} SceneObject */
/** @typedef {import("../lib/contradictions.js").Said} Said */
/** @typedef {import("../lib/listing.js").Entry<SceneObject> & { colour: string, said: Said[], selected: boolean }} Listed */
/** @typedef {Listed & { notices: string[] }} Entry */

const MANY = 9; // objects from which the search is shown

export class ObjectList extends LiveElement {
  new = h("button", { type: "button", class: "primary" }, icon("plus"), "New object");
  #list = h("ul", { class: "object-list" });
  #categories = h("datalist", { id: "categories" });
  /** @type {import("../api-types").Category[]} */
  #known = [];
  #offered = "";
  #search = h("input", { type: "search", placeholder: "Name or category", "aria-label": "Find objects" });
  #found = h("span", { class: "muted", role: "status" });
  #order = options("Order of the objects", ORDERS);
  #state = options("Which objects", STATES);
  #find = h("div", { class: "find", hidden: true }, this.#search, this.#found, this.#order, this.#state);
  #bar = new SelectionBar();
  /** Sticky header above the list. */
  head = h("div", { class: "list-head" }, this.#find, this.#bar.element);
  /** @type {Entry[]} */
  #entries = [];
  /** @type {Map<string, { said: string, line: HTMLElement }>} rows by key, each with its serialised content */
  #lines = new Map();
  /** @type {string[]} possible assignees; empty when there are no accounts */
  #names = [];
  /** @type {number | null} object whose row was last scrolled into view */
  #shown = null;
  /** @type {number | null} object selected last: Shift selects the range from there */
  #from = null;
  /** Whether a redraw is deferred until the user has finished typing. */
  #waiting = false;

  connected() {
    const { signal } = this;
    this.replaceChildren(this.#list, this.#categories);
    const again = () => {
      this.#draw();
      this.parentElement?.scrollTo(0, 0); // to the first result
    };
    for (const field of [this.#search, this.#order, this.#state]) field.addEventListener("input", again, { signal });
    this.new.addEventListener("click", () => this.emit("pick-object", null), { signal });
    this.addEventListener("focusout", () => setTimeout(() => this.#waiting && this.#draw()), { signal });
    this.addEventListener("focusin", () => this.#rove(), { signal });
    this.addEventListener("keydown", (event) => this.#onKey(event), { signal });
    this.#bar.tell = (type, detail) => this.emit(type, detail);
  }

  /** @param {import("../api-types").Category[]} categories */
  setCategories(categories) {
    this.#known = categories;
    this.#offer();
  }

  /** Fill the category suggestions, those in use first. */
  #offer() {
    const used = this.#entries.map(({ object }) => object.category);
    const names = usedFirst(this.#known, used);
    const now = names.map(({ name }) => name).join();
    if (now === this.#offered) return;
    this.#offered = now;
    this.#categories.replaceChildren(...names.map(({ name, label }) => h("option", { value: name }, label)));
  }

  /** Set the possible assignees. @param {string[]} names */
  setNames(names) {
    this.#names = names;
    this.#bar.names = names;
    for (const option of this.#state.options)
      if (OF_PEOPLE.includes(option.value)) option.hidden = option.disabled = !names.length;
    this.#lines.clear(); // every row lists the assignees
    this.#draw();
  }

  /** @param {Listed[]} entries in order of creation */
  setObjects(entries) {
    this.#entries = toldOnce(entries);
    this.#offer();
    this.#draw();
  }

  #draw() {
    const entries = this.#entries;
    const current = entries.find((entry) => entry.current)?.object.id ?? null;
    this.#waiting = this.#isTyping(current);
    if (this.#waiting) return;
    this.new.setAttribute("aria-pressed", String(current === null));
    const groups = this.#groups;
    const lines = new Map(
      groups.flatMap(({ heading, entries: of }) => [
        ...(heading ? [this.#line(`group:${heading}`, of.length, () => groupHeading(heading, of.length))] : []),
        ...of.map((entry) => this.#line(String(entry.object.id), entry, () => this.#item(entry))),
      ]),
    );
    this.#lines = lines;
    const none = h("li", { class: "muted none" }, "Click a drawer, a door or a thing in the picture.");
    const drawn = entries.length ? [...lines.values()].map(({ line }) => line) : [none];
    if (drawn.some((line, k) => line !== this.#list.children[k]) || drawn.length !== this.#list.childElementCount)
      renew(this.#list, ...drawn);
    this.#find.hidden = entries.length < MANY && !this.#search.value;
    this.#found.textContent = `${this.#ids.length} of ${entries.length}`;
    this.#bar.show(entries.filter(({ selected }) => selected));
    this.#rove();
    if (this.#shown !== current) reveal(this.#list.querySelector(".current"));
    this.#shown = current;
  }

  /**
   * Entry of the row cache: the existing row if its content is unchanged, else a new one.
   * @param {string} key
   * @param {unknown} says content of the row
   * @param {() => HTMLElement} made
   * @returns {[string, { said: string, line: HTMLElement }]}
   */
  #line(key, says, made) {
    const said = JSON.stringify(says);
    const there = this.#lines.get(key);
    return [key, there?.said === said ? there : { said, line: made() }];
  }

  get #groups() {
    const [state, order] = [this.#state.value, this.#order.value];
    return /** @type {{ heading: string, entries: Entry[] }[]} */ (
      listed(this.#entries, {
        typed: this.#search.value.trim(),
        state: /** @type {import("../lib/listing.js").State} */ (state),
        order: /** @type {import("../lib/listing.js").Order} */ (order),
      })
    );
  }

  /** Ids of the objects shown, from top to bottom. */
  get #ids() {
    return this.#groups.flatMap(({ entries }) => entries.map(({ object }) => object.id));
  }

  /** Roving tab stop: the focused row, else the current one, else the first; arrow keys reach the others. */
  #rove() {
    const lines = /** @type {HTMLElement[]} */ ([...this.#list.children]).filter((line) => line.querySelector(".pick"));
    const stop =
      lines.find((line) => line.matches(":focus-within")) ?? lines.find((line) => line.matches(".current")) ?? lines[0];
    for (const line of lines)
      for (const button of line.querySelectorAll("button")) button.tabIndex = line === stop ? 0 : -1;
  }

  /** @param {KeyboardEvent} event */
  #onKey(event) {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    const at = event.target;
    if (!step || !(at instanceof HTMLButtonElement) || !at.matches(":focus-visible")) return;
    event.preventDefault();
    event.stopPropagation();
    const what = at.dataset.at?.split(":")[0];
    const alike = /** @type {HTMLElement[]} */ ([...this.#list.querySelectorAll(`[data-at^="${what}:"]`)]);
    alike[alike.indexOf(at) + step]?.focus();
  }

  /**
   * Whether the user is typing in a field of the current object; a redraw for incoming masks must not remove it.
   * @param {number | null} current
   */
  #isTyping(current) {
    const field = document.activeElement;
    return (
      field instanceof HTMLInputElement &&
      this.#list.contains(field) &&
      field.dataset.at?.split(":")[1] === String(current)
    );
  }

  /** Toggle an object; with Shift, select the range from the last. @param {number} id @param {{ shiftKey: boolean }} held */
  #select(id, { shiftKey }) {
    const selected = this.#entries.flatMap(({ object, selected }) => (selected ? [object.id] : []));
    const more = shiftKey ? span(this.#ids, this.#from, id) : [id];
    const fewer = !shiftKey && selected.includes(id);
    this.#from = id;
    this.emit("choose-several", fewer ? selected.filter((one) => one !== id) : [...selected, ...more]);
  }

  /** @param {Entry} entry */
  #item(entry) {
    const { object, number, colour, current, selected, hidden, locked, said, notices } = entry;
    const { id, name } = object;
    const badge = button("select", `Select ${number}, ${name}`, id, String(number));
    badge.classList.add("badge");
    badge.style.color = inkOn(colour);
    badge.setAttribute("aria-pressed", String(selected));
    badge.addEventListener("click", (event) => this.#select(id, event));
    const pick = h("button", { type: "button", class: "pick", "aria-pressed": String(current), title: name }, name);
    pick.dataset.at = `pick-object:${id}`;
    pick.addEventListener("click", (event) =>
      event.ctrlKey || event.metaKey || event.shiftKey ? this.#select(id, event) : this.emit("pick-object", id),
    );
    const lock = button("lock", `${locked ? "Unlock" : "Lock"} ${name}`, id, icon(locked ? "lock" : "unlock"));
    if (locked) lock.title = `Locked by ${object.locked_by}; unlock it to change it`;
    const eye = button("hide", `${hidden ? "Show" : "Hide"} ${name}`, id, icon(hidden ? "eye-off" : "eye"));
    const remove = button("delete", `Delete ${name}`, id, icon("trash"));
    remove.classList.add("danger");
    for (const [one, type] of /** @type {const} */ ([
      [lock, "lock"],
      [eye, "hide"],
      [remove, "delete"],
    ]))
      one.addEventListener("click", () => this.emit(type, [id]));
    const item = h(
      "li",
      {
        class: Object.entries({ current, selected, locked })
          .flatMap(([name, is]) => (is ? [name] : []))
          .join(" "),
      },
      h("div", { class: "head" }, badge, pick, lock, eye, remove),
      h("div", { class: "row muted state" }, state(entry), this.#stop(object), assigned(object)),
      current && !locked ? this.#fields(object) : null,
      ...said.map((one) => h("div", { class: "contradicted", role: "status" }, one.text, this.#merge(one, name))),
      ...object.doubts.map((text) => h("div", { class: "contradicted doubt", role: "status", title: text }, text)),
      locked ? null : this.#recategorise(object),
      ...notices.map((notice) => h("div", { class: "muted" }, notice)),
    );
    item.style.setProperty("--swatch", colour);
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

  /** Button for the category that the object's size suggests. @param {SceneObject} object */
  #recategorise(object) {
    const { id, name, category, suggested } = object;
    if (!suggested || suggested === category) return null;
    const text = `Make it ${withArticle(suggested.replaceAll("_", " "))}`;
    const change = h("button", { type: "button", class: "merge", "aria-label": `${text}: ${name}` }, text);
    change.dataset.at = `recategorise:${id}`;
    change.addEventListener("click", () => this.emit("categorise", { seen: object, category: suggested }));
    return change;
  }

  /** @param {SceneObject} object */
  #stop(object) {
    if (!isComing(object)) return null;
    const stop = button("stop", `Stop finding ${object.name}`, object.id, "Stop");
    stop.addEventListener("click", () => this.emit("stop", object.id));
    return stop;
  }

  /** @param {SceneObject} object */
  #fields(object) {
    let seen = object; // as of this row, which is not redrawn while somebody types in it
    /** @type {(field: "name" | "category", label: string, props?: Record<string, string>) => HTMLElement} */
    const field = (name, label, props = {}) => {
      const input = h("input", {
        type: "text",
        value: seen[name],
        "aria-label": `${label} of ${object.name}`,
        ...props,
      });
      input.dataset.at = `${name}:${object.id}`;
      input.addEventListener("change", () => {
        input.value = name === "name" ? usableName(input.value) : input.value.trim();
        input.value ||= seen[name]; // nothing typed can be part of a name
        if (input.value === seen[name]) return;
        const type = name === "name" ? "rename" : "categorise";
        this.emit(type, { seen, [name]: input.value });
        seen = { ...seen, [name]: input.value };
      });
      input.addEventListener("keydown", (event) => {
        if (event.key === "Enter") input.blur();
        if (event.key === "Escape") input.value = seen[name];
      });
      return h("label", {}, h("span", { class: "muted" }, label), input);
    };
    const find = h("button", { type: "button", class: "quiet" }, "Find the ones like this");
    find.dataset.at = `alike:${object.id}`;
    find.addEventListener("click", () => this.emit("find-alike", object.id));
    return h(
      "div",
      { class: "fields" },
      field("category", "Category", { list: "categories" }),
      field("name", "Name"),
      this.#assigning(object),
      find,
    );
  }

  /** @param {SceneObject} object */
  #assigning({ id, name, assignee }) {
    if (!this.#names.length) return null;
    const names = new Set([...this.#names, ...(assignee ? [assignee] : [])]);
    const choice = h(
      "select",
      { "aria-label": `${name} is assigned to` },
      h("option", { value: "" }, "nobody"),
      ...[...names].map((one) => h("option", { value: one }, one)),
    );
    choice.value = assignee ?? "";
    choice.dataset.at = `assign:${id}`;
    choice.addEventListener("change", () => this.emit("assign", { ids: [id], name: choice.value || null }));
    return h("label", {}, h("span", { class: "muted" }, "Assigned to"), choice);
  }
}

/**
 * Entries with their notices: all of them on the current object; a notice shared by several others is listed once.
 * @param {Listed[]} entries
 * @returns {Entry[]}
 */
function toldOnce(entries) {
  const told = new Set();
  return entries.map((entry) => {
    const notices = entry.object.notices.filter((notice) => entry.current || !told.has(notice));
    for (const notice of entry.object.notices) told.add(notice);
    return { ...entry, notices };
  });
}

/** @param {string} heading @param {number} count */
function groupHeading(heading, count) {
  return h("li", { class: "group" }, h("h2", {}, heading, h("span", { class: "muted" }, ` ${count}`)));
}

/** Button in an object's row. @param {string} what @param {string} label @param {number} id @param {Node | string} shown */
function button(what, label, id, shown) {
  const made = h("button", { type: "button", class: "quiet", "aria-label": label, title: label }, shown);
  made.dataset.at = `${what}:${id}`;
  return made;
}

/** @param {string} label @param {Record<string, string>} texts by value */
function options(label, texts) {
  return h(
    "select",
    { "aria-label": label },
    ...Object.entries(texts).map(([value, text]) => h("option", { value }, text)),
  );
}

/** @param {SceneObject} object */
function assigned({ assignee }) {
  return assignee ? h("span", { class: "chip", title: "assigned to" }, `@${assignee}`) : null;
}

/** State of an object's masks; `.detail` is shown in the current object's row only. @param {Entry} entry */
function state({ object, current, sure }) {
  if (!object.points.length && !object.front) return "no click yet";
  const clicks = object.front ? "drawn" : counted(object.points.length, "click");
  const frames = counted(object.mask_frames, "frame");
  /** @type {(detail: string, ...told: (Node | string | null)[]) => HTMLElement} */
  const line = (detail, ...told) =>
    h("span", { title: `${detail}${told[0]}` }, h("span", { class: "detail" }, detail), ...told);
  if (isComing(object)) return line(`${clicks} · `, "finding it in all frames…");
  if (object.segment === "failed") return h("span", { class: "chip bad" }, "no mask");
  if (!object.mask_frames) return line("", clicks);
  if (object.segment === "partial") return line(`${clicks} · `, `stopped after ${frames}`);
  const drawn = h("span", { class: "chip", title: "the segmenter that drew its masks" }, object.mask_backend);
  if (sure === null) return line(`${clicks} · `, frames, " ", current ? drawn : null);
  const share = Math.round(100 * (object.certainty ?? sure));
  const of = object.certainty === null ? "masks" : "edges";
  return line(`${clicks} · ${frames} · ${of} `, `${share} %`, " ", current ? drawn : null);
}

/** @param {string} noun */
const withArticle = (noun) => `${/^[aeiou]/.test(noun) ? "an" : "a"} ${noun}`;
