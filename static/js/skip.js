/** A link for the keyboard, before the header: past sixty stops of the Tab key straight to what a page is about. */

import { h } from "./dom.js";

/**
 * @param {string} text
 * @param {HTMLElement} to
 * @param {AbortSignal} signal that ends it with its page
 */
export function offerToSkip(text, to, signal) {
  const link = h("button", { type: "button", class: "skip-link", onClick: () => to.focus() }, text);
  document.querySelector(".skip-link")?.before(link);
  signal.addEventListener("abort", () => link.remove());
}
