/** Zoom and pan of an image in a box: screen = image * scale + offset. Positions are continuous; pixel i spans i..i+1. */

/** @typedef {{ scale: number, x: number, y: number }} View */
/** @typedef {{ width: number, height: number }} Size */

/**
 * The view that shows the whole image, centred.
 * @param {Size} image
 * @param {Size} box
 * @returns {View}
 */
export function fit(image, box) {
  const scale = Math.min(box.width / image.width, box.height / image.height);
  return { scale, x: (box.width - image.width * scale) / 2, y: (box.height - image.height * scale) / 2 };
}

/**
 * Zoom about a screen point, which keeps its place.
 * @param {View} view
 * @param {number} factor
 * @param {{ x: number, y: number }} at
 * @param {number} least
 * @returns {View}
 */
export function zoom(view, factor, at, least) {
  const scale = Math.min(Math.max(view.scale * factor, least), 40);
  const applied = scale / view.scale;
  return { scale, x: at.x - (at.x - view.x) * applied, y: at.y - (at.y - view.y) * applied };
}

/**
 * @param {View} view
 * @param {{ x: number, y: number }} screen
 */
export function toImage(view, screen) {
  return { x: (screen.x - view.x) / view.scale, y: (screen.y - view.y) / view.scale };
}

/**
 * @param {View} view
 * @param {{ x: number, y: number }} image
 */
export function toScreen(view, image) {
  return { x: image.x * view.scale + view.x, y: image.y * view.scale + view.y };
}
