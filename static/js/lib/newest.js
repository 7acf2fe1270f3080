/** Of what is made one after the other, the newest; whatever it replaces or overtakes is closed. */

/** @template {{ close(): void }} T */
export class Newest {
  #begun = 0;
  /** @type {T[]} */
  held = [];

  /**
   * @param {Promise<T>[]} making all of a set that takes the place of what is held
   * @returns {Promise<boolean>} whether it did: no newer one was begun meanwhile
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
