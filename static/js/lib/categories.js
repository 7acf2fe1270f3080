/** Grouping and order of categories in selection lists; no DOM. */

/** @typedef {import("../api-types").Category} Category */

/** Way of opening, by joint type. */
const OPENS = { revolute: "turns", prismatic: "slides", none: "does not open" };

/**
 * Categories grouped by how they open, each once, under the first of its names.
 * @param {Category[]} categories
 * @returns {{ text: string, of: Category[] }[]}
 */
export function byOpening(categories) {
  const firsts = categories.filter((one, k) => categories.findIndex(({ label }) => label === one.label) === k);
  return Object.entries(OPENS).map(([joint, text]) => ({ text, of: firsts.filter((one) => one.joint === joint) }));
}

/**
 * Other names of categories, each with the category it stands for, as somebody may look for them.
 * @param {Category[]} categories
 * @returns {{ name: string, label: string }[]}
 */
export function synonyms(categories) {
  const first = new Map(categories.toReversed().map(({ name, label }) => [label, name]));
  return categories
    .filter(({ name, label }) => first.get(label) !== name)
    .map(({ name, label }) => ({ name: first.get(label) ?? name, label: `${name.replaceAll("_", " ")}: ${label}` }));
}

/**
 * Categories used in this kitchen first, most used at the top; then all others, synonyms last.
 * @param {Category[]} categories
 * @param {string[]} used one for each object
 * @returns {Category[]}
 */
export function usedFirst(categories, used) {
  const times = (/** @type {Category} */ { name }) => used.filter((one) => one === name).length;
  const isFirst = (/** @type {Category} */ one) => categories.find(({ label }) => label === one.label) === one;
  return categories.toSorted((a, b) => times(b) - times(a) || Number(isFirst(b)) - Number(isFirst(a)));
}
