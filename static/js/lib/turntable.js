/** Pictures of candidates from all sides, and how far one lies off another in words; no DOM. */

/** Pictures in a strip, as the server draws them. */
export const TURNS = 24;
const PX_A_TURN = 12; // of a drag, to the next picture

/**
 * @param {number} start the picture that was shown
 * @param {number} px by which a drag went to the right
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
