/** Selection of the next proposal, and of the proposals with enough confidence. */

/** @typedef {import("../api-types").Proposal} Proposal */

/**
 * The proposal after (or before) the current one, wrapping around; the first (or last) when none is current.
 * @param {Proposal[]} items
 * @param {string | null} current
 * @param {1 | -1} step
 * @param {Set<string>} [without] ids to skip, about to be removed
 * @returns {Proposal | null}
 */
export function neighbour(items, current, step, without = new Set()) {
  const start = items.findIndex((item) => item.id === current);
  const first = start < 0 && step < 0 ? 0 : start;
  for (let k = 1; k <= items.length; k += 1) {
    const item = items[(first + k * step + items.length * 2) % items.length];
    if (item && !without.has(item.id)) return item;
  }
  return null;
}

/**
 * Proposals with enough confidence to be confirmed together, compared in whole percent as shown, and those left out despite
 * it: each has a doubt that a user should check.
 * @param {Proposal[]} items
 * @param {number} least confidence 0..1
 */
export function surest(items, least) {
  const sure = items.filter((item) => Math.round(100 * item.confidence) >= Math.round(100 * least));
  return { sure: sure.filter(({ doubts }) => !doubts.length), leftOut: sure.filter(({ doubts }) => doubts.length) };
}
