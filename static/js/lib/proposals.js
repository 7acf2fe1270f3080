/** Selection of the next proposal, of the one at a spot, and of the proposals with enough confidence. */

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

/**
 * The proposal whose outline contains a spot of its frame; the smallest of several, as things stand before fronts.
 * @param {Proposal[]} items
 * @param {{ frame: number, x: number, y: number }} spot
 */
export function proposedAt(items, { frame, x, y }) {
  const there = items.filter((item) => item.frame === frame && contains(item.outline, x, y));
  return there.toSorted((a, b) => area(a.outline) - area(b.outline))[0];
}

/**
 * Whether a polygon contains a point: a ray from there crosses its border an odd number of times.
 * @param {number[][]} outline
 * @param {number} x
 * @param {number} y
 */
function contains(outline, x, y) {
  const crossed = sides(outline).filter(
    ([[x0, y0], [x1, y1]]) => y0 > y !== y1 > y && x < x0 + ((y - y0) / (y1 - y0)) * (x1 - x0),
  );
  return crossed.length % 2 === 1;
}

/** Area of a polygon (the shoelace formula). @param {number[][]} outline */
const area = (outline) =>
  Math.abs(sides(outline).reduce((sum, [[x0, y0], [x1, y1]]) => sum + x0 * y1 - x1 * y0, 0)) / 2;

/** @param {number[][]} outline @returns {[[number, number], [number, number]][]} */
const sides = (outline) =>
  outline.map(([x = 0, y = 0], k) => {
    const [x1 = 0, y1 = 0] = outline[(k + 1) % outline.length] ?? [];
    return [
      [x, y],
      [x1, y1],
    ];
  });
