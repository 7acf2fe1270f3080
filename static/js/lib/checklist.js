/** Checklist of objects to be clicked, and its form as text; no DOM. */

import { usableName } from "./format.js";

/** @typedef {{ name: string, category: string }} Listed */

/**
 * Entries whose name no object has yet.
 * @param {Listed[]} checklist
 * @param {{ name: string }[]} objects
 */
export function remaining(checklist, objects) {
  const there = new Set(objects.map(({ name }) => name.toLowerCase()));
  return checklist.filter(({ name }) => !there.has(name.toLowerCase()));
}

/**
 * First remaining entry after the given one, else the first remaining entry.
 * @param {Listed[]} checklist
 * @param {Listed[]} left
 * @param {string | null} name
 */
export function following(checklist, left, name) {
  const at = checklist.findIndex((entry) => entry.name === name);
  const names = new Set(left.map((entry) => entry.name));
  return checklist.find((entry, k) => k > at && names.has(entry.name)) ?? left[0] ?? null;
}

/** Checklist as text: a line per object with its name, a comma and its category. @param {Listed[]} objects */
export function asText(objects) {
  return objects.map(({ name, category }) => `${name}, ${category}`).join("\n");
}

/**
 * Parse a typed checklist: a name per line, then its category; without one, the name without its number is the category.
 * @param {string} text
 * @returns {Listed[]}
 */
export function fromText(text) {
  return text.split("\n").flatMap((line) => {
    const [first = "", ...rest] = line.split(/[,;\t]/);
    const name = usableName(first);
    const category = rest.join(" ").trim() || usableName(first.replace(/\d+\s*$/, "")) || "object";
    return name ? [{ name, category }] : [];
  });
}
