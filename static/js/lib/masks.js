/** Decoding and drawing of the server's masks: base64 of zlib of packed bits of a bounding box. */

/** @typedef {import("../api-types").MaskBits} MaskBits */

/**
 * One byte per pixel of the box, 0 or 1, row by row.
 * @param {MaskBits} mask
 * @returns {Promise<Uint8Array>}
 */
export async function decodeBox(mask) {
  const count = mask.box_width * mask.box_height;
  const pixels = new Uint8Array(count);
  if (count === 0) return pixels;
  const packed = Uint8Array.from(atob(mask.bits), (character) => character.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bits = new Uint8Array(await new Response(stream).arrayBuffer());
  for (let i = 0; i < count; i += 1) pixels[i] = ((bits[i >> 3] ?? 0) >> (7 - (i & 7))) & 1;
  return pixels;
}

/**
 * RGBA of the box: the colour inside, an opaque rim, transparent outside.
 * @param {Uint8Array} pixels
 * @param {number} width
 * @param {number} height
 * @param {[number, number, number]} colour
 * @param {number} opacity 0..1
 * @returns {Uint8ClampedArray<ArrayBuffer>}
 */
export function paintBox(pixels, width, height, colour, opacity) {
  const rgba = new Uint8ClampedArray(width * height * 4);
  const fill = Math.round(opacity * 255);
  for (let y = 0; y < height; y += 1) {
    for (let x = 0; x < width; x += 1) {
      const i = y * width + x;
      if (!pixels[i]) continue;
      const rim =
        x === 0 ||
        y === 0 ||
        x === width - 1 ||
        y === height - 1 ||
        !pixels[i - 1] ||
        !pixels[i + 1] ||
        !pixels[i - width] ||
        !pixels[i + width];
      rgba[4 * i] = colour[0];
      rgba[4 * i + 1] = colour[1];
      rgba[4 * i + 2] = colour[2];
      rgba[4 * i + 3] = rim ? 255 : fill;
    }
  }
  return rgba;
}

/**
 * @param {string} hex "#rrggbb"
 * @returns {[number, number, number]}
 */
export function rgbOf(hex) {
  const value = Number.parseInt(hex.slice(1), 16);
  return [(value >> 16) & 255, (value >> 8) & 255, value & 255];
}
