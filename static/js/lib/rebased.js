/** Changes made on one's own earlier ones, and verdicts as text; no DOM. */

/** @typedef {import("../changes.js").Change} Change */
/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */

/**
 * A change made on what an earlier one of the same user left, with the answer to that one as its base: nobody is in conflict
 * with themselves. Other changes stay as they are.
 * @template {Change} C
 * @param {C} change
 * @param {Change} before
 * @param {unknown} answer
 * @returns {C}
 */
export function rebased(change, before, answer) {
  const { version: base } = before.json;
  const state = stateOf(change);
  if (base === undefined || change.json.version !== base || state === null || state !== stateOf(before)) return change;
  const left = /** @type {{ version?: number, group?: CandidateGroup | null } | null} */ (answer);
  const now = left?.group ?? left;
  if (now?.version === undefined) return change;
  const fields = /** @type {Record<string, unknown>} */ (
    left?.group ? { ...left.group.override, verdict: verdictOf(left.group) } : now
  );
  const seen = Object.fromEntries(Object.keys(change.seen ?? {}).map((field) => [field, fields[field]]));
  return { ...change, json: { ...change.json, version: now.version }, ...(change.seen ? { seen } : {}) };
}

/** The versioned state that a change applies to: an object's prompts, or its review. @param {Change} change */
function stateOf({ path }) {
  const found = /^(.*\/objects\/\d+)(\/(verdicts|override))?$/.exec(path);
  return found && `${found[1]} ${found[2] ? "review" : "prompts"}`;
}

/** Verdicts given on an object's candidates, as text. @param {CandidateGroup} group */
export const verdictOf = (group) =>
  group.candidates
    .filter(({ verdict }) => verdict)
    .map(({ id, verdict }) => `${verdict} ${id}`)
    .join(", ");
