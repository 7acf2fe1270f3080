/** Evidence for an object: what a person must decide, its joints and findings, and the figures of its placement. */

import { h } from "../dom.js";
import { findingList } from "../elements/results.js";
import { findingsAbout } from "../lib/findings.js";
import { centimetres } from "../lib/format.js";
import { handleAtHinge, jointLine } from "../lib/joints.js";

/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */
/** @typedef {import("../api-types").Certificate} Certificate */
/** @typedef {import("../api-types").SceneItem} SceneItem */
/** @typedef {NonNullable<CandidateGroup["placement"]>} Placement */

/**
 * What to decide, a line each, and the joints.
 * @param {CandidateGroup} group
 * @param {SceneItem | undefined} item
 * @param {string[]} decide
 * @param {boolean} old whether the object was changed since
 */
export function decisions({ override }, item, decide, old) {
  const joints = item?.joints ?? [];
  const beside = handleAtHinge(override.hinge, joints);
  return [
    beside && h("p", { class: "chip warn", role: "status" }, beside),
    decide.length
      ? h("ul", { class: old ? "decide old" : "decide", "aria-label": "To decide" }, ...lines("li", decide))
      : "",
    joints.length
      ? h("div", { class: old ? "joint-lines old" : "joint-lines" }, ...lines("p", joints.map(jointLine)))
      : "",
  ];
}

/** @param {"li" | "p"} tag @param {string[]} texts */
function lines(tag, texts) {
  return texts.map((text) => h(tag, {}, text));
}

/**
 * Figures of the placement.
 * @param {Placement} placement
 * @param {SceneItem | undefined} item
 * @param {boolean} old whether the object was changed since
 */
export function placement(placement, item, old) {
  const { matches, inliers } = placement;
  /** @type {[string, string][]} */
  const rows = [
    ["Placed by", placedBy(placement)],
    ["To the scan", placement.rms_m === null ? "no depth" : `${(1000 * placement.rms_m).toFixed(1)} mm rms`],
    ["Silhouette", `${(100 * placement.mask_iou).toFixed(0)} % overlap`],
    ["Uncertainty", held(placement.spread)],
  ];
  if (matches) rows.push(["Keypoints", `${inliers} of ${matches} agree`]);
  if (placement.runner_up !== null) rows.push(["Next best turn", nextTurn(placement)]);
  if (item) rows.push(["W × D × H", `${item.dimensions_m.map(centimetres).join(" × ")} cm`]);
  if (item?.warp_residual_m)
    rows.push(["Front corners", `${(1000 * item.warp_residual_m).toFixed(1)} mm from the scan after the fit`]);
  return h(
    "div",
    { class: old ? "stack old" : "stack" },
    h("dl", { class: "facts" }, ...rows.flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, value)])),
    ...placement.warnings.map((warning) => h("p", { class: "muted" }, warning)),
  );
}

/** Source of the pose in words. @param {Placement} placement */
function placedBy({ method }) {
  const [start, matcher] = method.split(" + ");
  if (start === "generator's pose") return "made in its place from the scan";
  return start === "features" ? `keypoints matched by ${matcher}` : "its box in the scan";
}

/** Uncertainty of the pose at 95 %. @param {Placement["spread"]} spread */
function held(spread) {
  if (!spread) return "not measured";
  const { shift_m, turn_deg, scale } = spread;
  return `± ${(2000 * shift_m).toFixed(0)} mm, ± ${(2 * turn_deg).toFixed(1)}°, size ± ${(200 * scale).toFixed(1)} %`;
}

/** Score of the next best orientation. @param {Placement} placement */
function nextTurn({ runner_up, runner_up_turn_deg }) {
  const turned = runner_up_turn_deg === null ? "" : `, by ${runner_up_turn_deg.toFixed(0)}°`;
  return `${(100 * (runner_up ?? 0)).toFixed(0)} % as good${turned}`;
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
