/**
 * Drawing of an opening's lane: its angle or travel over the frames with twice its standard deviation; hatched where unknown, a
 * diamond where a user marked it.
 */

import { diamond } from "./diamond.js";
import { readings, spansOf } from "./openings.js";

/** @typedef {import("../api-types").Opening} Opening */

const MARGIN_PX = 4;
const MARK_PX = 4;

/**
 * @param {HTMLCanvasElement} canvas
 * @param {{ width: number, height: number }} size on the page
 * @param {{ opening: Opening, colour: string }} lane
 * @param {number[]} indices of the recording's frames
 * @param {number} position of the frame that is shown
 * @param {string} ink
 */
export function drawOpening(canvas, { width, height }, { opening, colour }, indices, position, ink) {
  const context = canvas.getContext("2d");
  if (!context || !width) return;
  canvas.width = Math.round(width * devicePixelRatio);
  canvas.height = Math.round(height * devicePixelRatio);
  context.scale(devicePixelRatio, devicePixelRatio);
  const step = width / Math.max(indices.length, 1);
  const most = Math.max(opening.largest, 1e-6);
  const x = (/** @type {number} */ at) => (at + 0.5) * step;
  const y = (/** @type {number} */ value) => height - MARGIN_PX - (value / most) * (height - 2 * MARGIN_PX);
  for (const { from, to, phase } of spansOf(opening, indices)) {
    context.globalAlpha = { closed: 0.12, opening: 0.3, open: 0.55, unknown: 0.12 }[phase];
    context.fillStyle = colour;
    context.fillRect(from * step, 0, (to - from) * step, height);
    if (phase === "unknown") hatch(context, from * step, to * step, height, ink);
  }
  const known = readings(opening, indices);
  context.globalAlpha = 0.35;
  context.fillStyle = ink;
  for (const { position: at, value, sigma } of known) {
    const [top, bottom] = [y(value + 2 * sigma), y(value - 2 * sigma)];
    context.fillRect(at * step, top, Math.max(step, 1), Math.max(bottom - top, 1));
  }
  context.globalAlpha = 1;
  context.strokeStyle = ink;
  context.lineWidth = 1.5;
  context.beginPath();
  known.forEach(({ position: at, value }, k) => {
    const gap = k === 0 || at - (known[k - 1]?.position ?? at) > 3; // not visible in between
    if (gap) context.moveTo(x(at) - step / 2, y(value));
    context.lineTo(x(at), y(value));
  });
  context.stroke();
  context.fillStyle = ink;
  for (const { position: at, value } of known.filter(({ marked }) => marked)) {
    diamond(context, x(at), y(value), MARK_PX);
    context.fill();
  }
  context.fillRect(x(position) - 1, 0, 2, height);
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {number} from
 * @param {number} to
 * @param {number} height
 * @param {string} ink
 */
function hatch(context, from, to, height, ink) {
  context.save();
  context.beginPath();
  context.rect(from, 0, to - from, height);
  context.clip();
  context.globalAlpha = 0.5;
  context.strokeStyle = ink;
  for (let x = from - height; x < to; x += 6) {
    context.beginPath();
    context.moveTo(x, height);
    context.lineTo(x + height, 0);
    context.stroke();
  }
  context.restore();
}
