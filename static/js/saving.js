/** Saving of a change, with its state reported. */

import { sayError } from "./elements/toasts.js";
import { outbox } from "./outbox.js";

/**
 * Send a change; an error is shown as a toast and rethrown.
 * @template T
 * @param {import("./changes.js").Change<T>} change
 * @param {string | undefined} key
 * @param {(how: { text: string, tone: string }) => void} tell
 * @returns {Promise<T>}
 */
export async function saving(change, key, tell) {
  tell({ text: "saving…", tone: "" });
  try {
    const answer = await outbox.send(change, key);
    if (!outbox.waiting) tell({ text: `saved ${new Date().toLocaleTimeString()}`, tone: "" }); // else more changes are waiting
    return answer;
  } catch (error) {
    tell({ text: "not saved", tone: "bad" });
    sayError(error);
    throw error;
  }
}
