/** How large a panel beside the picture is, as a person left it. */

/**
 * @typedef {object} Panel
 * @property {string} name
 * @property {string} label what its bar is called
 * @property {"x" | "y"} along which way the bar moves
 * @property {1 | -1} grows as the bar moves right or down, or the other way
 * @property {number} least pixels; dragged to less than half of them it is folded
 * @property {number} most pixels
 */
/** @typedef {{ px: number | null, folded: boolean }} Size null: as the style sheet says */

/** @param {number} px where the bar was moved to @param {Panel} panel @returns {Size} */
export function moved(px, { least, most }) {
  if (px < least / 2) return { px: null, folded: true };
  return { px: Math.round(Math.min(Math.max(px, least), most)), folded: false };
}

/** What was kept; what nobody could have left there counts as nothing. @param {string | null} kept @param {Panel} panel @returns {Size} */
export function read(kept, { least, most }) {
  try {
    const { px, folded } = JSON.parse(kept ?? "{}");
    const fits = typeof px === "number" && px >= least && px <= most;
    return { px: fits ? px : null, folded: folded === true };
  } catch {
    return { px: null, folded: false };
  }
}
