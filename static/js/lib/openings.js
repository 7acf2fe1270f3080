/** Movement of a front in the recording: its state in a frame in words, and its angle or travel over time. */

import { jointValue } from "./format.js";
import { isMarked } from "./opening-marks.js";

/** @typedef {import("../api-types").Opening} Opening */
/** @typedef {"closed" | "opening" | "open" | "unknown"} Phase */
/** @typedef {{ from: number, to: number, phase: Phase }} Span of positions in the list of frames, `to` exclusive */
/** @typedef {{ position: number, value: number, sigma: number, marked: boolean }} Reading */

const CLOSED = { revolute: 0.035, prismatic: 0.006 }; // 2 degrees, 6 mm: within the accuracy of states
const OPEN = 0.9; // of the widest state seen

/** @param {Opening} opening @param {number | null} value @returns {Phase} */
function phaseOf({ kind, largest }, value) {
  if (value === null) return "unknown";
  if (value <= CLOSED[kind]) return "closed";
  return value >= OPEN * largest ? "open" : "opening";
}

/**
 * @param {Opening} opening
 * @param {number} frame
 * @returns {string} empty where the frame does not show it
 */
export function stateIn(opening, frame) {
  const state = opening.states.find((one) => one.frame === frame);
  if (!state) return "";
  const phase = phaseOf(opening, state.value);
  if (state.value === null || phase === "closed") return phase;
  const spread = state.sigma === null ? "" : ` ± ${spreadOf(opening.kind, 2 * state.sigma)}`;
  return `${phase}, ${jointValue(opening.kind, state.value)}${spread}`;
}

/** State in a frame, and whether a user set it. @param {Opening} opening @param {number} frame */
export function stateSaid(opening, frame) {
  const by = isMarked(opening.states.find((one) => one.frame === frame)) ? ", set by a person" : "";
  return stateIn(opening, frame) + by;
}

/** @param {Opening["kind"]} kind @param {number} value */
const spreadOf = (kind, value) =>
  kind === "revolute"
    ? `${Math.max(Math.round((value * 180) / Math.PI), 1)}°`
    : `${Math.max(Math.round(1000 * value), 1)} mm`;

/** @param {Opening} opening @param {number[]} indices of the recording's frames @returns {Span[]} of frames that show it */
export function spansOf(opening, indices) {
  const states = new Map(opening.states.map((state) => [state.frame, state.value]));
  /** @type {Span[]} */
  const spans = [];
  indices.forEach((index, position) => {
    const value = states.get(index);
    if (value === undefined) return;
    const phase = phaseOf(opening, value);
    const last = spans.at(-1);
    if (last?.phase === phase && last.to === position) last.to = position + 1;
    else spans.push({ from: position, to: position + 1, phase });
  });
  return spans;
}

/** Known states with their positions. @param {Opening} opening @param {number[]} indices @returns {Reading[]} */
export function readings(opening, indices) {
  const at = new Map(indices.map((index, position) => [index, position]));
  return opening.states.flatMap(({ frame, value, sigma }) => {
    const position = at.get(frame);
    return value === null || position === undefined
      ? []
      : [{ position, value, sigma: sigma ?? 0, marked: sigma === null }];
  });
}
