/** Toolbar for several selected objects: copies the chosen object's corrections to them. */

import { h } from "../dom.js";
import { copied, copiedWords } from "../lib/copied.js";
import { counted } from "../lib/format.js";
import { REVIEWERS } from "./decisions.js";

/**
 * @param {import("./objects.js").ReviewObjects} objects
 * @param {(patch: Partial<import("../api-types").OverridePatch>, to: number[]) => void} copy
 */
export function copyBar(objects, copy) {
  const { selected, group } = objects;
  if (!selected.size) return "";
  const others = [...selected].filter((object) => object !== group?.object);
  const patch = group ? copied(group) : {};
  const words = copiedWords(patch);
  const button = h(
    "button",
    {
      type: "button",
      disabled: !others.length || !words || !objects.judges,
      title: objects.judges ? "" : REVIEWERS,
    },
    label(group, words),
  );
  button.dataset.at = "copy:";
  button.addEventListener("click", () => copy(patch, others));
  const none = h("button", { type: "button", class: "quiet", onClick: () => objects.select([]) }, "None");
  none.dataset.at = "select-none:";
  return h(
    "div",
    { class: "selection", role: "group", "aria-label": "Selected objects" },
    h("strong", { role: "status" }, `${counted(selected.size, "object")} selected`),
    none,
    button,
    words ? "" : h("span", { class: "muted" }, "Set the hinge or the limits of the chosen one first."),
  );
}

/** @param {import("../api-types").CandidateGroup | undefined} group @param {string} words */
function label(group, words) {
  return group && words ? `Copy ${words} of ${group.name}` : "Copy how it opens";
}
