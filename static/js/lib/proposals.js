/** Which proposal comes next, and which are sure enough. */

/** @typedef {import("../api-types").Proposal} Proposal */

/**
 * The proposal after (or before) the current one, round the end; the first (or last) when none is current.
 * @param {Proposal[]} items
 * @param {string | null} current
 * @param {1 | -1} step
 * @param {Set<string>} [without] ids that are about to go
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
 * Those sure enough to be confirmed together, in whole percent as they are shown, and those left out though they are that sure:
 * something speaks against each, which a person should look at.
 * @param {Proposal[]} items
 * @param {number} least confidence 0..1
 */
export function surest(items, least) {
  const sure = items.filter((item) => Math.round(100 * item.confidence) >= Math.round(100 * least));
  return { sure: sure.filter(({ doubts }) => !doubts.length), leftOut: sure.filter(({ doubts }) => doubts.length) };
}
