/** Chip with a project's state on its way to approval. */

import { h } from "./dom.js";

/** @typedef {import("./api-types").ReviewStatus} ReviewStatus */

const TONES = { draft: "", ready: "", "in review": "warn", "changes requested": "bad", approved: "good" };

/** @param {ReviewStatus["state"]} state */
export function stateChip(state) {
  return h("span", { class: `chip ${TONES[state]}` }, state);
}
