/** Search over the commands of the palette. */

/** @typedef {{ text: string, keys?: string, run: () => void }} Command */

/**
 * Commands that contain all typed words, those that begin with them first.
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
 * Sum over the words, lowest best: 0 at the start of the text, 1 at the start of a word, 2 elsewhere; null if one is missing.
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
