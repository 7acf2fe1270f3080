/** Projection of an object's box into a camera. Matrices are rows of four, as the server sends them. */

/** @typedef {number[][]} Matrix */
/** @typedef {{ fx: number, fy: number, cx: number, cy: number, camera_from_world: Matrix }} Camera */

const EDGES = [0, 1, 2, 3].flatMap((k) => [
  [k, (k + 1) % 4],
  [k + 4, ((k + 1) % 4) + 4],
  [k, k + 4],
]);
export const NEAR_M = 0.05;

/**
 * The box's edges in pixels, front face first; those behind the camera are left out.
 * @param {Matrix} pose world_from_object
 * @param {number[]} size width, depth, height
 * @param {Camera} camera
 * @returns {{ from: [number, number], to: [number, number], front: boolean }[]}
 */
export function boxEdges(pose, size, camera) {
  const [w = 0, d = 0, h = 0] = size.map((side) => side / 2);
  const corners = [-d, d].flatMap((y) => [
    [-w, y, -h],
    [w, y, -h],
    [w, y, h],
    [-w, y, h],
  ]);
  const seen = corners.map((corner) => apply(camera.camera_from_world, apply(pose, corner)));
  return EDGES.flatMap(([a = 0, b = 0]) => {
    const [from, to] = [seen[a], seen[b]];
    if (!from || !to || (from[2] ?? 0) < NEAR_M || (to[2] ?? 0) < NEAR_M) return [];
    return [{ from: pixel(camera, from), to: pixel(camera, to), front: a < 4 && b < 4 }];
  });
}

/**
 * @param {Matrix} matrix
 * @param {number[]} point
 */
export function apply(matrix, [x = 0, y = 0, z = 0]) {
  return matrix.slice(0, 3).map(([a = 0, b = 0, c = 0, t = 0]) => a * x + b * y + c * z + t);
}

/**
 * @param {Camera} camera
 * @param {number[]} point in front of the camera
 * @returns {[number, number]}
 */
export function pixel(camera, [x = 0, y = 0, z = 1]) {
  return [(camera.fx * x) / z + camera.cx, (camera.fy * y) / z + camera.cy];
}
