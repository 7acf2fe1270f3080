/** Asking again for what the server refused as too much at once. No DOM: the way to the server and the waiting are given. */

const MOST_ASKED = 20;

/**
 * What `ask` resolves to; as long as it is refused with a time to try again, it is asked again then. `told` hears of the first
 * refusal.
 * @template T
 * @param {() => Promise<T>} ask
 * @param {{
 *   retryMs: (error: unknown) => number | null,
 *   told: (error: unknown) => void,
 *   wait: (ms: number) => Promise<void>,
 * }} ways `retryMs` is null for an error that will not pass
 * @returns {Promise<T>}
 */
export async function patiently(ask, { retryMs, told, wait }) {
  for (let asked = 1; ; asked++) {
    try {
      return await ask();
    } catch (error) {
      const ms = retryMs(error);
      if (ms === null || asked === MOST_ASKED) throw error;
      if (asked === 1) told(error);
      await wait(ms);
    }
  }
}
