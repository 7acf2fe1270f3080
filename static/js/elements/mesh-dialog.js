/** Preview of an uploaded mesh before use: picture, size beside the object's, and repairs made. */

import { ApiError } from "../api.js";
import { h } from "../dom.js";
import { sides } from "../lib/format.js";

/** @typedef {import("../api-types").MeshLook} MeshLook */

/**
 * Show the mesh and ask whether to use it.
 * @param {File} file
 * @param {string} name of the object
 * @param {(signal: AbortSignal) => Promise<MeshLook>} look
 * @returns {Promise<boolean>}
 */
export function askToUseMesh(file, name, look) {
  return new Promise((resolve) => {
    const leaving = new AbortController();
    const shown = h(
      "div",
      { class: "stack", "aria-live": "polite" },
      h("p", {}, `Checking ${file.name}…`),
      h("progress"),
    );
    const use = h("button", { type: "submit", class: "primary", value: "use", disabled: true }, "Use this mesh");
    const dialog = h(
      "dialog",
      { "aria-label": `A mesh for ${name}`, class: "mesh-look" },
      h("h2", {}, `A mesh for ${name}`),
      shown,
      h("form", { method: "dialog", class: "row" }, use, h("button", { type: "submit", value: "" }, "Cancel")),
    );
    dialog.addEventListener("close", () => {
      leaving.abort();
      dialog.remove();
      resolve(dialog.returnValue === "use");
    });
    document.body.append(dialog);
    dialog.showModal();
    look(leaving.signal).then(
      (seen) => {
        shown.replaceChildren(...described(seen));
        use.disabled = false;
        use.focus();
      },
      (error) => shown.replaceChildren(refusal(error)),
    );
  });
}

/** @param {MeshLook} seen @returns {Node[]} */
function described({ name, picture, size, object_size_m: object, triangles, notes }) {
  const rows = [
    ["The mesh", `${sides(size)} in the file's unit`],
    ["The object in the scan", object ? `${sides(object)} m` : "not measured: its masks show no surface"],
    ["Triangles", triangles.toLocaleString("en")],
  ];
  return [
    h("img", { src: `data:image/png;base64,${picture}`, alt: `${name}, as it would be used` }),
    h("table", {}, ...rows.map(([what, value]) => h("tr", {}, h("th", { scope: "row" }, what), h("td", {}, value)))),
    h(
      "p",
      { class: "muted" },
      "Sides from the longest to the shortest. The mesh is turned and scaled to fit the scan.",
    ),
    notes.length ? h("ul", {}, ...notes.map((note) => h("li", {}, note))) : h("p", {}, "Nothing had to be repaired."),
  ];
}

/** @param {unknown} error */
function refusal(error) {
  const hint = error instanceof ApiError ? error.hint : "";
  const message = error instanceof Error ? error.message : String(error);
  return h("p", { role: "alert", class: "failure" }, h("strong", {}, message), h("span", {}, hint && ` ${hint}`));
}
