/** Colours as hexadecimal text, and the choice of light or dark text for the better contrast on one. */

import { rgbOf } from "./masks.js";

const DARK = "#10131a";
const LIGHT = "#ffffff";

/** @param {string} colour #rrggbb */
export function inkOn(colour) {
  const ground = luminance(colour);
  return contrast(ground, luminance(LIGHT)) > contrast(ground, luminance(DARK)) ? LIGHT : DARK;
}

/** Colour #rrggbb of three components from 0 to 1. @param {number[]} shares */
export function hexOf(shares) {
  return `#${shares
    .map((share) =>
      Math.round(255 * share)
        .toString(16)
        .padStart(2, "0"),
    )
    .join("")}`;
}

/** Relative luminance, 0 to 1 (WCAG 2.2). @param {string} colour */
function luminance(colour) {
  const [red = 0, green = 0, blue = 0] = rgbOf(colour).map((level) => {
    const share = level / 255;
    return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
  });
  return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
}

/**
 * @param {number} a
 * @param {number} b
 */
function contrast(a, b) {
  return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
}
