/** Evidence for an object's placement: figures of the alignment and the fit, and findings of the certificate. */

import { h } from "../dom.js";
import { findingList } from "../elements/results.js";
import { findingsAbout } from "../lib/findings.js";
import { centimetres } from "../lib/format.js";
import { motionOf } from "../lib/joints.js";
import { sourceChip } from "../source-chip.js";

/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */
/** @typedef {import("../api-types").Certificate} Certificate */
/** @typedef {import("../api-types").SceneItem} SceneItem */
/** @typedef {NonNullable<CandidateGroup["placement"]>} Placement */

/**
 * @param {Placement} placement
 * @param {SceneItem | undefined} item
 * @param {boolean} old whether the object was changed since
 */
export function placement(placement, item, old) {
  /** @type {[string, string][]} */
  const rows = [
    ["Placed by", placement.method],
    ["To the scan", placement.rms_m === null ? "no depth" : `${(1000 * placement.rms_m).toFixed(1)} mm rms`],
    ["Silhouette", `${(100 * placement.mask_iou).toFixed(0)} % overlap`],
    ["Keypoints", `${placement.inliers} of ${placement.matches} agree`],
    ["Uncertainty", held(placement.spread)],
    ["Next orientation", nextOrientation(placement)],
  ];
  if (item) rows.push(["W × D × H", `${item.dimensions_m.map(centimetres).join(" × ")} cm`]);
  if (item?.warp_residual_m)
    rows.push(["Front corners", `${(1000 * item.warp_residual_m).toFixed(1)} mm from the scan after the fit`]);
  return h(
    "div",
    { class: old ? "stack old" : "stack" },
    placement.unsure ? h("span", { class: "chip warn" }, "unsure: check it against the photos") : "",
    h("dl", { class: "facts" }, ...rows.flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, value)])),
    ...joints(item),
    ...[...placement.warnings, ...(item?.warnings ?? [])].map((warning) => h("p", { class: "muted" }, warning)),
  );
}

/** Uncertainty of the pose at 95 %. @param {Placement["spread"]} spread */
function held(spread) {
  if (!spread) return "not measured";
  const { shift_m, turn_deg, scale } = spread;
  return `± ${(2000 * shift_m).toFixed(0)} mm, ± ${(2 * turn_deg).toFixed(1)}°, ± ${(200 * scale).toFixed(1)} %`;
}

/** Score of the next best orientation. @param {Placement} placement */
function nextOrientation({ runner_up, runner_up_turn_deg }) {
  if (runner_up === null) return "no other one fits";
  const turned = runner_up_turn_deg === null ? "" : `, turned ${runner_up_turn_deg.toFixed(0)}°`;
  return `${(100 * runner_up).toFixed(0)} % as good${turned}`;
}

/** Sources of the numbers of each joint. @param {SceneItem | undefined} item */
function joints(item) {
  return (item?.joints ?? []).map((joint) => {
    const chips = Object.entries(joint.sources).map(([what, source]) => sourceChip(source, { of: what }));
    return h("div", { class: "chips" }, h("span", {}, motionOf(joint)), ...chips);
  });
}

/**
 * Findings of the certificate about one object, whose links and joints begin with the object's name.
 * @param {Certificate | null} certificate
 * @param {string} name
 * @param {string[]} names of all objects
 * @param {boolean} old whether the object was changed since
 */
export function findingsOf(certificate, name, names, old) {
  const mine = findingsAbout(certificate, name, names);
  return mine.length ? h("div", { class: old ? "old" : "" }, findingList(mine)) : "";
}
