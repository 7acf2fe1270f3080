/** Holder of the newest set of resources created asynchronously; replaced and outdated ones are closed. */

/** @template {{ close(): void }} T */
export class Newest {
  #begun = 0;
  /** @type {T[]} */
  held = [];

  /**
   * @param {Promise<T>[]} making a set that replaces the current one
   * @returns {Promise<boolean>} whether it did; false if a newer set was started before it was complete
   */
  async take(making) {
    const turn = ++this.#begun;
    const made = await Promise.allSettled(making);
    const set = made.flatMap((one) => (one.status === "fulfilled" ? [one.value] : []));
    const failed = made.find((one) => one.status === "rejected");
    const wanted = !failed && turn === this.#begun;
    for (const one of wanted ? this.held : set) one.close();
    if (wanted) this.held = set;
    if (failed) throw failed.reason;
    return wanted;
  }
}
