/** Where a project stands on its way to approval, in a chip. */

import { h } from "./dom.js";

/** @typedef {import("./api-types").ReviewStatus} ReviewStatus */

const TONES = { draft: "", ready: "", "in review": "warn", "changes requested": "bad", approved: "good" };

/** @param {ReviewStatus["state"]} state */
export function stateChip(state) {
  return h("span", { class: `chip ${TONES[state]}` }, state);
}
