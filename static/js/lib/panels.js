/** Size of a resizable panel, as the user left it. */

/**
 * @typedef {object} Panel
 * @property {string} name
 * @property {string} label label of its bar
 * @property {"x" | "y"} along which way the bar moves
 * @property {1 | -1} grows 1: as the bar moves right or down, -1: as it moves the other way
 * @property {number} least pixels; when dragged to less than half of that, it is folded
 * @property {number} most pixels
 */
/** @typedef {{ px: number | null, folded: boolean }} Size null: as set by the style sheet */

/** @param {number} px where the bar was moved to @param {Panel} panel @returns {Size} */
export function moved(px, { least, most }) {
  if (px < least / 2) return { px: null, folded: true };
  return { px: Math.round(Math.min(Math.max(px, least), most)), folded: false };
}

/** Stored size; one out of range or unreadable is ignored. @param {string | null} kept @param {Panel} panel @returns {Size} */
export function read(kept, { least, most }) {
  try {
    const { px, folded } = JSON.parse(kept ?? "{}");
    const fits = typeof px === "number" && px >= least && px <= most;
    return { px: fits ? px : null, folded: folded === true };
  } catch {
    return { px: null, folded: false };
  }
}
