/** Drawing of a proposal on a frame: a dashed outline over a dark one, visible on any image, and a chip with its name. */

import { toScreen } from "./view.js";

const CURRENT = "#ffe14d";
const OTHER = "#ffffff";
const CHIP_PX = 20;
const FONT = "600 12px system-ui, sans-serif";

/**
 * @param {CanvasRenderingContext2D} context
 * @param {import("./view.js").View} view
 * @param {{ points: number[][], handle: number[][], label: string, current: boolean }} outline
 */
export function drawOutline(context, view, { points, handle, label, current }) {
  const colour = current ? CURRENT : OTHER;
  context.save();
  for (const [shape, width] of /** @type {[number[][], number][]} */ ([
    [points, current ? 3 : 1.75],
    [handle, 1.25],
  ])) {
    if (shape.length < 3) continue;
    trace(context, view, shape);
    context.setLineDash([]);
    context.lineWidth = width + 2;
    context.strokeStyle = "rgb(0 0 0 / 55%)";
    context.stroke();
    context.setLineDash([7, 5]);
    context.lineWidth = width;
    context.strokeStyle = colour;
    context.stroke();
  }
  context.setLineDash([]);
  if (points.length) drawChip(context, chipPlace(view, points), label, colour);
  context.restore();
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {import("./view.js").View} view
 * @param {number[][]} shape
 */
function trace(context, view, shape) {
  context.beginPath();
  shape.forEach(([x = 0, y = 0], k) => {
    const at = toScreen(view, { x, y });
    if (k === 0) context.moveTo(at.x, at.y);
    else context.lineTo(at.x, at.y);
  });
  context.closePath();
}

/**
 * Position just inside the upper edge of the shape's box, where the chip hides neither the handle nor the middle.
 * @param {import("./view.js").View} view
 * @param {number[][]} points
 */
function chipPlace(view, points) {
  const xs = points.map(([x = 0]) => x);
  const ys = points.map(([, y = 0]) => y);
  const at = toScreen(view, {
    x: (Math.min(...xs) + Math.max(...xs)) / 2,
    y: Math.min(...ys),
  });
  return { x: at.x, y: Math.max(at.y, 0) + CHIP_PX / 2 + 4 };
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {{ x: number, y: number }} at
 * @param {string} label
 * @param {string} colour
 */
function drawChip(context, at, label, colour) {
  context.font = FONT;
  context.textAlign = "center";
  context.textBaseline = "middle";
  const width = context.measureText(label).width + 14;
  context.fillStyle = "rgb(10 12 16 / 82%)";
  context.beginPath();
  context.roundRect(at.x - width / 2, at.y - CHIP_PX / 2, width, CHIP_PX, 6);
  context.fill();
  context.fillStyle = colour;
  context.fillText(label, at.x, at.y + 0.5);
}
