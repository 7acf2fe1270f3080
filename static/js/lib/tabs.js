/**
 * Which tab owns what: each holds a lock of its own for as long as it lives, and who waits for that lock learns when it is gone,
 * closed or crashed. Browsers give locks to secure origins only; without them nothing is known of other tabs.
 */

/** @typedef {Pick<LockManager, "request">} Locks */

export class Tabs {
  #locks;
  /** Tabs that are waited for. @type {Set<string>} */
  #waited = new Set();

  /**
   * @param {Locks | undefined} locks
   * @param {string} mine the name of this tab
   */
  constructor(locks, mine) {
    this.#locks = locks;
    this.mine = mine;
    locks?.request(nameOf(mine), () => new Promise(() => {})); // until this tab goes
  }

  /** Whether the others can be told from those that are gone. */
  get known() {
    return this.#locks !== undefined;
  }

  /**
   * Do that once a tab is gone, or at once where that cannot be known; nobody else does it meanwhile, and whoever waits next begins
   * should this tab go before it is done.
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
