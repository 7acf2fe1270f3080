/** Legend for the colours of a scene's surfaces. */

import { h } from "../dom.js";

/** CSS class, ends of the scale and a note for each layer. @type {Record<string, [string, string, string, string]>} */
const SCALES = {
  distance: ["viridis", "0 mm", "30 mm from the scan", "Grey: nothing was measured within 60 mm."],
  unobserved: [
    "magma",
    "observed",
    "50 cm from any observation",
    "Light surfaces were not filmed: their shape is inferred.",
  ],
};

/** @param {string | undefined} draw */
export function heatLegend(draw) {
  const scale = SCALES[draw ?? ""];
  if (!scale) return null;
  const [colours, from, to, note] = scale;
  return h(
    "p",
    { class: "heat-legend" },
    h("span", {}, from),
    h("span", { class: `scale ${colours}`, "aria-hidden": "true" }),
    h("span", {}, to),
    h("span", { class: "muted" }, note),
  );
}
