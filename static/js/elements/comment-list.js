/** Comments of a project. Emits "show-comment" Comment, and "comments" Comment[] (open ones) whenever they change. */

import { listComments, listNames, resolveComment } from "../api.js";
import { addComment } from "../changes.js";
import { h, LiveElement, renew } from "../dom.js";
import { Answers } from "../lib/answers.js";
import { ago, counted } from "../lib/format.js";
import { live } from "../live.js";
import { outbox } from "../outbox.js";
import { askForText } from "./ask-dialog.js";
import { say, sayError } from "./toasts.js";

/** @typedef {import("../api-types").Comment} Comment */
/** @typedef {import("../api-types").CommentIn} CommentIn */

export class CommentList extends LiveElement {
  project = "";
  /** @type {Comment[]} */
  #all = [];
  /** People who can be mentioned. @type {string[]} */
  #names = [];
  #answers = new Answers();
  #settled = h("input", { type: "checkbox" });
  #heading = h("h2", {}, "Comments");
  #list = h("ul", { class: "comments" });
  #showSettled = h("label", { class: "row" }, this.#settled, "Show resolved");

  connected() {
    this.replaceChildren(this.#heading, this.#list, this.#showSettled);
    this.#settled.addEventListener("change", () => this.#draw(), { signal: this.signal });
    live.addEventListener("comments", () => this.load(), { signal: this.signal });
    this.load();
    if (this.project) this.#learnNames();
  }

  async load() {
    if (!this.project) return;
    try {
      await this.#answers.take(listComments(this.project), (all) => {
        this.#all = all;
        this.#draw();
        this.emit("comments", this.open);
      });
    } catch (error) {
      sayError(error);
    }
  }

  get open() {
    return this.#all.filter((comment) => comment.resolved_at === null);
  }

  async #learnNames() {
    this.#names = await listNames(this.project).catch(() => this.#names); // comments work without mentions
  }

  /**
   * Ask for a comment's text, then store it at a pin. The box opens before the key or click returns: what is typed next must
   * not run as shortcuts.
   * @param {Partial<CommentIn>} pin
   * @param {string} about
   * @param {Promise<CommentIn["view"] | null> | null} view of the 3D view, if it is shown
   */
  async ask(pin, about, view = null) {
    const names = this.#names;
    this.#learnNames();
    const label = names.length ? "What should change? @ mentions somebody" : "What should change?";
    const text = await askForText(`Comment on ${about}`, label, { button: "Comment", names });
    if (!text) return;
    try {
      await outbox.send(addComment(this.project, { ...pin, view: await view, text }));
      say("Comment stored", { kind: "good" });
      this.load();
    } catch (error) {
      sayError(error);
    }
  }

  #draw() {
    const shown = this.#settled.checked ? this.#all : this.open;
    this.#heading.textContent = this.open.length ? `${counted(this.open.length, "open comment")}` : "Comments";
    this.#showSettled.hidden = this.open.length === this.#all.length;
    renew(
      this.#list,
      ...(shown.length
        ? shown.map((comment) => this.#item(comment))
        : [h("li", { class: "muted none" }, "No open comments.")]),
    );
  }

  /** @param {Comment} comment */
  #item(comment) {
    const settled = comment.resolved_at !== null;
    const where =
      comment.frame !== null
        ? `frame ${comment.frame}`
        : comment.view
          ? "with a view"
          : comment.point_world
            ? "in the scene"
            : "";
    const show = h(
      "button",
      { type: "button", class: "quiet pick" },
      settled ? h("s", {}, comment.text) : comment.text,
    );
    show.addEventListener("click", () => this.emit("show-comment", comment));
    const settle = h("button", { type: "button", class: "quiet" }, settled ? "Open again" : "Resolve");
    settle.setAttribute("aria-label", `${settle.textContent}: ${comment.text}`);
    settle.addEventListener("click", () =>
      resolveComment(this.project, comment.id, !settled).then(() => this.load(), sayError),
    );
    show.dataset.at = `show:${comment.id}`;
    settle.dataset.at = `settle:${comment.id}`;
    const about = [comment.who, ago(comment.at, Date.now() / 1000), where].filter(Boolean).join(" · ");
    return h("li", {}, show, h("div", { class: "row" }, h("span", { class: "muted grow" }, about), settle));
  }
}
