/** Tables of a finished scene, shared by the run and download pages. */

import { h } from "../dom.js";
import { byPlace } from "../lib/findings.js";
import { centimetres, counted, jointValue } from "../lib/format.js";
import { motionOf } from "../lib/joints.js";
import { sourceChip, sourceWord } from "../source-chip.js";

/** @typedef {import("../api-types").SceneSummary} SceneSummary */
/** @typedef {import("../api-types").Certificate} Certificate */

/** @param {SceneSummary} scene */
export function sceneTable(scene) {
  const titles = ["Object", "Category", "W × D × H cm", "Joint", "Mask frames", "Placement rms", "Notes"];
  const failures = Object.entries(scene.failures);
  return h(
    "div",
    { class: "stack" },
    h(
      "div",
      { class: "scroll", tabIndex: 0, role: "region", "aria-label": "Objects of the scene" },
      h(
        "table",
        {},
        h("thead", {}, h("tr", {}, ...titles.map((title) => h("th", { scope: "col" }, title)))),
        h("tbody", {}, ...scene.items.map(row)),
      ),
    ),
    failures.length
      ? h(
          "div",
          { role: "alert" },
          h("h3", {}, `${counted(failures.length, "object")} not in the bundle`),
          h("ul", {}, ...failures.map(([name, line]) => h("li", {}, h("strong", {}, name), `: ${line}`))),
        )
      : null,
    scene.warnings.length
      ? h(
          "section",
          {},
          h("h3", {}, "Warnings about the scene"),
          h("ul", {}, ...scene.warnings.map((line) => h("li", {}, line))),
        )
      : null,
  );
}

/** @param {SceneSummary["items"][number]} item */
function row(item) {
  const joints = item.joints.map((joint) => {
    const source = joint.sources.limits ?? ""; // shown beside the limit
    return h(
      "div",
      {},
      `${motionOf(joint)}, opens ${jointValue(joint.type, joint.upper)} `,
      source ? sourceChip(source, { title: said(joint) }) : "",
    );
  });
  const rms = item.placement_rms_m === null ? "–" : `${(1000 * item.placement_rms_m).toFixed(1)} mm`;
  const [width, depth, height] = item.dimensions_m.map(centimetres);
  return h(
    "tr",
    {},
    h("th", { scope: "row" }, item.name),
    h("td", {}, item.category),
    h(
      "td",
      { class: "whole", title: `sources: ${item.dimension_sources.join(", ")}` },
      `${width} × ${depth} × ${height}`,
    ),
    h("td", { class: "whole" }, ...(joints.length ? joints : [standing(item)])),
    h("td", { class: "number" }, String(item.mask_frames)),
    h("td", { class: "number" }, rms),
    h("td", { class: "muted notes" }, ...item.warnings.map((warning) => h("div", {}, warning))),
  );
}

/** How an object without joints is held. @param {import("../api-types").SceneItem} item */
function standing(item) {
  if (item.carried_by) return `in ${item.carried_by}`;
  return item.movable ? "free" : "fixed";
}

/** Sources of a joint's numbers. @param {import("../api-types").SceneItem["joints"][number]} joint */
function said(joint) {
  return Object.entries(joint.sources)
    .map(([what, source]) => `${what}: ${sourceWord(source)}`)
    .join(", ");
}

/**
 * Findings of the certificate, with their places in the scene.
 * @param {Certificate["findings"]} findings
 */
export function findingList(findings) {
  const lines = byPlace(findings).map(({ severity, where, messages }) => {
    const [only = ""] = messages;
    const said = messages.length === 1 ? ` ${only}` : h("ul", {}, ...messages.map((message) => h("li", {}, message)));
    return h("li", { class: severity === "error" ? "bad" : "warn", title: severity }, h("strong", {}, where), said);
  });
  return h("ul", { class: "findings", "aria-label": "Findings of the certificate" }, ...lines);
}

/** Likeness of the scene to the recording, with the doubts to check. @param {NonNullable<Certificate["likeness"]>} likeness */
function likenessLine({ state, doubts }) {
  const tone = state === "passed" ? "good" : state === "failed" ? "bad" : "warn";
  const names = doubts.flatMap(({ object, why }, at) => [
    at ? ", " : ": look at ",
    h("strong", { title: why }, object),
  ]);
  return h("p", {}, "Likeness to the scan ", h("span", { class: `chip ${tone}` }, state), ...names);
}

/** @param {Certificate} certificate */
export function certificateCard(certificate) {
  const state = certificate.passed ? "passed" : "did not pass";
  const joints = certificate.joints;
  const travel = joints.length ? Math.min(...joints.map((joint) => joint.travel_reached)) : 1;
  const sweep = joints.length ? Math.max(...joints.map((joint) => joint.deepest_penetration_m)) : 0;
  /** @type {[string, string][]} */
  const facts = [
    ["Deepest contact at rest", `${(1000 * certificate.rest_penetration_m).toFixed(2)} mm`],
    ["Deepest contact while opening", `${(1000 * sweep).toFixed(2)} mm`],
    ["Joints open at least", `${(100 * travel).toFixed(0)} % of their range (${counted(joints.length, "joint")})`],
    ["Drift at rest in 5 s", `${(1000 * certificate.drift_m).toFixed(2)} mm`],
    ["Speed", `${certificate.realtime_factor.toFixed(0)} × real time`],
  ];
  return h(
    "section",
    { class: "card stack" },
    h(
      "h2",
      {},
      "Certificate ",
      h("span", { class: `chip ${!certificate.current ? "" : certificate.passed ? "good" : "bad"}` }, state),
      ...(certificate.current ? [] : [" ", h("span", { class: "chip warn" }, "stale")]),
    ),
    certificate.likeness ? likenessLine(certificate.likeness) : null,
    certificate.current
      ? null
      : h("p", {}, `Certificate of version ${certificate.version}: the next run certifies the changes made since.`),
    h("dl", { class: "facts" }, ...facts.flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, value)])),
    h(
      "div",
      { class: "row" },
      ...certificate.loaders.map((loader) => {
        const tone = loader.state === "passed" ? "good" : loader.state === "failed" ? "bad" : "";
        return h("span", { class: `chip ${tone}`, title: loader.detail }, `${loader.loader}: ${loader.state}`);
      }),
    ),
    certificate.findings.length ? findingList(certificate.findings) : null,
  );
}
