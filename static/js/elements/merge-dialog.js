/** Dialog for conflicting edits: both values of each field are shown, and one is chosen. */

import { h } from "../dom.js";

/** @typedef {{ name: string, label: string, mine: string, theirs: string }} Disagreement */

/**
 * Ask which value to keep for each field; resolves to null when the other person's values all stay.
 * @param {string} title
 * @param {Disagreement[]} fields
 * @returns {Promise<Set<string> | null>} names of the fields that keep the user's own value
 */
export function askToMerge(title, fields) {
  return new Promise((resolve) => {
    const rows = fields.map((field) => ({ field, mine: radio(field, "mine"), theirs: radio(field, "theirs") }));
    const keep = h("button", { type: "submit", class: "primary", value: "keep" }, "Keep what is chosen");
    const leave = h("button", { type: "submit", value: "" }, "Leave theirs");
    const titles = ["", "Yours", "Theirs, stored now"].map((text) => h("th", { scope: "col" }, text));
    const body = rows.map(({ field, mine, theirs }) =>
      h(
        "tr",
        {},
        h("th", { scope: "row" }, field.label),
        h("td", {}, choice(mine, field.mine)),
        h("td", {}, choice(theirs, field.theirs)),
      ),
    );
    const dialog = h(
      "dialog",
      { "aria-label": title },
      h("h2", {}, title),
      h("p", { class: "muted" }, "Somebody else changed this while you did. Nothing is lost: both are in the history."),
      h(
        "form",
        { method: "dialog", class: "stack" },
        h("table", {}, h("thead", {}, h("tr", {}, ...titles)), h("tbody", {}, ...body)),
        h("div", { class: "row" }, keep, leave),
      ),
    );
    dialog.addEventListener("close", () => {
      dialog.remove();
      const kept = rows.filter(({ mine }) => mine.checked).map(({ field }) => field.name);
      resolve(dialog.returnValue === "keep" && kept.length ? new Set(kept) : null);
    });
    document.body.append(dialog);
    dialog.showModal();
  });
}

/**
 * @param {Disagreement} field
 * @param {"mine" | "theirs"} side
 */
function radio(field, side) {
  return h("input", { type: "radio", name: field.name, value: side, checked: side === "mine" });
}

/**
 * @param {HTMLInputElement} input
 * @param {string} text
 */
function choice(input, text) {
  return h("label", { class: "row" }, input, h("span", {}, text));
}
