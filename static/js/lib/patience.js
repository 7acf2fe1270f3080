/** Retry of requests that the server refused because of too many at once. No DOM: request and wait are passed in. */

const MOST_ASKED = 20;

/**
 * Result of `ask`, retried up to a limit while it is refused with a retry time. `told` is called on the first refusal.
 * @template T
 * @param {() => Promise<T>} ask
 * @param {{
 *   retryMs: (error: unknown) => number | null,
 *   told: (error: unknown) => void,
 *   wait: (ms: number) => Promise<void>,
 * }} ways `retryMs` is null for an error that is not temporary
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
