/** Manual moves of a box as seen by a person in front of it: right, back, up, turned. Matrices are rows of four. */

/** @typedef {number[][]} Matrix */
/**
 * Metres along the box's own axes, radians about its vertical.
 * @typedef {{ right: number, back: number, up: number, turn: number }} Shift
 */

/** @type {Shift} */
export const NOWHERE = { right: 0, back: 0, up: 0, turn: 0 };

/**
 * The pose shifted along its own axes, then turned about its own centre.
 * @param {Matrix} pose world_from_object
 * @param {Shift} shift
 * @returns {Matrix}
 */
export function moved(pose, { right, back, up, turn }) {
  const [c, s] = [Math.cos(turn), Math.sin(turn)];
  const rows = pose.slice(0, 3).map(([x = 0, y = 0, z = 0, at = 0]) => {
    return [c * x + s * y, c * y - s * x, z, at + right * x + back * y + up * z];
  });
  return [...rows, [0, 0, 0, 1]];
}

/**
 * Shift from one pose to the other; the inverse of `moved`.
 * @param {Matrix} from
 * @param {Matrix} to
 * @returns {Shift}
 */
export function shiftBetween(from, to) {
  /** @type {(matrix: Matrix, axis: number) => number[]} */
  const column = (matrix, axis) => matrix.slice(0, 3).map((row) => row[axis] ?? 0);
  const way = column(to, 3).map((value, k) => value - (column(from, 3)[k] ?? 0));
  const [x, y, z] = [0, 1, 2].map((axis) => column(from, axis));
  const aim = column(to, 0);
  return {
    right: dot(way, x),
    back: dot(way, y),
    up: dot(way, z),
    turn: Math.atan2(dot(aim, y), dot(aim, x)),
  };
}

/**
 * @param {number[] | undefined} a
 * @param {number[] | undefined} b
 */
function dot(a = [], b = []) {
  return a.reduce((sum, value, k) => sum + value * (b[k] ?? 0), 0);
}
