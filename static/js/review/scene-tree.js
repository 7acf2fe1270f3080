/** Scene objects without clicks: visibility buttons, and those left out. */

import { h, icon } from "../dom.js";
import { REVIEWERS } from "./decisions.js";

/** @typedef {import("../api-types").SceneItem} SceneItem */
/** @typedef {import("./objects.js").ReviewObjects} ReviewObjects */

/**
 * Button that hides or shows an object in the scene.
 * @param {ReviewObjects} objects
 * @param {{ name: string, run_name: string }} item
 */
export function eye(objects, { name, run_name }) {
  const hidden = objects.hidden.has(run_name);
  const label = `${hidden ? "Show" : "Hide"} ${name} in the scene`;
  const button = h("button", { type: "button", class: "quiet eye", "aria-label": label, title: label });
  button.dataset.at = `eye:${run_name}`;
  button.append(icon(hidden ? "eye-off" : "eye"));
  button.addEventListener("click", () => objects.hide(run_name, !hidden));
  return button;
}

/**
 * List of objects made from the scan, such as worktops, those left out, and corrected ones that the last run did not make.
 * @param {ReviewObjects} objects
 * @param {(item: { name: string, run_name: string }) => void} bringBack
 */
export function madeList(objects, bringBack) {
  const { made, leftOut, unused } = objects;
  if (!made.length && !leftOut.length && !unused.length) return "";
  const rows = made.map((item) => {
    const chosen = item.run_name === objects.madeName;
    const button = h("button", { type: "button", "aria-pressed": String(chosen), title: item.name });
    button.dataset.at = `made:${item.run_name}`;
    button.append(h("span", { class: "name" }, item.name));
    button.addEventListener("click", () => objects.chooseMade(item.run_name));
    return h("li", { class: "with-eye" }, button, eye(objects, item));
  });
  const gone = leftOut.map((item) => {
    const not = { disabled: !objects.judges, title: objects.judges ? "" : REVIEWERS };
    const back = h("button", { type: "button", class: "quiet", ...not }, "Bring back");
    back.setAttribute("aria-label", `Bring back ${item.name}`);
    back.addEventListener("click", () => bringBack({ name: item.name, run_name: item.name }));
    return h("li", { class: "with-eye" }, h("span", { class: "name left-out" }, item.name), back);
  });
  const missing = unused.map(({ object, name }) => {
    const link = h("a", { href: `/p/${objects.project}/annotate?object=${object}` }, name);
    return h(
      "p",
      { class: "muted" },
      link,
      ": corrected, but the last run did not make it. Click on it, or delete it.",
    );
  });
  return h("section", {}, h("h2", {}, "Made from the scan"), h("ul", {}, ...rows, ...gone), ...missing);
}
