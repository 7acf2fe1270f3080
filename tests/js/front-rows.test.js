import assert from "node:assert/strict";
import { test } from "node:test";

import {
  again,
  divided,
  inOrder,
  renamed,
} from "../../static/js/lib/front-rows.js";

const RECT = { left: 0.2, top: 0.1, right: 1.8, bottom: 0.8 };
const millimetres = (/** @type {any[] | null} */ rects) =>
  rects?.map(({ left, right, top, bottom }) =>
    [left, right, top, bottom].map((edge) => Math.round(1000 * edge)),
  );

test("a front is divided into equal parts or by typed sizes, with the rest as one more part", () => {
  assert.deepEqual(millimetres(divided(RECT, "upright", "2")), [
    [200, 1000, 100, 800],
    [1000, 1800, 100, 800],
  ]);
  assert.deepEqual(millimetres(divided(RECT, "upright", "600, 400")), [
    [200, 800, 100, 800],
    [800, 1200, 100, 800],
    [1200, 1800, 100, 800],
  ]);
  assert.deepEqual(millimetres(divided(RECT, "level", "3 / 50")), [
    [200, 1800, 100, 300],
    [200, 1800, 350, 550],
    [200, 1800, 600, 800],
  ]);
});

test("an invalid division, or one that does not fit, gives null", () => {
  for (const text of [
    "",
    "1",
    "0",
    "a",
    "900 900",
    "600 -100",
    "3 /",
    "2 / 3 / 4",
    "600 2000",
  ])
    assert.equal(divided(RECT, "upright", text), null, text);
});

test("a repeated front has the same size and is placed to the right or below, with a seam of 3 mm", () => {
  assert.deepEqual(
    millimetres([again(RECT, "upright"), again(RECT, "level")]),
    [
      [1803, 3403, 100, 800],
      [200, 1800, 803, 1503],
    ],
  );
});

test("fronts drawn by hand are ordered by column from left to right, each from top to bottom", () => {
  const at = (
    /** @type {string} */ name,
    /** @type {number} */ left,
    /** @type {number} */ top,
  ) => ({
    name,
    rect: { left, top, right: left + 0.4, bottom: top + 0.2 },
  });
  const fronts = [
    at("d", 0.6, 0.4),
    at("b", 0.098, 0.4),
    at("c", 0.602, 0.1),
    at("a", 0.1, 0.1),
  ];
  assert.deepEqual(
    inOrder(fronts).map(({ name }) => name),
    ["a", "b", "c", "d"],
  );
});

test("numbered names skip those taken by other objects, and no renaming step creates a duplicate name", () => {
  const names = ["drawer_2", "drawer_1", "cabinet_1"];
  const fronts = names.map((name, k) => ({ key: String(k), name }));
  const steps = renamed(fronts, "drawer", ["Drawer_3"]);
  const now = new Map(fronts.map(({ key, name }) => [key, name]));
  for (const { key, name } of steps) {
    assert.ok(![...now.values()].includes(name), name);
    now.set(key, name);
  }
  assert.deepEqual([...now.values()], ["drawer_1", "drawer_2", "drawer_4"]);
  assert.deepEqual(renamed(fronts.slice(0, 1), "pantry", []), [
    { key: "0", name: "pantry" },
  ]);
});
