// @ts-check
/** Vectors, and matrices as WebGL takes them: column-major arrays of 16. */

/** @type {(list: ArrayLike<number>, index: number) => number} */
export function at(list, index) {
  return list[index] ?? 0;
}

/** @type {(a: ArrayLike<number>, b: ArrayLike<number>) => number[]} */
export function product(a, b) {
  return Array.from({ length: 16 }, (_, k) => {
    const [column, row] = [k >> 2, k & 3];
    let sum = 0;
    for (let i = 0; i < 4; i += 1)
      sum += at(a, i * 4 + row) * at(b, column * 4 + i);
    return sum;
  });
}

/** @type {(m: ArrayLike<number>, p: number[]) => number[]} */
export function apply(m, [x = 0, y = 0, z = 0]) {
  return [0, 1, 2].map(
    (r) => at(m, r) * x + at(m, 4 + r) * y + at(m, 8 + r) * z + at(m, 12 + r),
  );
}

/** @type {(m: ArrayLike<number>, v: number[]) => number[]} rotation transposed */
export function unturn(m, v) {
  return [0, 1, 2].map((c) =>
    dot([at(m, c * 4), at(m, c * 4 + 1), at(m, c * 4 + 2)], v),
  );
}

/** @type {(a: number[], b: number[]) => number} */
export function dot(a, b) {
  return a.reduce((sum, value, k) => sum + value * at(b, k), 0);
}

/** @type {(a: number[], b: number[], s?: number) => number[]} */
export function plus(a, b, s = 1) {
  return a.map((value, k) => value + s * at(b, k));
}

/** @type {(a: number[], b: number[]) => number[]} */
export function cross([a = 0, b = 0, c = 0], [d = 0, e = 0, f = 0]) {
  return [b * f - c * e, c * d - a * f, a * e - b * d];
}

/** @type {(v: number[]) => number[]} */
export function unit(v) {
  return v.map((value) => value / Math.hypot(...v));
}

/**
 * What a joint does to its body at a position.
 * @param {import("./scene.d.ts").Joint} joint
 * @param {number} value
 */
export function motion({ kind, axis: [x = 0, y = 0, z = 0] }, value) {
  if (kind === "prismatic")
    return [
      ...[1, 0, 0, 0],
      ...[0, 1, 0, 0],
      ...[0, 0, 1, 0],
      ...[x * value, y * value, z * value, 1],
    ];
  const [c, s] = [Math.cos(value), Math.sin(value)];
  const t = 1 - c;
  return [
    ...[t * x * x + c, t * x * y + s * z, t * x * z - s * y, 0],
    ...[t * x * y - s * z, t * y * y + c, t * y * z + s * x, 0],
    ...[t * x * z + s * y, t * y * z - s * x, t * z * z + c, 0],
    ...[0, 0, 0, 1],
  ];
}
