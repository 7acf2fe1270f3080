/**
 * Right panel: depth of the frame, shape of the object so far, comments. Collapsible on a narrow screen, always visible on a
 * wide one. Emits "mosaic", "comment", "crop" and "uncrop" when their buttons are clicked, "open" when it opens or closes.
 */

import { h } from "../dom.js";
import { CommentList } from "../elements/comment-list.js";
import { ObjectCloud } from "../elements/object-cloud.js";

export class EvidencePane extends EventTarget {
  comments = new CommentList();
  cloud = new ObjectCloud();
  #crop = this.#button("crop", "Crop box");
  #uncrop = this.#button("uncrop", "Remove box");
  #depth = h("img", { class: "depth", alt: "Depth of this frame: red is near, blue is far" });
  element = h(
    "aside",
    { class: "evidence", "aria-label": "Depth, shape and comments" },
    h("button", { type: "button", class: "narrow-only", onClick: () => (this.open = false) }, "Close"),
    h("h2", {}, "Depth"),
    this.#depth,
    h("h2", {}, "Shape so far"),
    this.cloud,
    h("div", { class: "row" }, this.#crop, this.#uncrop),
    h("div", { class: "row" }, this.#button("mosaic", "On many frames"), this.#button("comment", "Pin a comment")),
    this.comments,
  );

  /** @param {string} id */
  set project(id) {
    this.comments.project = this.cloud.project = id;
  }

  get open() {
    return this.element.classList.contains("open");
  }

  set open(on) {
    this.element.classList.toggle("open", on);
    this.dispatchEvent(new Event("open"));
  }

  /** @param {boolean} used whether the crop box is being set @param {boolean} there whether the object has one */
  showCrop(used, there) {
    this.#crop.textContent = used ? "Done" : "Crop box";
    this.#crop.setAttribute("aria-pressed", String(used));
    this.#uncrop.hidden = !there;
  }

  /** @param {string} url */
  showDepth(url) {
    this.#depth.src = url;
  }

  /**
   * @param {string} action
   * @param {string} text
   */
  #button(action, text) {
    return h("button", { type: "button", onClick: () => this.dispatchEvent(new Event(action)) }, text);
  }
}
