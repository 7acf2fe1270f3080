/** Two people changed one thing: which fields really disagree. */

/** @typedef {Record<string, unknown>} Fields */

/**
 * Fields that I set and that somebody else has set to something else since I looked.
 * @param {Fields} seen what I saw when I changed it
 * @param {Fields} mine what I want
 * @param {Fields} theirs what is stored now
 */
export function disagreements(seen, mine, theirs) {
  return Object.keys(mine).filter((name) => !same(theirs[name], seen[name]) && !same(theirs[name], mine[name]));
}

/**
 * @param {unknown} a
 * @param {unknown} b
 */
function same(a, b) {
  return JSON.stringify(a ?? null) === JSON.stringify(b ?? null);
}
