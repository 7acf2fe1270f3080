/** Short messages in the corner; errors stay until closed or until another page is opened. Announced to assistive technology. */

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
    const toast = h(
      "div",
      { class: `toast ${kind}` },
      h("div", {}, h("div", {}, text), hint ? h("div", { class: "muted" }, hint) : null),
      offer ? h("button", { type: "button", onClick: () => (toast.remove(), offer.run()) }, offer.text) : null,
      close,
    );
    close.addEventListener("click", () => toast.remove());
    if (kind !== "bad") leaveAfter(toast, offer ? 2 * SHOWN_MS : SHOWN_MS);
    this.append(toast);
    while (this.childElementCount > 4) this.firstElementChild?.remove();
  }
}

/** It goes when its time is over, but not from under a pointer or a person at its buttons. @param {HTMLElement} toast @param {number} ms */
function leaveAfter(toast, ms) {
  setTimeout(() => (toast.matches(":hover, :focus-within") ? leaveAfter(toast, SHOWN_MS) : toast.remove()), ms);
}

/**
 * Say something in the corner of the page.
 * @param {string} text
 * @param {Options} [options]
 */
export function say(text, options) {
  const toasts = document.querySelector("r2c2r-toasts");
  if (toasts instanceof Toasts) toasts.add(text, options);
}

/**
 * Say that something goes on by itself when the server has time for it.
 * @param {ApiError} error
 */
export function sayWaiting(error) {
  say(error.message, { hint: `Retrying in ${Math.ceil((error.retryMs ?? 0) / 1000)} s.` });
}

/**
 * Say what went wrong; a cancelled request is not news.
 * @param {unknown} error
 */
export function sayError(error) {
  if (error instanceof DOMException && error.name === "AbortError") return;
  if (error instanceof ApiError && error.unreachable)
    say(error.message); // the banner stays until it is back
  else if (error instanceof ApiError) say(error.message, { kind: "bad", hint: error.hint });
  else {
    say(error instanceof Error ? error.message : String(error), { kind: "bad", hint: "reload the page" });
    console.error(error);
  }
}
