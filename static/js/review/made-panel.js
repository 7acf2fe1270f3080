/** Right panel of the review page for an object made from the scan: size, colour, and a button to leave it out. */

import { h, numberField } from "../dom.js";
import { hexOf } from "../lib/colour.js";
import { rgbOf } from "../lib/masks.js";
import { sourceChip } from "../source-chip.js";

/** @typedef {import("../api-types").SceneItem} SceneItem */
/** @typedef {import("../api-types").OverridePatch} OverridePatch */

const SIDES = ["Width", "Depth", "Height"];

/**
 * @param {SceneItem} item
 * @param {boolean} judges
 * @param {(patch: Partial<OverridePatch>) => void} change
 * @returns {(Node | string)[]}
 */
export function madePanel(item, judges, change) {
  return [
    h("div", { class: "row name" }, h("h2", {}, item.name), h("span", { class: "chip" }, item.category)),
    h("p", { class: "muted" }, "Made from the scan: nobody clicked it."),
    item.changed
      ? h("p", { class: "chip warn", role: "status" }, "Below: of the last run, before its last change")
      : "",
    h(
      "div",
      { class: item.changed ? "chips old" : "chips" },
      ...item.dimension_sources.map((source, k) => sourceChip(source, { of: (SIDES[k] ?? "").toLowerCase() })),
    ),
    ...item.warnings.slice(1).map((warning) => h("p", { class: item.changed ? "muted old" : "muted" }, warning)),
    h("fieldset", { class: "stack plain", disabled: !judges }, size(item, change), colour(item, change), leave(change)),
  ];
}

/**
 * @param {SceneItem} item
 * @param {(patch: Partial<OverridePatch>) => void} change
 */
function size({ dimensions_m: found, override }, change) {
  const sides = override.dimensions_m ?? found;
  const fields = SIDES.map((name, k) =>
    numberField(`${name} (cm)`, Math.round(1000 * (sides[k] ?? 0)) / 10, { min: "0.1", step: "any" }),
  );
  const form = h("form", { class: "stack", "aria-label": "Size" }, ...fields.map(({ label }) => label));
  const again = h("button", { type: "button", class: "quiet", hidden: !override.dimensions_m }, "Compute it again");
  again.addEventListener("click", () => change({ dimensions_m: null }));
  form.append(h("div", { class: "row" }, h("button", { type: "submit" }, "Set size"), again));
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const [width = 0, depth = 0, height = 0] = fields.map(({ input }) => input.valueAsNumber / 100);
    if (width > 0 && depth > 0 && height > 0) change({ dimensions_m: [width, depth, height] });
  });
  return form;
}

/**
 * @param {SceneItem} item
 * @param {(patch: Partial<OverridePatch>) => void} change
 */
function colour({ name, colour: found, override }, change) {
  const [red = 0, green = 0, blue = 0] = override.colour ?? found;
  const input = h("input", { type: "color", value: hexOf([red, green, blue]), "aria-label": `Colour of ${name}` });
  input.addEventListener("change", () => {
    const [r = 0, g = 0, b = 0] = rgbOf(input.value).map((part) => part / 255);
    change({ colour: [r, g, b] });
  });
  return h("label", { class: "row" }, "Colour", input);
}

/** @param {(patch: Partial<OverridePatch>) => void} change */
function leave(change) {
  return h("button", { type: "button", onClick: () => change({ left_out: true }) }, "Leave it out");
}
