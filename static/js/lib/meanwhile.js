/** Live updates while a list is loading: they may be newer than the list, so they are applied at once and again after it. */

export class Meanwhile {
  /** @type {Set<(() => void)[]>} updates received during each pending load */
  #late = new Set();

  /** @param {() => void} act update that may be applied twice */
  take(act) {
    act();
    for (const late of this.#late) late.push(act);
  }

  /**
   * @template T
   * @param {Promise<T>} list
   * @param {(list: T) => void} fill replaces the known state
   */
  async during(list, fill) {
    /** @type {(() => void)[]} */
    const late = [];
    this.#late.add(late);
    try {
      fill(await list);
      for (const act of late) act();
    } finally {
      this.#late.delete(late);
    }
  }
}
