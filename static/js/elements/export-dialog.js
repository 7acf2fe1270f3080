/** Dialog to export a project as one file, with or without its recording. */

import { offerProjectFile } from "../api.js";
import { h, icon } from "../dom.js";
import { bytes } from "../lib/format.js";

const WITHIN =
  "objects with their clicks, drawn fronts and painted masks, corrections, meshes that were uploaded, comments and true lengths";
const NOT_WITHIN =
  "Masks and results are computed again after the import. Members, verdicts and approvals are not exported: the imported project is a draft.";

/**
 * Open the dialog; it closes once the download starts.
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
  link.addEventListener("click", () => setTimeout(() => dialog.close())); // after the browser has read the link's address
  dialog.addEventListener("close", () => dialog.remove());
  draw();
  document.body.append(dialog);
  dialog.showModal();
}
