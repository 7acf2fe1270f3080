/** Motion of a joint in words: the direction it slides, or the side of its hinge, as seen by a person facing the front. */

import { jointValue } from "./format.js";

/** @typedef {import("../api-types").SceneItem} SceneItem */
/** @typedef {SceneItem["joints"][number]} Joint */

/** Origin of a joint's side, by its source. @type {Record<string, string>} */
const SIDE_FROM = {
  measured: ", seen open",
  inferred: ", by its handle or neighbours",
  default: ", a guess: usual for its category",
  person: ", set by a person",
};
/** Origin of a joint's upper limit, by its source. @type {Record<string, string>} */
const LIMIT_FROM = {
  measured: ", as seen",
  at_least: " or more: seen so far open",
  inferred: ", where something blocks it",
  default: ", usual for its category",
  person: ", set by a person",
};

/** A joint's motion and limit with their origins, in one line. @param {Joint} joint */
export function jointLine(joint) {
  const { type, upper, sources } = joint;
  const oneOfTwo = type === "revolute" ? motionOf(joint) !== "Hinged below" : slidesSideways(joint);
  const side = oneOfTwo ? (SIDE_FROM[sources.axis ?? ""] ?? "") : "";
  return `${motionOf(joint)}${side}; opens ${jointValue(type, upper)}${LIMIT_FROM[sources.limits ?? ""] ?? ""}`;
}

/**
 * Note that a hinge side given by a person is the one that the handle is on; empty otherwise.
 * @param {import("../api-types").OverrideData["hinge"]} hinge
 * @param {Joint[]} joints
 */
export function handleAtHinge(hinge, joints) {
  const [joint] = joints;
  if (!hinge || joints.length !== 1 || joint?.type !== "revolute" || !joint.handle) return "";
  const [x = 0, , z = 0] = joint.handle;
  const side = { left: x < 0, right: x > 0, bottom: z < 0, top: z > 0 }[hinge];
  return side ? `Its handle is on the hinge's side (${hinge}): is that right?` : "";
}

/** @param {Joint} joint in the object's frame: x to the right, z up */
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

/** Whether a joint slides along its front, as doors on tracks do. @param {Joint} joint */
export function slidesSideways(joint) {
  return ["Slides left", "Slides right"].includes(motionOf(joint));
}
