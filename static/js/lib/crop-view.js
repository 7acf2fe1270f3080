/** Position and size of a photo on the screen so that an object, or the whole photo, fills the view. */

import { fit } from "./view.js";

/** @typedef {{ width: number, height: number }} Size */

const MARGIN = 0.25; // around the object, as a share of its size
const LEAST = 0.15; // smallest share of the photo shown: a few pixels show too little

/**
 * @param {Size} photo
 * @param {Size} room
 * @param {number[] | null} box of the object as shares of the photo: left, top, right, bottom; null shows all
 * @returns {{ left: number, top: number, width: number, height: number }} of the whole photo, on the screen
 */
export function sheetOf(photo, room, box) {
  const [left = 0, top = 0, right = 1, bottom = 1] = box ? around(box) : [0, 0, 1, 1];
  const shown = { width: (right - left) * photo.width, height: (bottom - top) * photo.height };
  const { scale, x, y } = fit(shown, room);
  return {
    left: x - left * photo.width * scale,
    top: y - top * photo.height * scale,
    width: photo.width * scale,
    height: photo.height * scale,
  };
}

/** @param {number[]} box */
function around([left = 0, top = 0, right = 1, bottom = 1]) {
  const [width, height] = [
    Math.max((right - left) * (1 + 2 * MARGIN), LEAST),
    Math.max((bottom - top) * (1 + 2 * MARGIN), LEAST),
  ];
  const [x, y] = [(left + right) / 2, (top + bottom) / 2];
  return [
    Math.max(x - width / 2, 0),
    Math.max(y - height / 2, 0),
    Math.min(x + width / 2, 1),
    Math.min(y + height / 2, 1),
  ];
}
