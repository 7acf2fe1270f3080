/** Finding things by their names. */

/** Whether every word typed is in one of the texts, in any case. @param {string} typed @param {string[]} texts */
export function matches(typed, texts) {
  const there = texts.join(" ").toLowerCase();
  return typed
    .toLowerCase()
    .split(/\s+/)
    .every((word) => there.includes(word));
}
