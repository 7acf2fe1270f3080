/** True lengths: parsing of typed lengths, error of the scan and effects of a rescale in words; no DOM. */

/** @typedef {import("../api-types").TrueLengths} TrueLengths */

/** @type {Record<string, number>} */
const UNITS = { mm: 0.001, cm: 0.01, m: 1 };

/**
 * Parse a length as "596", "596 mm", "59.6 cm" or "0.596 m", followed by a description; null if invalid.
 * @param {string} typed
 * @returns {{ metres: number, text: string } | null}
 */
export function parseLength(typed) {
  const found = /^\s*(\d+(?:[.,]\d+)?)\s*(mm|cm|m)?(?![a-z])[\s,:]*(.*?)\s*$/is.exec(typed);
  if (!found) return null;
  const unit = UNITS[found[2]?.toLowerCase() ?? "mm"] ?? 0;
  const metres = Number((found[1] ?? "").replace(",", ".")) * unit;
  return metres > 0.005 && metres <= 100 ? { metres, text: found[3] ?? "" } : null;
}

/** @param {{ metres: number, error_m: number | null, compared: boolean }} length */
export function offBy({ metres, error_m: error, compared }) {
  if (error === null) return "not in the scene now";
  const mm = Math.round(1000 * error);
  const off = mm === 0 ? "as measured" : `${mm > 0 ? "+" : "−"}${Math.abs(mm)} mm, ${signedPercent(error / metres)}`;
  return compared ? off : `${off} (typed or a default: does not affect the scale)`;
}

/**
 * Effects of a rescale in words, to be shown before it.
 * @param {TrueLengths} all
 * @param {{ name: string, dimensions_m: number[] }[]} items
 */
export function rescaleNotes({ lengths, scale, scale_wanted: wanted, mean_error, mean_error_scaled }, items) {
  if (wanted === null) return [];
  const factor = wanted / scale;
  const supporting = lengths.filter(({ compared }) => compared).length;
  const moved = items
    .toSorted((a, b) => Math.max(...b.dimensions_m) - Math.max(...a.dimensions_m))
    .slice(0, 3)
    .map(
      ({ name, dimensions_m }) =>
        `${name} ${mm(Math.max(...dimensions_m))} → ${mm(factor * Math.max(...dimensions_m))} mm`,
    );
  return [
    `Every length of the recording changes by ${signedPercent(factor - 1)}: depth, the camera's path, all objects.`,
    ...(moved.length ? [`The longest sides become: ${moved.join(", ")}.`] : []),
    `The true lengths are off by ${percent(mean_error)} on average, and by ${percent(mean_error_scaled)} afterwards.`,
    ...(supporting === 1 ? ["Only one true length supports this: measure another one, in another direction."] : []),
    "The recording is read again; clicks stay, masks and results are computed anew.",
    "Sizes and places that somebody typed stay as they were typed.",
  ];
}

/** @param {number} share */
function signedPercent(share) {
  return `${share >= 0 ? "+" : "−"}${(100 * Math.abs(share)).toFixed(1)} %`;
}

/** @param {number | null} share */
function percent(share) {
  return `${(100 * (share ?? 0)).toFixed(1)} %`;
}

/** @param {number} metres */
function mm(metres) {
  return Math.round(1000 * metres);
}
