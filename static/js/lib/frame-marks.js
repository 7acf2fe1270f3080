/** Marks drawn over a frame in screen coordinates: clicks, comments, the box being drawn, the crosshair. */

const DARK = "#10131a";
const BRIGHT = "#ffe14d";
const WHITE = "#ffffff";
const AWAY = "#d0241b";
const RADIUS = 9;
const GRIP = 11;

/** @typedef {{ x: number, y: number }} At */
/** @typedef {{ colour: string, label: number, current: boolean }} Click */

/**
 * A click: plus or minus, never colour alone.
 * @param {CanvasRenderingContext2D} context
 * @param {At} at
 * @param {Click} click
 */
export function drawClick(context, { x, y }, { colour, label, current }) {
  context.globalAlpha = current ? 1 : 0.55;
  context.beginPath();
  context.arc(x, y, RADIUS, 0, 2 * Math.PI);
  context.fillStyle = label ? colour : WHITE;
  context.fill();
  stroke(context, 2.5, label ? WHITE : AWAY);
  context.beginPath();
  context.moveTo(x - 4, y);
  context.lineTo(x + 4, y);
  if (label) {
    context.moveTo(x, y - 4);
    context.lineTo(x, y + 4);
  }
  stroke(context, 2, label ? DARK : AWAY);
  context.globalAlpha = 1;
}

/**
 * Label of a mask: its object's number in the list, and its name where requested.
 * @param {CanvasRenderingContext2D} context
 * @param {At} at
 * @param {string} text
 * @param {[number, number, number]} colour
 */
export function drawTag(context, { x, y }, text, [red, green, blue]) {
  context.font = "600 12px system-ui, sans-serif";
  const width = context.measureText(text).width + 12;
  context.beginPath();
  context.roundRect(x - width / 2, y - 9, width, 18, 5);
  context.fillStyle = "rgb(16 19 26 / 82%)";
  context.fill();
  stroke(context, 1.5, `rgb(${red} ${green} ${blue})`);
  context.fillStyle = WHITE;
  context.fillText(text, x - width / 2 + 6, y + 4);
}

/**
 * Place of a label on the screen: above a click that it would cover.
 * @param {At} at
 * @param {At[]} clicks
 * @returns {At}
 */
export function clearOf(at, clicks) {
  const covered = clicks.find(({ x, y }) => Math.abs(x - at.x) < 2 * RADIUS && Math.abs(y - at.y) < 2 * RADIUS);
  return covered ? { x: at.x, y: covered.y - 2 * RADIUS - 3 } : at;
}

/**
 * A comment: a speech bubble whose tip is the spot.
 * @param {CanvasRenderingContext2D} context
 * @param {At} at
 */
export function drawPin(context, { x, y }) {
  context.beginPath();
  context.moveTo(x, y);
  context.lineTo(x + 5, y - 8);
  context.roundRect(x - 2, y - 26, 24, 18, 5);
  context.fillStyle = BRIGHT;
  context.fill();
  stroke(context, 1.5, DARK);
  context.fillStyle = DARK;
  for (const dot of [4, 10, 16]) context.fillRect(x + dot - 1, y - 18, 3, 3);
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {At} from
 * @param {At} to
 */
export function drawBox(context, from, to) {
  context.beginPath();
  context.rect(from.x, from.y, to.x - from.x, to.y - from.y);
  stroke(context, 3, DARK);
  stroke(context, 1.5, BRIGHT);
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {At} at
 */
export function drawCrosshair(context, { x, y }) {
  context.beginPath();
  context.moveTo(x - 18, y);
  context.lineTo(x + 18, y);
  context.moveTo(x, y - 18);
  context.lineTo(x, y + 18);
  stroke(context, 4, "#000000");
  stroke(context, 2, BRIGHT);
}

/**
 * Whether a drawn click is under a press.
 * @param {At} drawn
 * @param {At} pressed
 */
export function isOnClick(drawn, pressed) {
  return Math.hypot(drawn.x - pressed.x, drawn.y - pressed.y) <= GRIP;
}

/**
 * Whether a comment's bubble is under a press.
 * @param {At} tip
 * @param {At} pressed
 */
export function isOnPin(tip, pressed) {
  return pressed.x >= tip.x - 4 && pressed.x <= tip.x + 24 && pressed.y >= tip.y - 28 && pressed.y <= tip.y;
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {number} width
 * @param {string} style
 */
function stroke(context, width, style) {
  context.lineWidth = width;
  context.strokeStyle = style;
  context.stroke();
}

/**
 * A stroke as wide as its brush, or the outline of a lasso or polygon.
 * @param {CanvasRenderingContext2D} context
 * @param {{ x: number, y: number }[]} path on the screen
 * @param {{ tool: string, px: number }} brush
 */
export function drawPath(context, path, { tool, px }) {
  if (!path.length) return;
  const wide = tool === "brush" || tool === "eraser";
  context.save();
  context.lineCap = "round";
  context.lineJoin = "round";
  context.lineWidth = wide ? px : 2;
  context.strokeStyle = wide ? (tool === "eraser" ? "rgb(255 95 82 / 50%)" : "rgb(255 255 255 / 50%)") : "#ffffff";
  context.beginPath();
  for (const { x, y } of path) context.lineTo(x, y);
  context.stroke();
  if (!wide)
    for (const { x, y } of path.slice(0, tool === "polygon" ? undefined : 0)) context.strokeRect(x - 3, y - 3, 6, 6);
  context.restore();
}
