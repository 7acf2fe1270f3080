/** Page of the agreement between two people's annotations of one recording, object by object, the largest differences first. */

import { agreementTable, getAgreement } from "../api.js";
import { h, LiveElement } from "../dom.js";
import { sayError } from "../elements/toasts.js";
import { counted } from "../lib/format.js";

/** @typedef {import("../api-types").Agreement} Agreement */
/** @typedef {import("../api-types").Agreed} Agreed */
/** @typedef {import("../api-types").AgreedObject} AgreedObject */

const GOOD = 0.8; // IoU below which two masks are highlighted

export class AgreementPage extends LiveElement {
  project = "";
  query = new URLSearchParams();
  #body = h("div", { class: "page stack" }, h("p", { role: "status" }, "Comparing masks…"));

  connected() {
    this.replaceChildren(this.#body);
    this.#load();
  }

  async #load() {
    try {
      const found = await getAgreement(this.project, this.query.get("other") ?? "");
      if (!this.signal.aborted) this.#draw(found);
    } catch (error) {
      this.#body.replaceChildren(h("p", { role: "alert" }, error instanceof Error ? error.message : String(error)));
      sayError(error);
    }
  }

  /** @param {Agreement} found */
  #draw(found) {
    const { first, second, objects } = found;
    const table = agreementTable(this.project, second.project);
    this.#body.replaceChildren(
      h(
        "header",
        {},
        h("h1", {}, "Agreement"),
        h("a", { class: "button", href: table, download: "" }, "Download as a table"),
      ),
      h("p", {}, "First: ", side(first), "; second: ", side(second)),
      h("dl", { class: "facts card" }, ...figures(found)),
      h(
        "p",
        { class: "muted" },
        `Objects are paired by their masks, over ${counted(found.frames, "frame")}. Mask IoU: pixels in both masks divided by pixels in either, over all of these frames; a frame in which only one of the two has a mask counts against it.`,
      ),
      objects.length ? this.#table(found) : h("p", {}, "Neither has a mask yet."),
      unmasked(found),
    );
  }

  /** @param {Agreement} found */
  #table({ first, second, objects }) {
    const head = ["First", "Category", "Second", "Category", "Mask IoU", "Frames of both"];
    return h(
      "div",
      { class: "scroll", tabIndex: 0, role: "region", "aria-label": "Objects" },
      h(
        "table",
        {},
        h("thead", {}, h("tr", {}, ...head.map((text) => h("th", { scope: "col" }, text)))),
        h("tbody", {}, ...objects.map((one) => row(one, first.project, second.project))),
      ),
    );
  }
}

/** @param {Agreement["first"]} opinion */
function side({ project, name, assignee }) {
  return h("span", {}, h("a", { href: `/p/${project}` }, name), assignee ? ` (${assignee})` : "");
}

/** @param {Agreement} found */
function figures({ both, only_first, only_second, mean_iou, same_category }) {
  const rows = [
    ["Objects that both have", String(both)],
    ["Only in the first", String(only_first)],
    ["Only in the second", String(only_second)],
    ["Mean mask IoU of both", mean_iou === null ? "–" : mean_iou.toFixed(2)],
    ["Same category", both ? `${same_category} of ${both}` : "–"],
  ];
  return rows.flatMap(([name, value]) => [h("dt", {}, name ?? ""), h("dd", {}, value ?? "")]);
}

/**
 * @param {Agreed} agreed
 * @param {string} here
 * @param {string} there
 */
function row({ first, second, iou, frames, same_category }, here, there) {
  const differs = same_category === false ? "chip warn" : "";
  const overlap =
    iou === null
      ? h("span", { class: "chip warn" }, "only one has it")
      : h("span", { class: iou < GOOD ? "chip warn" : "" }, iou.toFixed(2));
  return h(
    "tr",
    {},
    h("td", {}, link(first, here)),
    h("td", {}, h("span", { class: differs }, first?.category ?? "")),
    h("td", {}, link(second, there)),
    h("td", {}, h("span", { class: differs }, second?.category ?? "")),
    h("td", {}, overlap),
    h("td", {}, iou === null ? "" : String(frames)),
  );
}

/**
 * @param {AgreedObject | null} object
 * @param {string} project
 */
function link(object, project) {
  return object ? h("a", { href: `/p/${project}/annotate?object=${object.object}` }, object.name) : "";
}

/** @param {Agreement} found */
function unmasked({ unmasked: objects }) {
  if (!objects.length) return "";
  const names = objects.map(({ name }) => name).join(", ");
  return h("p", { class: "muted" }, `Not compared, as they have no mask: ${names}.`);
}
