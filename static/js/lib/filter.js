/** Search by name. */

/** Whether every typed word is in one of the texts, ignoring case. @param {string} typed @param {string[]} texts */
export function matches(typed, texts) {
  const there = texts.join(" ").toLowerCase();
  return typed
    .toLowerCase()
    .split(/\s+/)
    .every((word) => there.includes(word));
}
