/** Keyboard input of the page: keys of the active mode take precedence over the commands of the keymap. */

import { isForPage } from "../keyboard.js";
import { crosshairKey } from "./crosshair.js";

/**
 * @typedef {{
 *   canvas: import("../elements/frame-canvas.js").FrameCanvas, presses: import("./presses.js").Presses,
 *   painter: import("./painter.js").Painter, cropper: import("./cropper.js").Cropper,
 *   pane: import("./objects-pane.js").ObjectsPane, commands: import("../keyboard.js").Commands,
 * }} Parts
 */

/** @param {Parts} parts @param {AbortSignal} signal */
export function listenToKeys(parts, signal) {
  document.addEventListener("keydown", (event) => isForPage(event) && press(event, parts), { signal });
  document.addEventListener("keyup", (event) => release(event, parts), { signal });
}

/** @param {KeyboardEvent} event @param {Parts} parts */
function press(event, { canvas, presses, painter, cropper, pane, commands }) {
  if (event.key === "Escape" && presses.pinning) return void (presses.pinning = false);
  if (event.key === "Escape" && cropper.on) return void cropper.use();
  if (event.key === "Escape" && painter.tool) return painter.use(null);
  if (event.key === "Enter" && painter.close()) return event.preventDefault();
  if (pane.proposals.likeOne && likeKey(event, pane.proposals)) return event.preventDefault();
  if (event.key === " ") return (event.preventDefault(), void canvas.holdSpace(true)); // a tap plays, see release
  const click = (/** @type {0 | 1} */ label) =>
    canvas.crosshair && presses.click({ ...canvas.crosshair, label, hold: false });
  if (crosshairKey(event, canvas, click)) return event.preventDefault();
  commands.press(event);
}

/**
 * Handle a key while matches of an object are shown: Enter confirms one (with Shift all), Escape closes them.
 * @param {KeyboardEvent} event
 * @param {import("../elements/proposal-list.js").ProposalList} proposals
 * @returns {boolean} whether the key was handled
 */
function likeKey({ key, shiftKey, repeat }, proposals) {
  if (key === "Escape") proposals.findLike(null);
  else if (key === "Enter" && !repeat) shiftKey ? proposals.confirmAll() : proposals.confirm();
  return ["Escape", "Enter"].includes(key);
}

/** @param {KeyboardEvent} event @param {Parts} parts */
function release(event, { canvas, presses, commands }) {
  if (event.key.toLowerCase() === "t") canvas.showRaw(false);
  if (event.key === " " && isForPage(event) && !canvas.holdSpace(false)) commands.act("play");
  if (event.key === "Control" || event.key === "Meta") presses.release();
}
