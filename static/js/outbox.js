/**
 * Queue of changes, sent to the server one at a time. Each is kept in the browser's storage until it is answered, so that
 * neither a lost connection nor a closed tab loses any; its key lets the server apply it once, however often it is sent. A tab
 * sends its own changes, and those of closed tabs.
 * Emits "change" when the number of waiting changes or the state changes, "caught-up" when changes of another tab are stored,
 * "refused" {detail: error} when one of those is refused.
 */

import { ApiError, perform } from "./api.js";
import { forget, isChange, keep, keptBy, named } from "./lib/kept.js";
import { rebased } from "./lib/rebased.js";
import { Tabs } from "./lib/tabs.js";
import { live } from "./live.js";

/** @typedef {import("./lib/kept.js").Kept} Kept */
/**
 * @template T
 * @typedef {import("./changes.js").Change<T>} Change
 */

const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 5000;
const NOT_MADE = { kind: "not-made", message: "the object of this click could not be made", hint: "click it again" };

export class Outbox extends EventTarget {
  #chain = Promise.resolve();
  #tabs;
  /** User who makes these changes; null while unknown. @type {string | null} */
  #user = null;
  /** @type {Kept[]} */
  #waiting = [];
  /**
   * Returns what to send instead of a change that conflicts with another user's; null keeps theirs.
   * @type {(change: Kept, stored: unknown) => Promise<Change<unknown> | null>}
   */
  merge = async () => null;
  /** Whether the last attempt failed and is being retried. */
  stuck = false;
  /** Whether waiting changes would survive closing this page. */
  safe = true;

  /** @param {Tabs} tabs */
  constructor(tabs) {
    super();
    this.#tabs = tabs;
    addEventListener("beforeunload", (event) => this.#waiting.length && !this.safe && event.preventDefault());
    addEventListener("storage", ({ key }) => tabs.known && isChange(key) && this.#inherit());
  }

  get waiting() {
    return this.#waiting.length;
  }

  /**
   * Set the user of these changes, and send those left by earlier visits of that user.
   * @param {string} user
   */
  begin(user) {
    this.#user = user;
    this.#waiting = this.#waiting.map((one) => (one.user ? one : this.#keep({ ...one, user })));
    this.#inherit();
  }

  /** Send the changes of the user's other tabs once those are closed. */
  #inherit() {
    if (this.#user === null) return;
    for (const { tab } of keptBy(localStorage, this.#user))
      this.#tabs.whenGone(tab, () => Promise.all(this.#left(tab).map((change) => this.#sendLeft(change))));
  }

  /** Changes left by a tab. @param {string} tab */
  #left(tab) {
    const here = new Set(this.#waiting.map(({ key }) => key));
    return keptBy(localStorage, this.#user ?? "").filter((change) => change.tab === tab && !here.has(change.key));
  }

  /** @param {Kept} change */
  #sendLeft(change) {
    return this.#enqueue(change).then(
      () => this.dispatchEvent(new Event("caught-up")),
      (error) => this.dispatchEvent(new CustomEvent("refused", { detail: error })),
    );
  }

  /**
   * Queue a change; resolves with the server's response, rejects with its error.
   * @template T
   * @param {Change<T>} change
   * @param {string} [key]
   * @returns {Promise<T>}
   */
  send(change, key = newKey()) {
    const kept = { ...change, key, user: this.#user ?? "", tab: this.#tabs.mine, at: now() };
    return /** @type {Promise<T>} */ (this.#enqueue(this.#keep(kept)));
  }

  /**
   * @param {Kept} change
   * @returns {Kept} the same
   */
  #keep(change) {
    this.safe = keep(localStorage, change) && this.safe;
    return change;
  }

  /** Promise that resolves when every change queued so far is stored or refused. */
  get settled() {
    return this.#chain;
  }

  /** @param {Kept} change */
  #enqueue(change) {
    this.#waiting.push(change);
    this.#tell();
    const done = this.#chain.then(() => this.#deliver(change.key));
    const next = () => this.#tell();
    this.#chain = done.then(next, next);
    return done;
  }

  /** @param {string} key of the change that is next */
  async #deliver(key) {
    const change = this.#waiting.find((one) => one.key === key);
    if (!change) throw new Error(`no change ${key} waits`);
    try {
      if (this.#isOrphan(change)) throw new ApiError(409, NOT_MADE);
      const answer = await this.#answered(change);
      this.#settle(change, answer);
      return answer;
    } catch (error) {
      if (!(error instanceof ApiError && error.status === 401)) this.#settle(change, null); // 401: sent after signing in
      throw error;
    }
  }

  /** Whether a change is for an object whose creation was refused. @param {Kept} change */
  #isOrphan({ path }) {
    const maker = path.match(/\{(\w+)\}/)?.[1];
    return maker !== undefined && !this.#waiting.some(({ key }) => key === maker);
  }

  /**
   * @param {Kept} change
   * @returns {Promise<unknown>}
   */
  async #answered(change) {
    try {
      return await this.#persist(change);
    } catch (error) {
      if (!(error instanceof ApiError) || error.kind !== "conflict") throw error;
      if (!error.current) this.dispatchEvent(new Event("caught-up")); // stored before the server stopped: reload
      if (!error.current || !change.seen) throw error;
      const instead = await this.merge(change, error.current);
      return instead ? this.#answered({ ...change, ...instead, key: newKey() }) : error.current;
    }
  }

  /** Send a change, retried with increasing delay until the server answers. @param {Kept} change */
  async #persist({ key, method, path, json, user }) {
    for (let wait = FIRST_WAIT_MS; ; wait = Math.min(2 * wait, LONGEST_WAIT_MS)) {
      try {
        const answer = await perform(method, path, json, key, user);
        this.#stick(false);
        return answer;
      } catch (error) {
        const later = error instanceof ApiError && error.later;
        this.#stick(later);
        if (!later) throw error;
        await online(wait);
      }
    }
  }

  /**
   * @param {Kept} change
   * @param {unknown} answer
   */
  #settle(change, answer) {
    forget(localStorage, change);
    this.#waiting = this.#waiting.filter((one) => one.key !== change.key);
    const id = /** @type {{ id?: unknown } | null} */ (answer)?.id;
    this.#waiting = this.#waiting.map((one) => {
      const known = rebased(typeof id === "number" ? named(one, change.key, id) : one, change, answer);
      if (known !== one) keep(localStorage, known);
      return known;
    });
  }

  /** @param {boolean} stuck */
  #stick(stuck) {
    if (this.stuck === stuck) return;
    this.stuck = stuck;
    this.#tell();
  }

  #tell() {
    this.dispatchEvent(new Event("change"));
  }
}

/** Random key that identifies a change to the server; `crypto.randomUUID` exists on secure origins only. */
export function newKey() {
  return [...crypto.getRandomValues(new Uint8Array(16))].map((byte) => byte.toString(16).padStart(2, "0")).join("");
}

let last = 0;

/** Microseconds since 1970, later at every call. */
function now() {
  last = Math.max(last + 1, Date.now() * 1000);
  return last;
}

/**
 * Wait until the live connection is back, or at most `wait` milliseconds.
 * @param {number} wait
 * @returns {Promise<void>}
 */
function online(wait) {
  return new Promise((resolve) => {
    const done = () => {
      clearTimeout(timer);
      live.removeEventListener("online", done);
      resolve();
    };
    const timer = setTimeout(done, wait);
    live.addEventListener("online", done);
  });
}

export const outbox = new Outbox(new Tabs(globalThis.navigator?.locks, newKey()));
