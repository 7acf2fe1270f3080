/** Tape measure between two points clicked in the 3D view: length, level and upright parts, slope, heights above the floor. */

/** @typedef {number[]} Point in the world: metres, z up from the floor */

/**
 * Points with one added; a third point starts a new measurement.
 * @param {Point[]} points
 * @param {Point} point
 */
export function withPoint(points, point) {
  return points.length === 2 ? [point] : [...points, point];
}

/** Text of the measurement. @param {Point[]} points */
export function reading(points) {
  const [from, to] = points;
  if (!from) return "Click the first point";
  if (!to) return `${mm(from[2] ?? 0)} above the floor; click the second point`;
  const along = [0, 1, 2].map((k) => (to[k] ?? 0) - (from[k] ?? 0));
  const [dx = 0, dy = 0, dz = 0] = along;
  const heights = points.map((point) => mm(point[2] ?? 0)).join(" and ");
  const rise = (Math.atan2(Math.abs(dz), Math.hypot(dx, dy)) * 180) / Math.PI;
  return (
    `${mm(Math.hypot(dx, dy, dz))} long; ${mm(Math.hypot(dx, dy))} level, ${mm(Math.abs(dz))} up, ` +
    `${rise.toFixed(1)}° steep; ${heights} above the floor`
  );
}

/** @param {number} metres */
function mm(metres) {
  return `${Math.round(1000 * metres)} mm`;
}
