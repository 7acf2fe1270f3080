/**
 * Toasts in the corner, announced to assistive technology; errors stay until closed or another page is opened. Equal ones are
 * shown once, with their number, unless each offers something of its own.
 */

import { ApiError } from "../api.js";
import { h, icon } from "../dom.js";

/** @typedef {{ kind?: "good" | "bad" | "", hint?: string, offer?: { text: string, run: () => void } | null }} Options */

const SHOWN_MS = 6000;

export class Toasts extends HTMLElement {
  connectedCallback() {
    this.setAttribute("role", "status");
    this.setAttribute("aria-live", "polite");
    for (const type of ["r2c2r-go", "popstate"])
      window.addEventListener(type, () => this.querySelectorAll(".toast.bad").forEach((toast) => toast.remove()));
  }

  /**
   * @param {string} text
   * @param {Options} [options]
   */
  add(text, { kind = "", hint = "", offer = null } = {}) {
    const close = h("button", { class: "quiet", type: "button", "aria-label": "Close this message" }, icon("cross"));
    const said = offer ? "" : JSON.stringify([kind, text, hint]);
    const shown = /** @type {NodeListOf<HTMLElement>} */ (this.querySelectorAll("[data-said]"));
    const same = [...shown].find((one) => one.dataset.said === said);
    const times = 1 + Number(same?.dataset.times ?? 0);
    const toast = h(
      "div",
      { class: `toast ${kind}`, "data-said": said || null, "data-times": times },
      h("div", {}, h("div", {}, text), hint ? h("div", { class: "muted" }, hint) : null),
      times > 1 ? h("span", { class: "muted" }, `${times} times`) : null,
      offer ? h("button", { type: "button", onClick: () => (toast.remove(), offer.run()) }, offer.text) : null,
      close,
    );
    close.addEventListener("click", () => toast.remove());
    if (kind !== "bad") leaveAfter(toast, offer ? 2 * SHOWN_MS : SHOWN_MS);
    same?.remove();
    this.append(toast);
    while (this.childElementCount > 4) this.firstElementChild?.remove();
  }
}

/** Remove a toast after a delay, but not while it is hovered or focused. @param {HTMLElement} toast @param {number} ms */
function leaveAfter(toast, ms) {
  setTimeout(() => (toast.matches(":hover, :focus-within") ? leaveAfter(toast, SHOWN_MS) : toast.remove()), ms);
}

/**
 * Show a toast.
 * @param {string} text
 * @param {Options} [options]
 */
export function say(text, options) {
  const toasts = document.querySelector("r2c2r-toasts");
  if (toasts instanceof Toasts) toasts.add(text, options);
}

/**
 * Show that a request is retried automatically once the server has capacity.
 * @param {ApiError} error
 */
export function sayWaiting(error) {
  say(error.message, { hint: `Retrying in ${Math.ceil((error.retryMs ?? 0) / 1000)} s.` });
}

/**
 * Show an error; cancelled requests are ignored.
 * @param {unknown} error
 */
export function sayError(error) {
  if (error instanceof DOMException && error.name === "AbortError") return;
  if (error instanceof ApiError && error.unreachable)
    say(error.message); // the offline banner stays until the server is back
  else if (error instanceof ApiError) say(error.message, { kind: "bad", hint: error.hint });
  else {
    say(error instanceof Error ? error.message : String(error), { kind: "bad", hint: "reload the page" });
    console.error(error);
  }
}
