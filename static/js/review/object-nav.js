/** List of the objects to review, with the state of each. */

import { h } from "../dom.js";
import { counted } from "../lib/format.js";
import { between } from "../lib/copied.js";
import { copyBar } from "./copy-bar.js";
import { eye, madeList } from "./scene-tree.js";

/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */

/**
 * @param {import("./objects.js").ReviewObjects} objects
 * @param {(item: { name: string, run_name: string }) => void} bringBack
 * @param {(patch: Partial<import("../api-types").OverridePatch>, to: number[]) => void} copy
 */
export function objectNav(objects, bringBack, copy) {
  const { groups, project } = objects;
  const current = objects.madeName ? null : objects.object;
  const inScene = new Set(objects.items.map(({ run_name }) => run_name));
  const done = groups.filter((group) => group.accepted).length;
  const items = objects.ordered.map((group) => {
    const [text, tone] = standing(group);
    const button = h("button", { type: "button", "aria-pressed": String(group.object === current), title: group.name });
    button.dataset.at = `object:${group.object}`;
    button.append(h("span", { class: "name" }, group.name), text ? h("span", { class: `chip ${tone}` }, text) : "");
    if (group.assignee) button.append(h("span", { class: "chip", title: "assigned to" }, `@${group.assignee}`));
    const decide = group.accepted ? [] : (objects.risks.get(group.object)?.decide ?? []);
    const when = group.changed ? "before its last change: " : "";
    if (decide[0]) {
      const line = { class: "risk muted", title: decide.join("\n"), "aria-hidden": "true" }; // read as the description
      button.append(h("span", line, `${when}${decide[0]}`));
      button.setAttribute("aria-description", decide.join("; "));
    }
    button.addEventListener("click", (event) => press(objects, group.object, event));
    button.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" || !(event.ctrlKey || event.metaKey)) return;
      event.preventDefault();
      objects.toggleSelected(group.object);
    });
    return h(
      "li",
      { class: `with-eye ${objects.selected.has(group.object) ? "selected" : ""}` },
      button,
      inScene.has(group.run_name) ? eye(objects, group) : "",
    );
  });
  return [
    h("h1", {}, "Review"),
    copyBar(objects, copy),
    h("p", { class: "muted" }, groups.length ? `${done} of ${counted(groups.length, "object")} accepted` : ""),
    groups.length > 1 ? order(objects) : "",
    groups.length
      ? h("ul", {}, ...items)
      : h("p", {}, "Nothing to review yet. ", h("a", { href: `/p/${project}/run` }, "Run the pipeline")),
    madeList(objects, bringBack),
  ];
}

/** @param {import("./objects.js").ReviewObjects} objects */
function order(objects) {
  const select = h(
    "select",
    {},
    h("option", { value: "" }, "As annotated"),
    h("option", { value: "risk" }, "Riskiest first"),
  );
  select.value = objects.byRisk ? "risk" : "";
  select.dataset.at = "order:";
  select.addEventListener("change", () => objects.order(select.value === "risk"));
  return h("label", { class: "row order" }, h("span", { class: "muted" }, "Order"), select);
}

/**
 * Choose an object on a click; Ctrl toggles its selection, Shift selects the range from the chosen object to it.
 * @param {import("./objects.js").ReviewObjects} objects
 * @param {number} object
 * @param {MouseEvent} event
 */
function press(objects, object, { ctrlKey, metaKey, shiftKey }) {
  const order = objects.ordered.map((group) => group.object);
  if (ctrlKey || metaKey) objects.toggleSelected(object);
  else if (shiftKey) objects.select(between(order, objects.object, object));
  else objects.choose(object);
}

/**
 * @param {CandidateGroup} group
 * @returns {[string, string]} text and tone; empty if the object only awaits review
 */
function standing(group) {
  if (group.accepted) return ["accepted", "good"];
  if (!group.placement) return ["not placed", ""];
  return group.placement.unsure ? ["unsure", "warn"] : ["", ""];
}
