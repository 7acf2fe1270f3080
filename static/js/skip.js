/** Skip link for keyboard users, before the header: jumps past some sixty Tab stops to the main part of a page. */

import { h } from "./dom.js";

/**
 * @param {string} text
 * @param {HTMLElement} to
 * @param {AbortSignal} signal aborted when the page is left, which removes the link
 */
export function offerToSkip(text, to, signal) {
  const link = h("button", { type: "button", class: "skip-link", onClick: () => to.focus() }, text);
  document.querySelector(".skip-link")?.before(link);
  signal.addEventListener("abort", () => link.remove());
}
