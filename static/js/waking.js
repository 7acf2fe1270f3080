/** Loading of a page that may be opened too early: while its recording is read, or while the server does not answer. */

import { ApiError } from "./api.js";
import { sayError } from "./elements/toasts.js";
import { live } from "./live.js";

export class Waking {
  #load;
  #tell;
  #busy = false;
  /** Whether the page is loaded. */
  loaded = false;

  /**
   * @param {() => Promise<unknown>} load
   * @param {(why: string) => void} tell shows on the page why it is not loaded
   */
  constructor(load, tell) {
    this.#load = load;
    this.#tell = tell;
  }

  /** Load now, else as soon as the project changes or the server is back. @param {AbortSignal} signal */
  begin(signal) {
    for (const type of ["project", "hello"]) live.addEventListener(type, () => !this.loaded && this.#try(), { signal });
    return this.#try();
  }

  async #try() {
    if (this.#busy) return;
    this.#busy = true;
    try {
      await this.#load();
      this.loaded = true;
    } catch (error) {
      this.#tell(error instanceof Error ? error.message : String(error));
      if (!(error instanceof ApiError && error.kind === "not-ready")) sayError(error); // that passes by itself
    } finally {
      this.#busy = false;
    }
  }
}
