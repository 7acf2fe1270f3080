/** Turntable images of candidates, and the deviation of one from another in words; no DOM. */

/** Number of images in a strip, as rendered by the server. */
export const TURNS = 24;
const PX_A_TURN = 12; // drag distance to the next image

/**
 * @param {number} start image shown at the start
 * @param {number} px distance dragged to the right
 */
export function turnedBy(start, px) {
  return start + Math.round(px / PX_A_TURN);
}

/**
 * @param {{ share: number, most: number }} found
 * @param {{ against: string, longest_m: number | null } | null} all
 */
export function differs({ share, most }, all) {
  const far = all?.longest_m
    ? `${Math.round(1000 * most * all.longest_m)} mm`
    : `${Math.round(100 * most)} % of its longest side`;
  const name = all?.against ?? "";
  const part = Math.round(100 * share);
  return part
    ? `Differs from ${name} on ${part} % of its surface, by ${far} at most.`
    : `Almost the same as ${name}: ${far} at most.`;
}
