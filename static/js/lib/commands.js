/** Commands of the palette: found by the letters typed, best first. */

/** @typedef {{ text: string, keys?: string, run: () => void }} Command */

/**
 * Commands that hold all words typed; those that begin with them first.
 * @param {Command[]} commands
 * @param {string} typed
 */
export function ranked(commands, typed) {
  const words = typed.toLowerCase().split(/\s+/).filter(Boolean);
  return commands
    .map((command, order) => ({ command, order, score: score(command.text.toLowerCase(), words) }))
    .filter(({ score }) => score !== null)
    .toSorted((a, b) => (a.score ?? 0) - (b.score ?? 0) || a.order - b.order)
    .map(({ command }) => command);
}

/**
 * 0 for a word at the start, 1 at the start of a word, 2 anywhere; null when one is missing.
 * @param {string} text
 * @param {string[]} words
 */
function score(text, words) {
  let sum = 0;
  for (const word of words) {
    const at = text.indexOf(word);
    if (at < 0) return null;
    sum += at === 0 ? 0 : /\w/.test(text.charAt(at - 1)) ? 2 : 1;
  }
  return sum;
}
