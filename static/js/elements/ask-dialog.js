/** Dialog with one text field. */

import { h } from "../dom.js";
import { mentionBox } from "./mention-box.js";

/**
 * Ask for a text; resolves to null when cancelled.
 * @param {string} title
 * @param {string} label
 * @param {{ button?: string, notes?: string[], required?: boolean, value?: string, names?: string[] }} [options]
 *   names: people suggested after @
 * @returns {Promise<string | null>}
 */
export function askForText(title, label, { button = "OK", notes = [], required = true, value = "", names = [] } = {}) {
  return new Promise((resolve) => {
    const field = h("textarea", { rows: 3, required, maxLength: 1000, value });
    const dialog = h(
      "dialog",
      { "aria-label": title, class: "ask" },
      h("h2", {}, title),
      notes.length ? h("ul", {}, ...notes.map((note) => h("li", {}, note))) : null,
      h(
        "form",
        { method: "dialog", class: "stack" },
        h("label", {}, label, field),
        names.length ? mentionBox(field, names) : null,
        h(
          "div",
          { class: "row" },
          h("button", { type: "submit", class: "primary", value: "ok" }, button),
          h("button", { type: "submit", value: "", formNoValidate: true }, "Cancel"),
        ),
      ),
    );
    field.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" || !(event.ctrlKey || event.metaKey)) return;
      /** @type {HTMLFormElement} */ (field.form).requestSubmit(dialog.querySelector("button"));
    });
    dialog.addEventListener("close", () => {
      dialog.remove();
      resolve(dialog.returnValue === "ok" ? field.value.trim() : null);
    });
    document.body.append(dialog);
    dialog.showModal();
    field.focus();
  });
}
