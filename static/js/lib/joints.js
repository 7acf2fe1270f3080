/** Motion of a joint in words: the direction it slides, or the side of its hinge, as seen by a person facing the front. */

/** @typedef {import("../api-types").SceneItem} SceneItem */

/**
 * @param {SceneItem["joints"][number]} joint in the object's frame: x to the right, z up
 */
export function motionOf({ type, axis, origin }) {
  const [x = 0, y = 0, z = 0] = axis;
  if (type === "prismatic") {
    if (Math.abs(x) > Math.max(Math.abs(y), Math.abs(z))) return x > 0 ? "Slides right" : "Slides left";
    return Math.abs(z) > Math.abs(y) ? "Slides up" : "Slides out";
  }
  if (Math.abs(z) > Math.abs(x)) return (origin[0] ?? 0) < 0 ? "Hinged left" : "Hinged right";
  return (origin[2] ?? 0) < 0 ? "Hinged below" : "Hinged above";
}

/**
 * Correction that sets the upper limit of a joint, and its lower one to closed; null computes them again.
 * @param {import("../api-types").OverrideData} override
 * @param {string} joint
 * @param {boolean} alone whether the object has no other joint
 * @param {number | null} upper rad or m
 * @returns {Partial<import("../api-types").OverridePatch>}
 */
export function withLimit({ joints }, joint, alone, upper) {
  const lower = upper === null ? null : 0;
  if (alone) return { joint_lower: lower, joint_upper: upper };
  const { [joint]: _, ...others } = joints;
  return { joints: upper === null ? others : { ...others, [joint]: [0, upper] } };
}

/** Whether a joint slides along its front, as doors on tracks do. @param {SceneItem["joints"][number]} joint */
export function slidesSideways(joint) {
  return ["Slides left", "Slides right"].includes(motionOf(joint));
}
