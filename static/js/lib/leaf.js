/** Pose and projection of a leaf at any opening, and the opening at which its edge is nearest to a pixel. */

import { apply, NEAR_M, pixel } from "./box-view.js";

/** @typedef {import("../api-types").Leaf} Leaf */
/** @typedef {import("./box-view.js").Camera} Camera */

const STEPS = 720; // over the range of its opening: a quarter of a degree each

/** Pose of a leaf in the world. @param {Leaf} leaf @param {number} value rad or m */
export function leafAt(leaf, value) {
  const columns = [0, 1, 2].map((k) => leaf.pose.map((row) => row[k] ?? 0));
  const ends = columns.map((way) => turned(leaf, value, way.slice(0, 3)));
  const at = moved(leaf, value, apply(leaf.pose, [0, 0, 0]));
  return [0, 1, 2].map((k) => [...ends.map((way) => way[k] ?? 0), at[k] ?? 0]).concat([[0, 0, 0, 1]]);
}

/**
 * Drag point of a leaf in a photo: on the edge that swings furthest, or in its middle if it slides; null behind the camera.
 * @param {Leaf} leaf
 * @param {number} value
 * @param {Camera} camera
 */
export function holdAt(leaf, value, camera) {
  const seen = apply(camera.camera_from_world, moved(leaf, value, hold(leaf)));
  return (seen[2] ?? 0) < NEAR_M ? null : pixel(camera, seen);
}

/**
 * Opening at which the drag point of a leaf is nearest to a pixel.
 * @param {Leaf} leaf
 * @param {Camera} camera
 * @param {number} x
 * @param {number} y
 */
export function openingAt(leaf, camera, x, y) {
  const values = Array.from({ length: STEPS + 1 }, (_, k) => (k * leaf.most) / STEPS);
  const away = values.map((value) => {
    const held = holdAt(leaf, value, camera);
    return held ? Math.hypot(held[0] - x, held[1] - y) : Infinity;
  });
  return values[away.indexOf(Math.min(...away))] ?? 0;
}

/** Drag point of the closed leaf. @param {Leaf} leaf @returns {number[]} in the world */
function hold(leaf) {
  const [w = 0, d = 0, h = 0] = leaf.size_m.map((side) => side / 2);
  if (leaf.type === "prismatic") return apply(leaf.pose, [0, -d, 0]);
  const edges = [
    [-w, -d, 0],
    [w, -d, 0],
    [0, -d, -h],
    [0, -d, h],
  ].map((point) => apply(leaf.pose, point));
  const far = edges.map((point) => length(cross(leaf.axis, less(point, leaf.pivot))));
  return edges[far.indexOf(Math.max(...far))] ?? [];
}

/** @param {Leaf} leaf @param {number} value @param {number[]} point in the world, of the closed leaf */
function moved(leaf, value, point) {
  if (leaf.type === "prismatic") return point.map((p, k) => p + value * (leaf.axis[k] ?? 0));
  return turned(leaf, value, less(point, leaf.pivot)).map((p, k) => p + (leaf.pivot[k] ?? 0));
}

/** Direction of the closed leaf after opening (Rodrigues). @param {Leaf} leaf @param {number} value @param {number[]} way */
function turned({ type, axis }, value, way) {
  if (type === "prismatic") return way;
  const [across, along] = [cross(axis, way), way.reduce((sum, p, k) => sum + p * (axis[k] ?? 0), 0)];
  const [cos, sin] = [Math.cos(value), Math.sin(value)];
  return way.map((p, k) => p * cos + (across[k] ?? 0) * sin + (axis[k] ?? 0) * along * (1 - cos));
}

/** @param {number[]} a @param {number[]} b */
const less = (a, b) => a.map((p, k) => p - (b[k] ?? 0));
/** @param {number[]} a */
const length = (a) => Math.hypot(...a);
/** @param {number[]} a @param {number[]} b */
const cross = ([a = 0, b = 0, c = 0], [x = 0, y = 0, z = 0]) => [b * z - c * y, c * x - a * z, a * y - b * x];
