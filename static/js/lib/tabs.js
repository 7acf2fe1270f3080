/**
 * Detection of closed tabs: each tab holds a lock for as long as it lives, and another tab that waits for that lock learns when
 * it was closed or crashed. Browsers grant locks to secure origins only; without them nothing is known of other tabs.
 */

/** @typedef {Pick<LockManager, "request">} Locks */

export class Tabs {
  #locks;
  /** Tabs whose end is waited for. @type {Set<string>} */
  #waited = new Set();

  /**
   * @param {Locks | undefined} locks
   * @param {string} mine the name of this tab
   */
  constructor(locks, mine) {
    this.#locks = locks;
    this.mine = mine;
    locks?.request(nameOf(mine), () => new Promise(() => {})); // held until this tab is closed
  }

  /** Whether open tabs can be distinguished from closed ones. */
  get known() {
    return this.#locks !== undefined;
  }

  /**
   * Run `inherit` once a tab is closed, or at once where that cannot be known. No other tab runs it at the same time; if this
   * tab is closed before it is done, the next waiting tab runs it.
   * @param {string} tab
   * @param {() => Promise<unknown>} inherit
   */
  async whenGone(tab, inherit) {
    if (tab === this.mine || this.#waited.has(tab)) return;
    this.#waited.add(tab);
    await (this.#locks ? this.#locks.request(nameOf(tab), inherit) : inherit());
    this.#waited.delete(tab);
  }
}

/** @param {string} tab */
function nameOf(tab) {
  return `r2c2r-outbox-${tab}`;
}
