/** User marks of how far leaves stand open: a table of joints, each with its frames. */

/** @typedef {import("../api-types").OverrideData["states"]} States */

/**
 * Table with the mark of one frame set; null removes it. Marks under a joint's name move to that of its part, which is stable.
 * @param {States} states
 * @param {{ joint: string, part: string }} leaf
 * @param {number} frame
 * @param {number | null} state rad or m
 * @returns {States}
 */
export function withMark(states, { joint, part }, frame, state) {
  const { [joint]: byJoint = [], [part]: byPart = [], ...others } = states;
  const before = byJoint.length ? byJoint : byPart;
  const kept = before.filter((mark) => mark.frame !== frame);
  const marks = (state === null ? kept : [...kept, { frame, state }]).toSorted((a, b) => a.frame - b.frame);
  return marks.length ? { ...others, [part]: marks } : others;
}

/** Whether a user marked the state. @param {{ value: number | null, sigma: number | null } | undefined} state */
export const isMarked = (state) => Boolean(state && state.value !== null && state.sigma === null);
