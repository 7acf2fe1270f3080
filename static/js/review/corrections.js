/** What a person may correct about one object: hinge, limits, size, place. Each is an override; what depends on it runs again. */

import { h } from "../dom.js";
import { nudged } from "../lib/box-view.js";

/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */
/** @typedef {import("../api-types").OverridePatch} OverridePatch */
/** @typedef {import("../api-types").SceneItem} SceneItem */
/** @typedef {{ pose: number[][], size: number[] }} Box */

const SIDES = /** @type {const} */ (["automatic", "left", "right", "top", "bottom"]);
const DEGREES = Math.PI / 180;

/**
 * @param {CandidateGroup} group
 * @param {SceneItem | undefined} item
 * @param {Box | null} box as it stands in the finished scene
 * @param {{ change: (patch: Partial<OverridePatch>) => void, preview: (box: Box | null) => void }} told
 */
export function corrections(group, item, box, told) {
  return h(
    "details",
    { open: hasCorrection(group) },
    h("summary", {}, "Correct it"),
    h(
      "div",
      { class: "stack" },
      hinge(group, told.change),
      limits(group, item, told.change),
      box ? place(group, box, told) : null,
    ),
  );
}

/** @param {CandidateGroup} group */
function hasCorrection({ override }) {
  return Boolean(override.hinge || override.pose || override.dimensions_m || override.joint_upper);
}

/**
 * @param {CandidateGroup} group
 * @param {(patch: Partial<OverridePatch>) => void} change
 */
function hinge(group, change) {
  const select = h("select", { "aria-label": `Hinge of ${group.name}` });
  for (const side of SIDES) {
    select.append(h("option", { value: side, selected: (group.override.hinge ?? "automatic") === side }, side));
  }
  select.addEventListener("change", () => {
    const side = /** @type {typeof SIDES[number]} */ (select.value);
    change({ hinge: side === "automatic" ? null : side });
  });
  return h("label", {}, h("span", { class: "muted" }, "Hinge"), select);
}

/**
 * @param {CandidateGroup} group
 * @param {SceneItem | undefined} item
 * @param {(patch: Partial<OverridePatch>) => void} change
 */
function limits(group, item, change) {
  const joint = item?.joints[0];
  if (!joint) return null;
  const unit = joint.type === "revolute" ? DEGREES : 0.01;
  const field = number(joint.type === "revolute" ? "Opens to (degrees)" : "Opens to (cm)", joint.upper / unit, {
    min: "1",
    step: "any",
  });
  const set = h("button", { type: "button" }, "Set");
  set.addEventListener("click", () => change({ joint_lower: 0, joint_upper: Number(field.input.value) * unit }));
  return h(
    "div",
    { class: "row" },
    field.label,
    set,
    group.override.joint_upper ? again(() => change({ joint_lower: null, joint_upper: null })) : null,
  );
}

/**
 * Size and place in numbers; the box over the photo follows while they are typed.
 * @param {CandidateGroup} group
 * @param {Box} box
 * @param {{ change: (patch: Partial<OverridePatch>) => void, preview: (box: Box | null) => void }} told
 */
function place(group, box, { change, preview }) {
  const moves = ["x (mm)", "y (mm)", "up (mm)", "turn (°)"].map((name) => number(`Move ${name}`, 0, { step: "1" }));
  const sides = ["Width", "Depth", "Height"].map((name, k) =>
    number(`${name} (cm)`, 100 * (box.size[k] ?? 0), { min: "1", step: "0.1" }),
  );
  const wanted = () => {
    const [dx = 0, dy = 0, dz = 0, turn = 0] = moves.map(({ input }) => Number(input.value));
    const pose = nudged(box.pose, { dx: dx / 1000, dy: dy / 1000, dz: dz / 1000, yaw: turn * DEGREES });
    return {
      pose,
      size: sides.map(({ input }) => Number(input.value) / 100),
      moved: [dx, dy, dz, turn].some((value) => value !== 0),
    };
  };
  const form = h(
    "form",
    { class: "nudge" },
    ...moves.map(({ label }) => label),
    ...sides.map(({ label }) => label),
    h("button", { type: "submit", class: "primary" }, "Use this place and size"),
    group.override.pose || group.override.dimensions_m ? again(() => change({ pose: null, dimensions_m: null })) : null,
  );
  form.addEventListener("input", () => preview(wanted()));
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const { pose, size, moved } = wanted();
    const resized = size.some((side, k) => Math.abs(side - (box.size[k] ?? 0)) > 5e-4);
    if (!moved && !resized) return preview(null);
    change({
      ...(moved ? { pose } : {}),
      ...(resized ? { dimensions_m: /** @type {[number, number, number]} */ (size) } : {}),
    });
  });
  return form;
}

/** @param {() => void} act */
function again(act) {
  return h("button", { type: "button", class: "quiet", onClick: act }, "Compute it again");
}

/**
 * @param {string} text
 * @param {number} value
 * @param {Record<string, string>} options
 */
function number(text, value, options) {
  const input = h("input", { type: "number", value: String(Math.round(10 * value) / 10), ...options });
  return { input, label: h("label", {}, h("span", { class: "muted" }, text), input) };
}
