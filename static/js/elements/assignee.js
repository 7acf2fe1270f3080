/** Assignee of a project, with a menu to change it; hidden when there are no accounts. */

import { assignProject, listNames } from "../api.js";
import { h, LiveElement } from "../dom.js";
import { say, sayError } from "./toasts.js";

export class Assignee extends LiveElement {
  project = "";
  /** @type {string | null} */
  #name = null;
  /** @type {string[]} */
  #names = [];
  #choice = h("select");

  connected() {
    this.hidden = !this.#names.length;
    this.replaceChildren(h("label", { class: "row" }, "Assigned to", this.#choice));
    this.#choice.addEventListener("change", () => this.#assign(this.#choice.value || null), { signal: this.signal });
    listNames(this.project).then((names) => {
      this.#names = names;
      this.#draw();
    }, sayError);
  }

  /** @param {string | null} name */
  set name(name) {
    this.#name = name;
    this.#draw();
  }

  #draw() {
    this.hidden = !this.#names.length;
    const names = new Set([...this.#names, ...(this.#name ? [this.#name] : [])]);
    this.#choice.replaceChildren(
      h("option", { value: "" }, "nobody"),
      ...[...names].map((name) => h("option", { value: name }, name)),
    );
    this.#choice.value = this.#name ?? "";
  }

  /** @param {string | null} name */
  async #assign(name) {
    try {
      this.name = (await assignProject(this.project, name)).assignee;
      say(name ? `Assigned to ${name}: it is in their inbox` : "Assigned to nobody", { kind: "good" });
    } catch (error) {
      sayError(error);
      this.#draw();
    }
  }
}
