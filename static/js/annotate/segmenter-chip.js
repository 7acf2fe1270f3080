/** Status chip of the live segmenter. */

import { h } from "../dom.js";
import { counted } from "../lib/format.js";

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
  /** @type {LiveStatus | null} */
  #status = null;
  #following = 0;

  /** Number of objects whose masks are still being found; the chip shows "ready" at zero. @param {number} count */
  set following(count) {
    this.#following = count;
    this.#draw();
  }

  /**
   * Show the response to opening the segmenter, unless the live connection has delivered a newer status first.
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
    this.#status = status;
    this.#draw();
  }

  #draw() {
    const status = this.#status;
    if (!status) return;
    const busy = status.state === "ready" && this.#following > 0;
    const percent = status.state === "preparing" ? ` ${Math.round(100 * status.fraction)} %` : "";
    this.element.textContent = busy
      ? `finding ${counted(this.#following, "object")}`
      : `${TEXT[status.state]}${percent}`;
    const tone = { ready: busy ? "" : "good", failed: "bad" }[String(status.state)] ?? "";
    this.element.className = `chip ${tone}`;
    this.element.title = status.error ? `${status.error.message} ${status.error.hint}` : status.text;
  }
}
