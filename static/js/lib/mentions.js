/** Mentions ("@name") in a text: the name being typed, and its completion. */

/**
 * The name being typed right before the caret, with the position of its "@"; null without one.
 * @param {string} text
 * @param {number} caret
 */
export function typedName(text, caret) {
  const found = /(?:^|[^\w.@+-])@([\w.@+-]*)$/.exec(text.slice(0, caret));
  return found ? { at: caret - (found[1] ?? "").length - 1, typed: (found[1] ?? "").toLowerCase() } : null;
}

/**
 * @param {string} text
 * @param {number} caret
 * @param {string} name
 * @returns {{ text: string, caret: number }}
 */
export function withName(text, caret, name) {
  const at = typedName(text, caret)?.at ?? caret;
  const before = `${text.slice(0, at)}@${name} `;
  return { text: before + text.slice(caret).replace(/^ /, ""), caret: before.length };
}
