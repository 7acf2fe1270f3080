/** Small point cloud, drawn without a GPU. */

/** @typedef {{ positions: Int16Array, colours: Uint8Array, radius: number }} Cloud */

/**
 * @param {{ count: number, xyz_mm: string, rgb: string }} wire base64 of int16 millimetres from the centre, and of bytes
 * @returns {Cloud}
 */
export function decodePoints(wire) {
  const positions = new Int16Array(bytesOf(wire.xyz_mm).buffer);
  let radius = 1;
  for (let k = 0; k < positions.length; k += 3) {
    radius = Math.max(radius, Math.hypot(positions[k] ?? 0, positions[k + 1] ?? 0, positions[k + 2] ?? 0));
  }
  return { positions, colours: bytesOf(wire.rgb), radius };
}

/**
 * Draw the points turned about the vertical, then tilted; nearer points hide farther ones. +Z is up.
 * @param {Cloud} cloud
 * @param {{ yaw: number, pitch: number }} turn
 * @param {{ data: Uint8ClampedArray, width: number, height: number }} picture
 */
export function project(cloud, { yaw, pitch }, picture) {
  const { width, height, data } = picture;
  const [cy, sy, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
  const scale = (0.48 * Math.min(width, height)) / cloud.radius;
  const nearest = new Float32Array(width * height).fill(Infinity);
  for (let k = 0; k < cloud.positions.length; k += 3) {
    const [x = 0, y = 0, z = 0] = cloud.positions.subarray(k, k + 3);
    const across = cy * x - sy * y;
    const away = sy * x + cy * y;
    const depth = cp * away - sp * z;
    const column = Math.round(width / 2 + scale * across);
    const row = Math.round(height / 2 - scale * (sp * away + cp * z));
    for (let dy = 0; dy < 2; dy += 1) {
      for (let dx = 0; dx < 2; dx += 1) {
        const at = (row + dy) * width + column + dx;
        if (column + dx < 0 || column + dx >= width || row + dy < 0 || row + dy >= height) continue;
        if (depth >= (nearest[at] ?? 0)) continue;
        nearest[at] = depth;
        data.set([cloud.colours[k] ?? 0, cloud.colours[k + 1] ?? 0, cloud.colours[k + 2] ?? 0, 255], 4 * at);
      }
    }
  }
}

/** @param {string} text base64 */
function bytesOf(text) {
  return Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
}
