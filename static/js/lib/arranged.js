/** Reading order of objects as seen from inside the room: walls from left to right, columns from top to bottom; no DOM. */

import { inOrder } from "./front-rows.js";

/** @typedef {import("../api-types").FoundFront} FoundFront */
/** @typedef {number[]} Vector */
/** @typedef {{ key: number, corner: Vector, width: number, height: number, right: Vector, down: Vector, away: Vector }} Placed */

const SAME_WALL = Math.cos((30 * Math.PI) / 180);

/**
 * Objects in reading order: those with a flat front first, the others in the given order.
 * @template {{ id: number }} T
 * @param {T[]} objects
 * @param {FoundFront[]} fronts
 * @returns {T[]}
 */
export function arranged(objects, fronts) {
  const wanted = new Set(objects.map(({ id }) => id));
  const placed = fronts.filter(({ object }) => wanted.has(object)).map(placedFront);
  const keys = toTheRight(walls(placed)).flatMap(read);
  const place = new Map(keys.map((key, k) => [key, k]));
  const last = keys.length;
  return objects.toSorted((a, b) => (place.get(a.id) ?? last) - (place.get(b.id) ?? last));
}

/** @param {FoundFront} front @returns {Placed} */
function placedFront({ object, corners_m }) {
  const [corner = [], second = [], , lowest = []] = corners_m;
  const [across, along] = [minus(second, corner), minus(lowest, corner)];
  const [width, height] = [Math.hypot(...across), Math.hypot(...along)];
  const [right, down] = [across.map((value) => value / width), along.map((value) => value / height)];
  return { key: object, corner, width, height, right, down, away: cross(right, down) };
}

/** Fronts grouped by the direction they face. @param {Placed[]} fronts @returns {Placed[][]} */
function walls(fronts) {
  /** @type {Placed[][]} */
  const found = [];
  for (const front of fronts) {
    const wall = found.find(([first]) => first && dot(first.away, front.away) > SAME_WALL);
    if (wall) wall.push(front);
    else found.push([front]);
  }
  return found;
}

/**
 * Walls in the order of a turn to the right, starting with the one that has no wall, or the widest gap, to its left.
 * @param {Placed[][]} all
 */
function toTheRight(all) {
  const first = all[0]?.[0];
  if (!first) return [];
  const turned = all
    .map((wall) => ({ wall, angle: turn(first, wall[0] ?? first) }))
    .toSorted((a, b) => a.angle - b.angle);
  const rooms = turned.map(({ angle }, k) => {
    const before = k ? (turned[k - 1]?.angle ?? 0) : (turned.at(-1)?.angle ?? 0) - 2 * Math.PI;
    return angle - before;
  });
  const start = rooms.indexOf(Math.max(...rooms));
  return [...turned.slice(start), ...turned.slice(0, start)].map(({ wall }) => wall);
}

/** Angle of the turn to the right from one front to another, in radians. @param {Placed} from @param {Placed} to */
const turn = (from, to) => Math.atan2(dot(to.away, from.right), dot(to.away, from.away));

/** @param {Placed[]} wall */
function read(wall) {
  const [first] = wall;
  if (!first) return [];
  const flat = wall.map(({ key, corner, width, height }) => {
    const [left, top] = [first.right, first.down].map((axis) => dot(corner, axis));
    return { key, rect: { left: left ?? 0, top: top ?? 0, right: (left ?? 0) + width, bottom: (top ?? 0) + height } };
  });
  return inOrder(flat).map(({ key }) => key);
}

/** @param {Vector} a @param {Vector} b */
const minus = (a, b) => a.map((value, k) => value - (b[k] ?? 0));

/** @param {Vector} a @param {Vector} b */
const dot = (a, b) => a.reduce((sum, value, k) => sum + value * (b[k] ?? 0), 0);

/** @param {Vector} a @param {Vector} b */
function cross([ax = 0, ay = 0, az = 0], [bx = 0, by = 0, bz = 0]) {
  return [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
}
