/** Responses to repeated requests, which may arrive in another order than they were sent. */

export class Answers {
  #asked = 0;
  #taken = 0;

  /**
   * Take a response, unless that of a later request was taken already: it is newer.
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
