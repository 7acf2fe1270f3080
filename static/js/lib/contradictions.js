/**
 * Contradictions of masks of one frame with each other or with their clicks. Masks cover what is visible, so that a pixel
 * belongs to one object. The run checks the same over many frames (r2c2r_core/segment/contradictions.py, the source of the
 * thresholds).
 */

import { decodeBox } from "./masks.js";

/** @typedef {import("../api-types").MaskBits} MaskBits */
/** @typedef {{ x: number, y: number, label: number }} Click in pixels of the mask */
/**
 * Object on a frame; `pixels` are those of its mask's box. An open front shows what lies behind it: its mask may hold others.
 * @typedef {{ object: number, name: string, mask: MaskBits, pixels: Uint8Array, clicks: Click[], isOpen: boolean }} Shown
 */
/**
 * Contradiction of an object; `other` is the object whose mask shares pixels with its mask.
 * @typedef {{ object: number, text: string, other?: number, mergesWith?: { object: number, name: string } }} Said
 */

const OVERLAP = 0.1; // of the smaller mask
const SAME = 0.5;
const NEAR = 0.01; // of the image's width: a click this near to a mask is on it

/**
 * Masks of a frame, decoded, with the clicks of their objects there.
 * @param {{ object: import("../api-types").SceneObject, mask: MaskBits }[]} masks
 * @param {{ index: number, width: number }} frame
 * @param {import("../api-types").Opening[]} openings
 * @returns {Promise<Shown[]>}
 */
export function shownOn(masks, { index, width }, openings) {
  const opened = openings.filter(({ states }) => states.some(({ frame, value }) => frame === index && value !== 0));
  const open = new Set(opened.map(({ object }) => object));
  return Promise.all(
    masks.flatMap(({ object, mask }) => {
      if (!mask.box_width) return [];
      const scale = mask.width / width;
      const here = object.points.filter((point) => point.frame === index);
      const clicks = here.map(({ x, y, label }) => ({ x: x * scale, y: y * scale, label }));
      const shown = { object: object.id, name: object.name, mask, clicks, isOpen: open.has(object.id) };
      return [decodeBox(mask).then((pixels) => ({ ...shown, pixels }))];
    }),
  );
}

/**
 * @param {Shown[]} shown on one frame
 * @returns {Said[]} each about one object
 */
export function contradictionsOn(shown) {
  const pairs = shown.flatMap((first, k) => shown.slice(k + 1).flatMap((second) => between(first, second)));
  return [...pairs, ...shown.flatMap(disobeyed)];
}

/**
 * Objects that were clicked on a frame but have no mask there, although segmentation is done.
 * @param {import("../api-types").SceneObject[]} objects
 * @param {number} frame
 * @param {(object: number) => boolean} isSeen whether it has a mask on the frame
 * @returns {Said[]}
 */
export function unseenOn(objects, frame, isSeen) {
  return objects
    .filter(({ id, segment, points, frames }) => {
      const clicked = points.some((point) => point.frame === frame && point.label === 1);
      const corrected = frames.some((said) => said.frame === frame); // a user corrected the mask there
      return segment === "done" && clicked && !corrected && !isSeen(id);
    })
    .map(({ id }) => ({
      object: id,
      text: "A click on it found no mask in this frame: remove the click, or click where the scan has depth",
    }));
}

/**
 * @param {Shown} first
 * @param {Shown} second
 * @returns {Said[]}
 */
function between(first, second) {
  if (first.isOpen || second.isOpen) return [];
  const smaller = Math.min(count(first.pixels), count(second.pixels));
  const share = smaller ? shared(first, second) / smaller : 0;
  if (share < OVERLAP) return [];
  const percent = Math.round(100 * share);
  /** @type {(one: Shown, other: Shown) => Said} */
  const said = (one, other) =>
    share >= SAME
      ? {
          object: one.object,
          other: other.object,
          text: `On the same thing as ${other.name} (${percent} % shared): merge or delete one, or right-click on the other`,
          mergesWith: { object: other.object, name: other.name },
        }
      : {
          object: one.object,
          other: other.object,
          text: `Shares ${percent} % with ${other.name} here: right-click where ${other.name} is`,
        };
  return [said(first, second), said(second, first)];
}

/**
 * @param {Shown} shown
 * @returns {Said[]}
 */
function disobeyed({ object, mask, pixels, clicks }) {
  const reach = Math.ceil(NEAR * mask.width);
  const missed = clicks.some((click) => click.label === 1 && !near(mask, pixels, click, reach));
  const taken = clicks.some((click) => click.label === 0 && near(mask, pixels, click, 0));
  return [
    ...(missed
      ? [{ object, text: "A click on it lies outside its mask: remove the click, or click nearer to its middle" }]
      : []),
    ...(taken ? [{ object, text: "A click off it lies inside its mask: click off it in a second place there" }] : []),
  ];
}

/** @param {Uint8Array} pixels */
const count = (pixels) => pixels.reduce((sum, pixel) => sum + pixel, 0);

/**
 * Number of pixels in both masks.
 * @param {Shown} first
 * @param {Shown} second
 */
function shared({ mask: a, pixels }, { mask: b, pixels: others }) {
  const [left, top] = [Math.max(a.left, b.left), Math.max(a.top, b.top)];
  const right = Math.min(a.left + a.box_width, b.left + b.box_width);
  const bottom = Math.min(a.top + a.box_height, b.top + b.box_height);
  let sum = 0;
  for (let y = top; y < bottom; y += 1)
    for (let x = left; x < right; x += 1) if (at(a, pixels, x, y) && at(b, others, x, y)) sum += 1;
  return sum;
}

/**
 * Whether the mask has a pixel within `reach` of the click.
 * @param {MaskBits} mask
 * @param {Uint8Array} pixels
 * @param {Click} click
 * @param {number} reach
 */
function near(mask, pixels, { x, y }, reach) {
  const [column, row] = [Math.floor(x), Math.floor(y)];
  for (let dy = -reach; dy <= reach; dy += 1)
    for (let dx = -reach; dx <= reach; dx += 1)
      if (dx * dx + dy * dy <= reach * reach && at(mask, pixels, column + dx, row + dy)) return true;
  return false;
}

/**
 * @param {MaskBits} mask
 * @param {Uint8Array} pixels
 * @param {number} x
 * @param {number} y
 */
function at({ left, top, box_width: width, box_height: height }, pixels, x, y) {
  const [column, row] = [x - left, y - top];
  return column >= 0 && row >= 0 && column < width && row < height && pixels[row * width + column] === 1;
}
