/** Objects that are to be clicked, and lists of them as text; no DOM. */

import { usableName } from "./format.js";

/** @typedef {{ name: string, category: string }} Listed */

/**
 * Those whose name no object has yet.
 * @param {Listed[]} checklist
 * @param {{ name: string }[]} objects
 */
export function remaining(checklist, objects) {
  const there = new Set(objects.map(({ name }) => name.toLowerCase()));
  return checklist.filter(({ name }) => !there.has(name.toLowerCase()));
}

/**
 * The first one left after another of the list, else the first one left.
 * @param {Listed[]} checklist
 * @param {Listed[]} left
 * @param {string | null} name
 */
export function following(checklist, left, name) {
  const at = checklist.findIndex((entry) => entry.name === name);
  const names = new Set(left.map((entry) => entry.name));
  return checklist.find((entry, k) => k > at && names.has(entry.name)) ?? left[0] ?? null;
}

/** A line each: its name, a comma, its category. @param {Listed[]} objects */
export function asText(objects) {
  return objects.map(({ name, category }) => `${name}, ${category}`).join("\n");
}

/** What a person wrote: a name a line, then its category; without one its name says it, as far as it is no number. @param {string} text @returns {Listed[]} */
export function fromText(text) {
  return text.split("\n").flatMap((line) => {
    const [first = "", ...rest] = line.split(/[,;\t]/);
    const name = usableName(first);
    const category = rest.join(" ").trim() || usableName(first.replace(/\d+\s*$/, "")) || "object";
    return name ? [{ name, category }] : [];
  });
}
