/** Crop box in space, projected onto a photo: its edges, its six sides, and the effect of dragging a side. */

/** @typedef {import("../api-types").PromptsFileCrop} Crop */
/** @typedef {import("../api-types").FrameCamera} Camera */
/** @typedef {{ x: number, y: number }} At in pixels of the frame */
/**
 * Side of the box: perpendicular to edge `axis`, `away` from the corner or at it, with a `name` as seen in the photo. `at` is
 * its middle, `middle` that of the box, `perMetre` the shift in pixels of a metre outwards.
 * @typedef {{ axis: number, away: boolean, name: string, at: At, middle: At, perMetre: At, distance: number, extent: number }} Side
 */

const NEAR_M = 0.05;
const SMALLEST_M = 0.02;
const NAMES = /** @type {const} */ ([
  ["Left side", "Right side"],
  ["Top", "Bottom"],
  ["Front", "Back"],
]);

/**
 * The box's edges in pixels; those that reach behind the camera are left out.
 * @param {Crop} crop
 * @param {Camera} camera
 * @returns {{ from: At, to: At }[]}
 */
export function edges(crop, camera) {
  const found = [];
  for (const axis of [0, 1, 2]) {
    const [first = 0, second = 0] = [0, 1, 2].filter((other) => other !== axis);
    for (const a of [0, 1])
      for (const b of [0, 1]) {
        const share = [0, 0, 0];
        share[first] = a;
        share[second] = b;
        const from = seen(camera, within(crop, share));
        share[axis] = 1;
        const to = seen(camera, within(crop, share));
        if (from.z > NEAR_M && to.z > NEAR_M) found.push({ from: pixel(camera, from), to: pixel(camera, to) });
      }
  }
  return found;
}

/**
 * Sides of the box in front of the camera, farthest first.
 * @param {Crop} crop
 * @param {Camera} camera
 * @returns {Side[]}
 */
export function sides(crop, camera) {
  const called = axesAsSeen(crop, camera);
  const all = [0, 1, 2].flatMap((axis) => [false, true].map((away) => sideOf(crop, camera, axis, away, called)));
  return all.filter((side) => side !== null).toSorted((a, b) => b.distance - a.distance);
}

/**
 * The box with one side moved outwards by `metres`; it keeps a minimum thickness.
 * @param {Crop} crop
 * @param {{ axis: number, away: boolean }} side
 * @param {number} metres
 * @returns {Crop}
 */
export function moved(crop, { axis, away }, metres) {
  const edge = crop.edges_m[axis] ?? [1, 0, 0];
  const length = Math.hypot(...edge);
  const wanted = Math.max(length + metres, SMALLEST_M);
  const corner_m = away
    ? crop.corner_m
    : crop.corner_m.map((value, k) => value - ((edge[k] ?? 0) / length) * (wanted - length));
  const longer = edge.map((value) => (value / length) * wanted);
  return { corner_m: rounded(corner_m), edges_m: crop.edges_m.map((one, k) => (k === axis ? rounded(longer) : one)) };
}

/** Lengths of its edges in metres. @param {Crop} crop */
export const sizes = (crop) => crop.edges_m.map((edge) => Math.hypot(...edge));

/**
 * @param {Crop} crop
 * @param {Camera} camera
 * @param {number} axis
 * @param {boolean} away
 * @param {{ name: readonly [string, string], turned: boolean }[]} called
 * @returns {Side | null}
 */
function sideOf(crop, camera, axis, away, called) {
  const share = [0.5, 0.5, 0.5];
  share[axis] = away ? 1 : 0;
  const centre = seen(camera, within(crop, share));
  if (centre.z < NEAR_M) return null;
  const extent = sizes(crop)[axis] ?? 1;
  share[axis] = (share[axis] ?? 0) + (away ? 0.05 : -0.05) / extent; // 5 cm outwards
  const beyond = seen(camera, within(crop, share));
  const at = pixel(camera, centre);
  const to = beyond.z < NEAR_M ? at : pixel(camera, beyond);
  const { name, turned } = called[axis] ?? { name: NAMES[0], turned: false };
  return {
    axis,
    away,
    name: name[away === turned ? 0 : 1],
    at,
    middle: pixel(camera, seen(camera, within(crop, [0.5, 0.5, 0.5]))),
    perMetre: { x: (to.x - at.x) / 0.05, y: (to.y - at.y) / 0.05 },
    distance: centre.z,
    extent,
  };
}

/**
 * Names of the axes as seen from the camera: the most upright one is top and bottom, the more horizontal of the others is left
 * and right. `turned`: the side away from the corner has the first name.
 * @param {Crop} crop
 * @param {Camera} camera
 */
function axesAsSeen(crop, camera) {
  const ways = crop.edges_m.map((edge) =>
    turn(camera.camera_from_capture, edge).map((value) => value / Math.hypot(...edge)),
  );
  const most = (/** @type {number[]} */ among, /** @type {number} */ k) =>
    among.reduce((best, axis) => (Math.abs(ways[axis]?.[k] ?? 0) > Math.abs(ways[best]?.[k] ?? 0) ? axis : best));
  const upright = most([0, 1, 2], 1);
  const across = most(
    [0, 1, 2].filter((axis) => axis !== upright),
    0,
  );
  return [0, 1, 2].map((axis) => {
    const k = axis === upright ? 1 : axis === across ? 0 : 2;
    return { name: NAMES[k] ?? NAMES[0], turned: (ways[axis]?.[k] ?? 0) < 0 };
  });
}

/** @param {Crop} crop @param {number[]} share along each edge */
function within({ corner_m, edges_m }, share) {
  return corner_m.map((value, k) => edges_m.reduce((sum, edge, j) => sum + (share[j] ?? 0) * (edge[k] ?? 0), value));
}

/** @param {Camera} camera @param {number[]} point */
function seen({ camera_from_capture: matrix }, point) {
  const [x = 0, y = 0, z = 0] = turn(matrix, point).map((value, k) => value + (matrix[k]?.[3] ?? 0));
  return { x, y, z };
}

/** @param {number[][]} matrix @param {number[]} vector */
function turn(matrix, [x = 0, y = 0, z = 0]) {
  return matrix.slice(0, 3).map(([a = 0, b = 0, c = 0]) => a * x + b * y + c * z);
}

/** @param {Camera} camera @param {{ x: number, y: number, z: number }} point @returns {At} */
function pixel({ fx, fy, cx, cy }, { x, y, z }) {
  return { x: (fx * x) / z + cx, y: (fy * y) / z + cy };
}

/** @param {number[]} values */
const rounded = (values) => values.map((value) => Math.round(1e6 * value) / 1e6);
