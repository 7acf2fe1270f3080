/** Form of the corrections to one object: hinge, limits, size, place. Each is stored as an override; dependent stages rerun. */

import { h, numberField } from "../dom.js";
import { byOpening, usedFirst } from "../lib/categories.js";
import { slidesSideways, withLimit } from "../lib/joints.js";

/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */
/** @typedef {import("../api-types").OverridePatch} OverridePatch */
/** @typedef {import("../api-types").SceneItem} SceneItem */

/**
 * @typedef {object} Kinds categories, and handlers to change them
 * @property {import("../api-types").Category[]} categories
 * @property {(category: string) => void} categorise
 * @property {(template: string | null) => void} buildAs
 */

const SIDES = /** @type {const} */ (["automatic", "left", "right", "top", "bottom"]);
const DEGREES = Math.PI / 180;

/**
 * @param {CandidateGroup} group
 * @param {SceneItem | undefined} item
 * @param {{ move: (() => void) | null, open: boolean, judges: boolean } & Kinds} how `move` starts moving the object; null
 *   if it has no box yet
 * @param {(patch: Partial<OverridePatch>) => void} change
 */
export function corrections(group, item, { move, open, judges, ...ask }, change) {
  const summary = h("summary", {}, "Correct it");
  summary.dataset.at = "correct:";
  return h(
    "details",
    { open: open || hasCorrection(group) },
    summary,
    h(
      "fieldset",
      { class: "stack plain", disabled: !judges },
      ...kind(group, ask),
      side(group, item, change),
      ...limits(group, item, change),
      move && h("button", { type: "button", onClick: move }, "Move or resize it…"),
    ),
  );
}

/** @param {CandidateGroup} group */
function hasCorrection({ override }) {
  return Boolean(
    override.hinge ||
    override.built_as ||
    override.pose ||
    override.dimensions_m ||
    override.joint_upper ||
    Object.keys(override.joints).length,
  );
}

/**
 * Fields for the category, and for the category whose body and joints it is built with, such as a drawer's.
 * @param {CandidateGroup} group
 * @param {Kinds} kinds
 */
function kind(group, { categories, categorise, buildAs }) {
  const known = h("datalist", { id: "known-categories" });
  known.append(...usedFirst(categories, []).map(({ name, label }) => h("option", { value: name }, label)));
  const field = h("input", {
    value: group.category,
    list: "known-categories",
    "aria-label": `Category of ${group.name}`,
  });
  field.addEventListener("change", () => field.value.trim() && categorise(field.value.trim()));
  const select = h("select", { "aria-label": `How ${group.name} opens` });
  const said = group.override.built_as ?? "";
  select.append(h("option", { value: "", selected: !said }, "as its category"));
  for (const { text, of } of byOpening(categories))
    select.append(
      h(
        "optgroup",
        { label: text },
        ...of.map(({ name, label }) => h("option", { value: name, selected: name === said }, label)),
      ),
    );
  select.addEventListener("change", () => buildAs(select.value || null));
  return [
    h("label", {}, h("span", { class: "muted" }, "Category"), field, known),
    h("label", {}, h("span", { class: "muted" }, "Opens and is built as"), select),
  ];
}

/**
 * Menu for the side of the hinge, or the side it slides to; none for drawers, which slide out.
 * @param {CandidateGroup} group
 * @param {SceneItem | undefined} item
 * @param {(patch: Partial<OverridePatch>) => void} change
 */
function side(group, item, change) {
  const sideways = item?.joints.some(slidesSideways) ?? false;
  const what = sideways ? "Slides to" : "Hinge";
  const said = group.override.hinge ?? "automatic";
  const slides = Boolean(item?.joints.length) && item?.joints.every(({ type }) => type === "prismatic");
  if (slides && !sideways && said === "automatic") return "";
  const select = h("select", { "aria-label": sideways ? `Where ${group.name} slides to` : `Hinge of ${group.name}` });
  for (const one of SIDES) {
    if (sideways && one !== said && (one === "top" || one === "bottom")) continue;
    select.append(h("option", { value: one, selected: said === one }, one));
  }
  select.addEventListener("change", () => {
    const chosen = /** @type {typeof SIDES[number]} */ (select.value);
    change({ hinge: chosen === "automatic" ? null : chosen });
  });
  return h("label", {}, h("span", { class: "muted" }, what), select);
}

/**
 * Fields for the opening limit of each joint. Joints are named only if there are several.
 *
 * @param {CandidateGroup} group
 * @param {SceneItem | undefined} item
 * @param {(patch: Partial<OverridePatch>) => void} change
 */
function limits(group, item, change) {
  const said = group.override;
  return (item?.joints ?? []).map((joint, _, joints) => {
    const alone = joints.length === 1;
    const part = joint.name
      .slice(group.run_name.length + 1)
      .replace(/_joint$/, "")
      .replaceAll("_", " ");
    return limit(
      joint,
      alone ? "" : `${part}: `,
      alone ? said.joint_upper !== null : joint.name in said.joints,
      (upper) => change(withLimit(said, joint.name, alone, upper)),
    );
  });
}

/**
 * @param {SceneItem["joints"][number]} joint
 * @param {string} part
 * @param {boolean} isSaid
 * @param {(upper: number | null) => void} change
 */
function limit(joint, part, isSaid, change) {
  const unit = joint.type === "revolute" ? DEGREES : 0.01;
  const label = `${part}Opens to (${joint.type === "revolute" ? "degrees" : "cm"})`;
  const field = numberField(label, joint.upper / unit, { min: "1", step: "any" });
  const set = h("button", { type: "button" }, "Set");
  set.addEventListener("click", () => change(Number(field.input.value) * unit));
  return h("div", { class: "row" }, field.label, set, isSaid ? again(() => change(null)) : null);
}

/** @param {() => void} act */
function again(act) {
  return h("button", { type: "button", class: "quiet", onClick: act }, "Compute it again");
}
