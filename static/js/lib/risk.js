/** Risk of objects, to review the problematic ones first; no DOM. */

/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */
/** @typedef {import("../api-types").SceneItem} SceneItem */
/** @typedef {import("../api-types").Finding} Finding */
/** @typedef {{ score: number, why: string }} Risk */

const POOR_IOU = 0.8;
const FAR_M = 0.015;

/**
 * Risk of an object: its problems in words, and their total weight.
 * @param {CandidateGroup} group
 * @param {SceneItem | undefined} item of the finished scene
 * @param {Finding[]} findings of the certificate about it
 * @returns {Risk}
 */
export function riskOf({ placement }, item, findings) {
  const defaults = (item?.joints ?? []).flatMap(({ sources }) =>
    Object.entries(sources).filter(([, source]) => source === "default"),
  );
  /** @type {[number, boolean, string][]} weight, whether it applies, text */
  const table = [
    [8, !placement, "not placed"],
    [6, findings.some(({ severity }) => severity === "error"), "failed in the certificate"],
    [4, Boolean(placement?.unsure), "its place is unsure"],
    [3, placement !== null && placement.mask_iou < POOR_IOU, "its outline hardly fits the photos"],
    [3, (placement?.rms_m ?? 0) > FAR_M, "it is far from the measured depth"],
    [2, Boolean(item?.warnings.length), item?.warnings[0] ?? ""],
    [2, findings.some(({ severity }) => severity === "warning"), "warned of in the certificate"],
    [1, defaults.length > 0, `${[...new Set(defaults.map(([what]) => what))].join(", ")} by default`],
  ];
  const so = table.filter(([, is]) => is);
  return { score: so.reduce((sum, [weight]) => sum + weight, 0), why: so.map(([, , text]) => text).join("; ") };
}

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
