/**
 * Changes on their way to the server, one after the other. What cannot be sent waits and is tried again, so that a lost
 * connection loses no click; one key for all tries, so that a lost answer repeats none. Says "change" whenever the number of waiting ones or the state does.
 */

import { ApiError, marked } from "./api.js";
import { live } from "./live.js";

const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 5000;

class Outbox extends EventTarget {
  #chain = Promise.resolve();
  waiting = 0;
  /** Whether the server did not answer last time. */
  stuck = false;

  constructor() {
    super();
    addEventListener("beforeunload", (event) => this.waiting && event.preventDefault());
  }

  /**
   * Send a change after those before it; resolves with what the server said, rejects with what it refused.
   * @template T
   * @param {() => Promise<T>} act
   * @returns {Promise<T>}
   */
  send(act) {
    this.#say(1);
    const done = this.#chain.then(() => this.#try(act));
    this.#chain = done.then(
      () => this.#say(-1),
      () => this.#say(-1),
    );
    return done;
  }

  /**
   * @template T
   * @param {() => Promise<T>} act
   */
  async #try(act) {
    const key = newKey();
    for (let wait = FIRST_WAIT_MS; ; wait = Math.min(2 * wait, LONGEST_WAIT_MS)) {
      try {
        const answer = await marked(key, act);
        this.#stick(false);
        return answer;
      } catch (error) {
        if (!(error instanceof ApiError) || error.status !== 0) {
          this.#stick(false);
          throw error;
        }
        this.#stick(true);
        await online(wait);
      }
    }
  }

  /** @param {boolean} stuck */
  #stick(stuck) {
    if (this.stuck === stuck) return;
    this.stuck = stuck;
    this.dispatchEvent(new Event("change"));
  }

  /** @param {1 | -1} by */
  #say(by) {
    this.waiting += by;
    this.dispatchEvent(new Event("change"));
  }
}

/** 128 random bits; crypto.randomUUID is missing where the page did not come over TLS. */
const newKey = () => Array.from(crypto.getRandomValues(new Uint32Array(4)), (n) => n.toString(36)).join("-");

/**
 * Until the live connection is back, at most that long.
 * @param {number} wait
 * @returns {Promise<void>}
 */
function online(wait) {
  return new Promise((resolve) => {
    const timer = setTimeout(resolve, wait);
    live.addEventListener("online", () => (clearTimeout(timer), resolve()), { once: true });
  });
}

export const outbox = new Outbox();
