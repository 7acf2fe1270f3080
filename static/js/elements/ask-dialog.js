/** Dialog with one text field. */

import { h } from "../dom.js";
import { mentionBox } from "./mention-box.js";

/**
 * Ask for a text; resolves to null when cancelled.
 * @param {string} title
 * @param {string} label
 * @param {{
 *   button?: string, notes?: string[], required?: boolean, value?: string, names?: string[],
 *   later?: Promise<{ notes: string[], required: boolean }> | null,
 * }} [options] names: people suggested after @; later: notes to show instead once they are known
 * @returns {Promise<string | null>}
 */
export function askForText(
  title,
  label,
  { button = "OK", notes = [], required = true, value = "", names = [], later = null } = {},
) {
  return new Promise((resolve) => {
    const field = h("textarea", { rows: 3, required, maxLength: 1000, value });
    const list = h("ul");
    /** @param {string[]} lines */
    const note = (lines) => {
      list.hidden = !lines.length;
      list.replaceChildren(...lines.map((line) => h("li", {}, line)));
    };
    note(notes);
    later?.then((now) => (note(now.notes), (field.required = now.required)));
    const dialog = h(
      "dialog",
      { "aria-label": title, class: "ask" },
      h("h2", {}, title),
      list,
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
          h("span", { class: "muted" }, h("kbd", {}, "Ctrl Enter"), ` ${button}`),
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
