/** Answers to one question that is asked anew before it is answered: they may come in another order than they were asked for. */

export class Answers {
  #asked = 0;
  #taken = 0;

  /**
   * Take an answer, unless one that was asked for later was taken already: it knows more.
   * @template T
   * @param {Promise<T>} answer
   * @param {(answer: T) => void} take
   */
  async take(answer, take) {
    const turn = ++this.#asked;
    const found = await answer;
    if (turn < this.#taken) return;
    this.#taken = turn;
    take(found);
  }
}
