/** Throttle for requests: sends the latest values, merged, at most once per interval and one request at a time. */

import { sayError } from "../elements/toasts.js";

/** @template {object} T */
export class Paced {
  #ms;
  #send;
  /** @type {T | null} */
  #next = null;
  #timer = 0;

  /**
   * @param {number} ms
   * @param {(wish: T) => Promise<unknown>} send
   */
  constructor(ms, send) {
    this.#ms = ms;
    this.#send = send;
  }

  /** @param {T} wish values merged into the pending request */
  add(wish) {
    this.#next = Object.assign(this.#next ?? {}, wish);
    this.#timer ||= window.setTimeout(() => this.#go(), this.#ms);
  }

  stop() {
    clearTimeout(this.#timer);
    this.#next = null;
  }

  async #go() {
    const wish = this.#next;
    this.#next = null;
    if (wish) await this.#send(wish).catch(sayError);
    this.#timer = 0;
    if (this.#next) this.add(this.#next);
  }
}
