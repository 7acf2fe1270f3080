/** What is told while a list is on its way may be newer than that list: it is taken at once, and again after it. */

export class Meanwhile {
  /** @type {Set<(() => void)[]>} of each list that is on its way */
  #late = new Set();

  /** @param {() => void} act that may be done twice */
  take(act) {
    act();
    for (const late of this.#late) late.push(act);
  }

  /**
   * @template T
   * @param {Promise<T>} list
   * @param {(list: T) => void} fill takes the place of what was known
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
