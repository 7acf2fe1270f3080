/** What speaks for and against an object's place: figures of the alignment and the fit, findings of the certificate. */

import { h } from "../dom.js";
import { centimetres } from "../lib/format.js";

/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */
/** @typedef {import("../api-types").Certificate} Certificate */
/** @typedef {import("../api-types").SceneItem} SceneItem */

/**
 * @param {NonNullable<CandidateGroup["placement"]>} placement
 * @param {SceneItem | undefined} item
 */
export function placement(placement, item) {
  /** @type {[string, string][]} */
  const rows = [
    ["Placed by", placement.method],
    ["Distance to the scan", `${(1000 * placement.rms_m).toFixed(1)} mm rms`],
    ["Silhouette overlap", `${(100 * placement.mask_iou).toFixed(0)} %`],
    ["Keypoints", `${placement.inliers} of ${placement.matches} agree`],
    [
      "Runner-up",
      placement.runner_up === null ? "none" : `${(100 * placement.runner_up).toFixed(0)} % of the winner's score`,
    ],
  ];
  if (item) rows.push(["W × D × H", `${item.dimensions_m.map(centimetres).join(" × ")} cm`]);
  if (item?.warp_residual_m)
    rows.push(["Front corners", `${(1000 * item.warp_residual_m).toFixed(1)} mm off after the fit`]);
  return h(
    "div",
    { class: "stack" },
    placement.unsure ? h("span", { class: "chip warn" }, "unsure: another pose fits nearly as well") : "",
    h("dl", { class: "facts" }, ...rows.flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, value)])),
    ...joints(item),
    ...[...placement.warnings, ...(item?.warnings ?? [])].map((warning) => h("p", { class: "muted" }, warning)),
  );
}

/** Each number of a joint with where it comes from. @param {SceneItem | undefined} item */
function joints(item) {
  return (item?.joints ?? []).map((joint) => {
    const chips = Object.entries(joint.sources).map(([what, source]) =>
      h(
        "span",
        { class: `chip ${source === "default" ? "warn" : source === "inferred" ? "" : "good"}` },
        `${what}: ${source}`,
      ),
    );
    const kind = joint.type === "revolute" ? "Hinged" : "Slides";
    return h("div", { class: "chips" }, h("span", {}, kind), ...chips);
  });
}

/**
 * What the certificate says about one object: links and joints begin with their object's name.
 * @param {Certificate | null} certificate
 * @param {string} name
 * @param {string[]} names of all objects
 */
export function findingsOf(certificate, name, names) {
  const mine = (certificate?.findings ?? []).filter(({ where }) => owner(where, names) === name);
  if (!mine.length) return "";
  return h(
    "ul",
    { class: "findings", "aria-label": "Findings of the certificate" },
    ...mine.map(({ severity, where, message }) =>
      h("li", { class: severity === "error" ? "bad" : "warn" }, h("strong", {}, where), ` ${message}`),
    ),
  );
}

/**
 * @param {string} where
 * @param {string[]} names
 */
function owner(where, names) {
  return names
    .filter((name) => where === name || where.startsWith(`${name}_`))
    .toSorted((a, b) => b.length - a.length)[0];
}
