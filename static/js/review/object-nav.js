/** The objects to review, with how each stands. */

import { h } from "../dom.js";
import { counted } from "../lib/format.js";

/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */

/**
 * @param {CandidateGroup[]} groups
 * @param {{ current: number, project: string, choose: (object: number) => void }} view
 */
export function objectNav(groups, { current, project, choose }) {
  const done = groups.filter((group) => group.accepted).length;
  const items = groups.map((group) => {
    const [text, tone] = standing(group);
    const button = h("button", { type: "button", "aria-pressed": String(group.object === current), title: group.name });
    button.dataset.at = `object:${group.object}`;
    button.append(h("span", { class: "name" }, group.name), text ? h("span", { class: `chip ${tone}` }, text) : "");
    button.addEventListener("click", () => choose(group.object));
    return h("li", {}, button);
  });
  return [
    h("h1", {}, "Review"),
    h("p", { class: "muted" }, groups.length ? `${done} of ${counted(groups.length, "object")} accepted` : ""),
    groups.length
      ? h("ul", {}, ...items)
      : h("p", {}, "Nothing to review yet. ", h("a", { href: `/p/${project}/run` }, "Run the pipeline")),
  ];
}

/**
 * @param {CandidateGroup} group
 * @returns {[string, string]} text and tone; nothing where it only waits to be looked at
 */
function standing(group) {
  if (group.accepted) return ["accepted", "good"];
  if (!group.placement) return ["not placed", ""];
  return group.placement.unsure ? ["unsure", "warn"] : ["", ""];
}
