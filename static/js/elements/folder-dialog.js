/** Choose a recording on the server's machine. Emits "choose" with the path. */

import { browse } from "../api.js";
import { h, LiveElement } from "../dom.js";
import { bytes } from "../lib/format.js";
import { sayError } from "./toasts.js";

export class FolderDialog extends LiveElement {
  #dialog = h("dialog", { "aria-labelledby": "folder-title" });
  #path = h("input", {
    type: "text",
    placeholder: "/path/to/scan.r3d or a folder",
    "aria-label": "Path on this machine",
  });
  #list = h("ul", { class: "folder-list" });

  connected() {
    const form = h(
      "form",
      { class: "row", onSubmit: (/** @type {Event} */ event) => this.#submit(event) },
      this.#path,
      h("button", { class: "primary", type: "submit" }, "Import this"),
    );
    const close = h("button", { type: "button", onClick: () => this.#dialog.close() }, "Cancel");
    this.#dialog.replaceChildren(
      h("h1", { id: "folder-title" }, "A recording on this machine"),
      h(
        "p",
        { class: "muted" },
        "A .r3d file, a zip, or the folder of an export. Nothing is copied until you import it.",
      ),
      h("div", { class: "stack" }, form, this.#list, h("div", {}, close)),
    );
    this.replaceChildren(this.#dialog);
  }

  open() {
    this.#dialog.showModal();
    this.#show("");
  }

  /** @param {Event} event */
  #submit(event) {
    event.preventDefault();
    if (!this.#path.value.trim()) return;
    this.#dialog.close();
    this.emit("choose", this.#path.value.trim());
  }

  /** @param {string} path */
  async #show(path) {
    try {
      const listing = await browse(path);
      if (listing.path) this.#path.value = listing.path;
      const up = listing.parent === null ? [] : [{ name: "..", path: listing.parent, folder: true, size: null }];
      this.#list.replaceChildren(
        ...[...up, ...listing.entries].map((entry) => {
          const size = entry.size === null ? "" : bytes(entry.size);
          const text = entry.folder ? `${entry.name}/` : entry.name;
          const button = h("button", { type: "button" }, h("span", {}, text), h("span", { class: "muted" }, size));
          button.addEventListener("click", () => {
            this.#path.value = entry.path;
            if (entry.folder) this.#show(entry.path);
          });
          return h("li", {}, button);
        }),
      );
    } catch (error) {
      sayError(error);
    }
  }
}
