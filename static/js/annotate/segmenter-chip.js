/** How the live segmenter stands, in a chip. */

import { h } from "../dom.js";

/** @typedef {import("../api-types").LiveStatus} LiveStatus */

const TEXT = {
  off: "segmenter off",
  starting: "segmenter starting…",
  preparing: "preparing the scan",
  ready: "ready",
  failed: "no masks",
};

export class SegmenterChip {
  element = h("span", { class: "chip", role: "status" });

  #told = false;

  /**
   * Show what opening it answers, unless the live connection, which may be quicker, has said something newer by then.
   * @param {Promise<LiveStatus>} opening
   */
  async open(opening) {
    this.#told = false;
    const status = await opening;
    if (!this.#told) this.show(status);
  }

  /** @param {LiveStatus} status */
  show(status) {
    this.#told = true;
    const percent = status.state === "preparing" ? ` ${Math.round(100 * status.fraction)} %` : "";
    this.element.textContent = `${TEXT[status.state]}${percent}`;
    this.element.className = `chip ${status.state === "ready" ? "good" : status.state === "failed" ? "bad" : ""}`;
    this.element.title = status.error ? `${status.error.message} ${status.error.hint}` : status.text;
  }
}
