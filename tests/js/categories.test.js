import assert from "node:assert/strict";
import test from "node:test";
import { byOpening, synonyms, usedFirst } from "../../static/js/lib/categories.js";

const category = (/** @type {string} */ name, /** @type {string} */ label, /** @type {string} */ joint) => ({
  name,
  label,
  joint,
  sideways: false,
});
const ALL = [
  category("drawer", "drawer", "prismatic"),
  category("pull_out", "drawer", "prismatic"),
  category("cabinet", "cabinet", "revolute"),
  category("door", "cabinet", "revolute"),
  category("mug", "mug", "none"),
];

test("categories are grouped by how they open, and synonyms are listed once", () => {
  const names = byOpening(ALL).map(({ text, of }) => [text, ...of.map(({ name }) => name)]);
  assert.deepEqual(names, [
    ["turns", "cabinet"],
    ["slides", "drawer"],
    ["does not open", "mug"],
  ]);
});

test("the categories used most in the kitchen come first, synonyms last", () => {
  const names = usedFirst(ALL, ["mug", "door", "mug"]).map(({ name }) => name);
  assert.deepEqual(names, ["mug", "door", "drawer", "cabinet", "pull_out"]);
});

test("a synonym is listed with the category that it stands for", () => {
  assert.deepEqual(synonyms(ALL), [
    { name: "drawer", label: "pull out: drawer" },
    { name: "cabinet", label: "door: cabinet" },
  ]);
});
