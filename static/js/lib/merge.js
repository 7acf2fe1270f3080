/** Conflict of changes by two users: the fields that disagree. */

/** @typedef {Record<string, unknown>} Fields */

/**
 * Fields set by this user that another user has set to a different value since this user saw them.
 * @param {Fields} seen values that this user saw when changing them
 * @param {Fields} mine values wanted by this user
 * @param {Fields} theirs values stored now
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
