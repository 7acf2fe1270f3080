/** A project as one file, with its recording or without. */

import { offerProjectFile } from "../api.js";
import { h, icon } from "../dom.js";
import { bytes } from "../lib/format.js";

const WITHIN =
  "objects with their clicks, drawn fronts and painted masks, corrections, meshes that were uploaded, comments and true lengths";
const NOT_WITHIN =
  "Masks and results are computed again after the import. Members, verdicts and approvals are not exported: the imported project is a draft.";

/**
 * Offer the download; the dialog closes with it.
 * @param {{ id: string, name: string }} project
 */
export async function offerExport({ id, name }) {
  const { size_bytes: size, recording_bytes: recording } = await offerProjectFile(id);
  const box = h("input", { type: "checkbox", checked: recording !== null, disabled: recording === null });
  const text =
    recording === null ? "With the recording: it is not kept here" : `With the recording, ${bytes(recording)}`;
  const total = h("span");
  const link = h("a", { class: "button primary", download: "" }, icon("download"), total);
  const dialog = h(
    "dialog",
    { class: "ask", "aria-label": `Export ${name}` },
    h(
      "div",
      { class: "stack" },
      h("h2", {}, `Export ${name}`),
      h("p", {}, `One zip with ${WITHIN}. Import it on another server like a scan.`),
      h("p", { class: "muted" }, NOT_WITHIN),
      h("label", { class: "row" }, box, text),
      h("div", { class: "row" }, link, h("button", { type: "button", onClick: () => dialog.close() }, "Cancel")),
    ),
  );
  const draw = () => {
    link.href = `/media/${id}/project.zip${box.checked ? "?recording=true" : ""}`;
    total.textContent = `Download, ${bytes(size + (box.checked ? (recording ?? 0) : 0))}`;
  };
  box.addEventListener("change", draw);
  link.addEventListener("click", () => setTimeout(() => dialog.close())); // once the browser took the address
  dialog.addEventListener("close", () => dialog.remove());
  draw();
  document.body.append(dialog);
  dialog.showModal();
}
