/** Drawing of a lane: a bar where an object has a mask, hatched where doubtful, a diamond per click, a line at the position. */

import { diamond } from "./diamond.js";
import { runs } from "./lanes.js";

/**
 * Lane of an object; `frames` holds confidences by frame index.
 * @typedef {{ colour: string, frames: Map<number, number>, prompts: Set<number>, current: boolean }} LaneView
 */

const DIAMOND = 5;

/**
 * @param {HTMLCanvasElement} canvas
 * @param {{ width: number, height: number }} size on the page; measured once for all lanes, as scrubbing redraws them often
 * @param {LaneView} lane
 * @param {number[]} indices of the recording's frames
 * @param {number} position of the frame that is shown
 * @param {string} ink
 */
export function drawLane(canvas, { width, height }, lane, indices, position, ink) {
  const context = canvas.getContext("2d");
  if (!context || !width) return;
  canvas.width = Math.round(width * devicePixelRatio);
  canvas.height = Math.round(height * devicePixelRatio);
  context.scale(devicePixelRatio, devicePixelRatio);
  const step = width / Math.max(indices.length, 1);
  const middle = height / 2;
  context.globalAlpha = 0.18;
  context.fillStyle = lane.colour;
  context.fillRect(0, middle - 1, width, 2);
  context.globalAlpha = lane.current ? 1 : 0.75;
  const hatched = hatch(context, lane.colour);
  for (const { from, to, doubtful } of runs(indices.map((index) => lane.frames.get(index)))) {
    context.fillStyle = doubtful ? hatched : lane.colour;
    context.fillRect(from * step, 2, Math.max((to - from) * step, 1), height - 4);
  }
  context.globalAlpha = 1;
  indices.forEach((index, k) => lane.prompts.has(index) && drawDiamond(context, (k + 0.5) * step, middle));
  context.fillStyle = ink;
  context.fillRect((position + 0.5) * step - 1, 0, 2, height);
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {number} x
 * @param {number} y
 */
function drawDiamond(context, x, y) {
  diamond(context, x, y, DIAMOND);
  context.fillStyle = "#ffffff";
  context.fill();
  context.strokeStyle = "#10131a";
  context.stroke();
}

/**
 * Pattern of slanted lines in a colour.
 * @param {CanvasRenderingContext2D} context
 * @param {string} colour
 */
function hatch(context, colour) {
  const tile = new OffscreenCanvas(6, 6);
  const drawn = tile.getContext("2d");
  if (!drawn) return colour;
  drawn.strokeStyle = colour;
  drawn.lineWidth = 2;
  for (const x of [-3, 3]) {
    drawn.beginPath();
    drawn.moveTo(x, 6);
    drawn.lineTo(x + 6, 0);
    drawn.stroke();
  }
  return context.createPattern(tile, "repeat") ?? colour;
}
