/** The left of the page: undo and redo, the next object's category, the objects, what is proposed, the way on. Says "undo", "redo". */

import { h, icon } from "../dom.js";
import { ObjectList } from "../elements/object-list.js";
import { ProposalList } from "../elements/proposal-list.js";

/** @typedef {import("./scene-objects.js").SceneObjects} SceneObjects */

export class ObjectsPane extends EventTarget {
  list = new ObjectList();
  proposals = new ProposalList();
  #category = h("input", {
    type: "text",
    value: "drawer",
    list: "categories",
    "aria-label": "Category of the next object",
  });
  #run = h("a", { class: "button primary" }, "Run…");
  element = h(
    "aside",
    { class: "objects-pane", "aria-label": "Objects" },
    h("div", { class: "heading" }, h("h1", {}, "Objects"), this.#button("undo", "Undo"), this.#button("redo", "Redo")),
    h("label", { class: "next" }, h("span", { class: "muted" }, "Category of the next"), this.#category),
    this.list,
    this.proposals,
    this.#run,
  );

  /** @param {string} id */
  set project(id) {
    this.proposals.project = id;
    this.#run.href = `/p/${id}/run`;
  }

  /** Of the next object. */
  get category() {
    return this.#category.value.trim() || "object";
  }

  set category(name) {
    this.#category.value = name;
  }

  /**
   * @param {SceneObjects} objects
   * @param {(object: number) => import("../lib/contradictions.js").Said[]} contradicted what its masks contradict
   */
  draw(objects, contradicted) {
    this.list.setObjects(objects.sorted, {
      current: objects.current,
      isHidden: (object) => objects.isHidden(object.id),
      colourOf: (object) => objects.colour(object),
      contradicted: (object) => contradicted(object.id),
    });
  }

  /**
   * @param {string} action
   * @param {string} label
   */
  #button(action, label) {
    const button = h("button", { type: "button", class: "quiet", "aria-label": label }, icon(action));
    button.addEventListener("click", () => this.dispatchEvent(new Event(action)));
    return button;
  }
}
