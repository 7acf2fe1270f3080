/** Things a person must decide about an object, to review the problematic ones first; no DOM. */

import { counted, jointValue } from "./format.js";

/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */
/** @typedef {import("../api-types").SceneItem} SceneItem */
/** @typedef {import("../api-types").Finding} Finding */
/** @typedef {{ score: number, decide: string[] }} Risk `decide`: what to decide, a line each, the most important first */

const POOR_IOU = 0.8;
const FAR_M = 0.015;

/**
 * Risk of an object: what a person must decide about it, and the total weight of that.
 * @param {CandidateGroup} group
 * @param {SceneItem | undefined} item of the finished scene
 * @param {Finding[]} findings of the certificate about it
 * @returns {Risk}
 */
export function riskOf({ placement }, item, findings) {
  const failed = findings.find(({ severity }) => severity === "error");
  const warned = findings.filter(({ severity }) => severity === "warning").length;
  const guessed = item?.joints.find(({ sources }) => sources.limits === "default");
  /** @type {[number, boolean, string][]} weight, whether it applies, text */
  const table = [
    [8, !placement, "Not placed: correct its masks, or upload a mesh"],
    [6, failed !== undefined, `The simulation test failed: ${failed?.message}`],
    [4, Boolean(placement?.unsure), placement?.warnings[0] ?? "Is it in the right place? Check the photos"],
    [
      3,
      placement !== null && placement.mask_iou < POOR_IOU,
      `Only ${percent(placement?.mask_iou)} of its outline fits`,
    ],
    [3, (placement?.rms_m ?? 0) > FAR_M, `It is ${millimetres(placement?.rms_m)} away from the measured depth`],
    ...(item?.warnings ?? []).map(
      (warning) => /** @type {[number, boolean, string]} */ ([2, true, alone(warning, item)]),
    ),
    [1, guessed !== undefined, guessed ? `Opens ${opening(guessed)}? Not seen` : ""],
    [1, warned > 0, `${counted(warned, "warning")} of the simulation test`],
  ];
  const so = table.filter(([, is]) => is);
  return { score: so.reduce((sum, [weight]) => sum + weight, 0), decide: so.map(([, , text]) => text) };
}

/** A warning without the name of the object's only joint before it. @param {string} text @param {SceneItem | undefined} item */
function alone(text, item) {
  const [joint, ...others] = item?.joints ?? [];
  if (!joint || others.length || !text.startsWith(`${joint.name} `)) return text;
  const rest = text.slice(joint.name.length + 1);
  return rest.slice(0, 1).toUpperCase() + rest.slice(1);
}

const percent = (/** @type {number} */ share = 0) => `${(100 * share).toFixed(0)} %`;
const millimetres = (/** @type {number | null} */ metres = 0) => `${(1000 * (metres ?? 0)).toFixed(0)} mm`;
const opening = (/** @type {SceneItem["joints"][number]} */ { type, upper }) => jointValue(type, upper);

/**
 * Objects with the highest risk first; equal ones stay in order. Accepting an object does not move it in the list.
 * @template {{ object: number }} T
 * @param {T[]} groups
 * @param {Map<number, Risk>} risks
 */
export function riskiestFirst(groups, risks) {
  const score = (/** @type {T} */ { object }) => risks.get(object)?.score ?? 0;
  return groups.toSorted((a, b) => score(b) - score(a));
}
