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
 * Zoom and pan with two fingers: the point between them stays between them.
 * @param {View} view
 * @param {{ x: number, y: number }[]} before positions of both fingers before
 * @param {{ x: number, y: number }[]} after positions of both fingers now
 * @param {number} least
 * @returns {View}
 */
export function pinch(view, before, after, least) {
  const [was, is] = [middle(before), middle(after)];
  const zoomed = zoom(view, spread(after) / Math.max(spread(before), 1), was, least);
  return { ...zoomed, x: zoomed.x + is.x - was.x, y: zoomed.y + is.y - was.y };
}

/** @param {{ x: number, y: number }[]} points */
function middle([a = { x: 0, y: 0 }, b = a]) {
  return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2 };
}

/** @param {{ x: number, y: number }[]} points */
function spread([a = { x: 0, y: 0 }, b = a]) {
  return Math.hypot(a.x - b.x, a.y - b.y);
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

/**
 * Whether a position is in the image.
 * @param {{ x: number, y: number }} position
 * @param {Size} image
 */
export function isInside({ x, y }, image) {
  return x >= 0 && y >= 0 && x < image.width && y < image.height;
}

/**
 * The nearest position in the image.
 * @param {{ x: number, y: number }} position
 * @param {Size} image
 */
export function clamped({ x, y }, image) {
  return { x: Math.min(Math.max(x, 0.5), image.width - 0.5), y: Math.min(Math.max(y, 0.5), image.height - 0.5) };
}
