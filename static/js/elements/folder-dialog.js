/**
 * Dialog to import a recording from the server's machine. A refused path stays in the field, with the reason.
 * Emits "imported" with the project.
 */

import { ApiError, browse, importPath } from "../api.js";
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
  #refusal = h("p", { role: "alert", class: "failure", hidden: true });
  #import = h("button", { class: "primary", type: "submit" }, "Import this");
  #list = h("ul", { class: "folder-list" });

  connected() {
    const form = h(
      "form",
      { class: "path", onSubmit: (/** @type {Event} */ event) => this.#submit(event) },
      this.#path,
      this.#import,
    );
    const close = h("button", { type: "button", onClick: () => this.#dialog.close() }, "Cancel");
    this.#dialog.replaceChildren(
      h("h1", { id: "folder-title" }, "A recording on this machine"),
      h(
        "p",
        { class: "muted" },
        "A .r3d file, a zip, or the folder of an export. Nothing is copied until you import it.",
      ),
      h("div", { class: "stack" }, form, this.#refusal, this.#list, h("div", {}, close)),
    );
    this.replaceChildren(this.#dialog);
  }

  open() {
    this.#refuse(null);
    this.#dialog.showModal();
    this.#show("");
  }

  /** @param {Event} event */
  async #submit(event) {
    event.preventDefault();
    const path = this.#path.value.trim();
    if (!path) return;
    this.#import.disabled = true;
    try {
      const project = await importPath(path);
      this.#dialog.close();
      this.emit("imported", project);
    } catch (error) {
      this.#refuse(error);
    } finally {
      this.#import.disabled = false;
    }
  }

  /** @param {unknown} error why the path cannot be imported; null clears the message */
  #refuse(error) {
    this.#refusal.hidden = error === null;
    const hint = error instanceof ApiError ? error.hint : "";
    this.#refusal.replaceChildren(
      h("strong", {}, error instanceof Error ? error.message : ""),
      h("span", {}, hint && ` ${hint}`),
    );
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
