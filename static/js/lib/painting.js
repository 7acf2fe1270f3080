/** Masks for painting: one byte per pixel of a whole frame, at any size; no DOM. */

/** @typedef {import("../api-types").MaskBits} MaskBits */
/** @typedef {{ width: number, height: number, pixels: Uint8Array }} Mask */

/**
 * The mask of a whole frame, from the bytes of its box.
 * @param {MaskBits} box
 * @param {Uint8Array} inside
 * @returns {Mask}
 */
export function wholeMask({ width, height, left, top, box_width, box_height }, inside) {
  const pixels = new Uint8Array(width * height);
  for (let y = 0; y < box_height; y++)
    pixels.set(inside.subarray(y * box_width, (y + 1) * box_width), (top + y) * width + left);
  return { width, height, pixels };
}

/** Whether no pixel is set. @param {Mask} mask */
export const isEmpty = ({ pixels }) => !pixels.includes(1);

/**
 * Run lengths, alternately off and on, starting with off, row by row, as in prompts.json.
 * @param {Mask} mask
 */
export function runsOf({ width, height, pixels }) {
  /** @type {number[]} */
  const runs = [];
  let on = 0;
  let length = 0;
  for (const pixel of pixels) {
    if (Number(pixel > 0) === on) length += 1;
    else {
      runs.push(length);
      on = 1 - on;
      length = 1;
    }
  }
  return { width, height, runs: [...runs, length] };
}

/**
 * Mask in the server's format: zlib of packed bits, here of the whole frame; an empty box if no pixel is set.
 * @param {Mask} mask
 * @returns {Promise<MaskBits>}
 */
export async function encoded(mask) {
  const { width, height, pixels } = mask;
  if (isEmpty(mask)) return { width, height, left: 0, top: 0, box_width: 0, box_height: 0, bits: "" };
  const packed = new Uint8Array(Math.ceil(pixels.length / 8));
  for (let i = 0; i < pixels.length; i++) if (pixels[i]) packed[i >> 3] = (packed[i >> 3] ?? 0) | (128 >> (i & 7));
  const stream = new Blob([packed]).stream().pipeThrough(new CompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const bits = btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
  return { width, height, left: 0, top: 0, box_width: width, box_height: height, bits };
}
