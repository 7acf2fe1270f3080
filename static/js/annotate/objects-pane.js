/**
 * Left panel: undo and redo, the next object, the checklist, the objects, the proposals, a link to the next step.
 * Emits "undo" and "redo".
 */

import { meanOf } from "../lib/listing.js";

import { h, icon } from "../dom.js";
import { Checklist } from "./checklist.js";
import { ObjectList } from "../elements/object-list.js";
import { ProposalList } from "../elements/proposal-list.js";

/** @typedef {import("./scene-objects.js").SceneObjects} SceneObjects */

export class ObjectsPane extends EventTarget {
  /** Name of the signed-in user, where people have accounts. @type {string | undefined} */
  me;
  list = new ObjectList();
  proposals = new ProposalList();
  checklist = new Checklist();
  #run = h("a", { class: "button" }, "Run…");
  element = h(
    "aside",
    { class: "objects-pane", "aria-label": "Objects" },
    h("div", { class: "heading" }, h("h1", {}, "Objects"), this.#button("undo", "Undo"), this.#button("redo", "Redo")),
    h("div", { class: "next" }, this.list.new, ...this.checklist.fields),
    this.list.head,
    h("div", { class: "scrolled" }, this.checklist.element, this.list, this.proposals, this.#run),
  );

  /** @param {string} id */
  set project(id) {
    this.proposals.project = id;
    this.#run.href = `/p/${id}/run`;
  }

  /** Category and name of the object that these clicks create. @param {import("../api-types").PointIn[]} points */
  next(points) {
    return this.checklist.next(this.proposals.at(points)?.category);
  }

  /**
   * @param {SceneObjects} objects
   * @param {import("./masks.js").Masks} masks
   * @param {(object: number) => import("../lib/contradictions.js").Said[]} contradicted contradictions of an object's masks
   */
  draw(objects, masks, contradicted) {
    const { current } = objects;
    this.#run.classList.toggle("primary", objects.size > 0); // without objects, New object is what comes next
    this.checklist.objects = objects.sorted;
    this.list.setObjects(
      objects.sorted.map((object, k) => ({
        object,
        number: k + 1,
        colour: objects.colour(object),
        sure: meanOf(masks.lane(object.id)),
        said: contradicted(object.id),
        current: object.id === current,
        selected: objects.isSelected(object.id),
        hidden: objects.isHidden(object.id),
        locked: object.locked_by !== null,
        mine: object.assignee === this.me,
      })),
    );
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
