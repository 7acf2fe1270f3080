/** Trash for admins: deleted projects, to restore or delete permanently. Emits "trash" after each load. */

import { deleteForGood, listTrash, restoreProject } from "../api.js";
import { h, LiveElement, renew } from "../dom.js";
import { Answers } from "../lib/answers.js";
import { ago, bytes, counted } from "../lib/format.js";
import { live } from "../live.js";
import { say, sayError } from "./toasts.js";

/** @typedef {import("../api-types").Trashed} Trashed */

export class TrashList extends LiveElement {
  #answers = new Answers();
  #list = h("ul", { class: "trash-list", "aria-label": "Trash" });
  /** Number of projects in the trash. */
  size = 0;

  connected() {
    this.hidden = true;
    this.replaceChildren(this.#list);
  }

  /** Load the list and keep it up to date. */
  open() {
    live.addEventListener("projects", () => this.#load(), { signal: this.signal });
    this.#load();
  }

  async #load() {
    try {
      await this.#answers.take(listTrash(this.signal), (found) => this.#show(found));
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {Trashed[]} found */
  #show(found) {
    this.size = found.length;
    const none = h("li", { class: "muted none" }, "The trash is empty.");
    renew(this.#list, ...(found.length ? found.map((one) => this.#item(one)) : [none]));
    this.emit("trash");
  }

  /** @param {Trashed} project */
  #item({ id, name, at, who, size_bytes, counts }) {
    const about = [
      `deleted by ${who} ${ago(at, Date.now() / 1000)}`,
      counted(counts.objects, "object"),
      counted(counts.points, "click"),
      bytes(size_bytes),
    ];
    /** @type {(text: string, quiet: string, act: () => Promise<unknown>) => HTMLElement} */
    const button = (text, quiet, act) => {
      const made = h("button", { type: "button", class: quiet, "aria-label": `${text}: ${name}` }, text);
      made.dataset.at = `${text}:${id}`;
      made.addEventListener("click", () => act().catch(sayError));
      return made;
    };
    return h(
      "li",
      {},
      h("div", { class: "grow" }, h("strong", {}, name), h("div", { class: "muted" }, about.join(" · "))),
      button("Restore", "", async () => (await restoreProject(id), say(`${name} is back`, { kind: "good" }))),
      button("Delete for good", "danger", () => this.#delete(id, name)),
    );
  }

  /** @param {string} id @param {string} name */
  async #delete(id, name) {
    if (!confirm(`Delete “${name}” with its recording, clicks and bundles for good? This cannot be undone.`)) return;
    const { freed_bytes } = await deleteForGood(id);
    say(`Deleted ${name}: ${bytes(freed_bytes)} freed`);
  }
}
