/** Keys of the crosshair: arrows move it, plus and minus click at its position, Escape hides it. */

/** @type {Record<string, [number, number]>} */
const MOVES = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/**
 * @param {KeyboardEvent} event
 * @param {import("../elements/frame-canvas.js").FrameCanvas} canvas
 * @param {(label: 0 | 1) => void} click
 * @returns {boolean} whether the key was the crosshair's
 */
export function crosshairKey(event, canvas, click) {
  if (!canvas.crosshair) return false;
  const move = MOVES[event.key];
  const reach = event.shiftKey ? 5 : 1;
  if (move) canvas.moveCrosshair(move[0] * reach, move[1] * reach);
  else if (event.key === "Escape") canvas.showCrosshair(false);
  else if (["+", "=", "-"].includes(event.key)) click(event.key === "-" ? 0 : 1);
  else return false;
  return true;
}
