import assert from "node:assert/strict";
import test from "node:test";

import { alike, kindOf } from "../../static/js/lib/likeness.js";

const corners = [
  [0, 0, 1],
  [0.6, 0, 1],
  [0.6, 0, 0.8],
  [0, 0, 0.8],
];
const level = { left_m: -0.1, right_m: 0.1, bottom_m: -0.01, top_m: 0.01 };
const drawer = kindOf("drawer", {
  object: 1,
  corners_m: corners,
  handle: level,
  edges: [],
});
const bar = [
  [10, 10],
  [30, 11],
  [30, 13],
  [10, 12],
];

/** @param {string} id @param {Partial<import("../../static/js/api-types").Proposal>} more */
const proposal = (id, more) => ({
  id,
  kind: /** @type {const} */ ("front"),
  category: "drawer",
  confidence: 0.9,
  frame: 0,
  x: 0,
  y: 0,
  size_m: [0.6, 0.5, 0.2],
  outline: [],
  handle: /** @type {[number, number][]} */ (bar),
  ...more,
});

test("the features of an object with a front are its width, height and orientation of the handle", () => {
  assert.equal(drawer.handle, "level");
  assert.ok(
    Math.abs((drawer.sides?.[0] ?? 0) - 0.6) < 1e-9 &&
      Math.abs((drawer.sides?.[1] ?? 0) - 0.2) < 1e-9,
  );
  assert.equal(kindOf("mug", undefined).sides, null);
  assert.equal(
    kindOf("door", { object: 1, corners_m: corners, handle: null, edges: [] })
      .handle,
    "none",
  );
});

test("similar proposals are ranked by category, size and handle, not by confidence", () => {
  const found = alike(drawer, [
    proposal("tall", { size_m: [0.6, 0.5, 0.72] }),
    proposal("other handle", { handle: [] }),
    proposal("a little wider", { size_m: [0.66, 0.5, 0.2] }),
    proposal("same", { confidence: 0.3 }),
    proposal("other category", { category: "cabinet" }),
    proposal("thing", { kind: "thing" }),
  ]);
  assert.deepEqual(
    found.map(({ id }) => id),
    ["same", "a little wider", "other handle", "other category"],
  );
  assert.ok(Math.abs((found[0]?.confidence ?? 0) - 1) < 1e-9);
});

test("without a flat front only the category is compared", () => {
  const found = alike(kindOf("bottle", undefined), [
    proposal("a", {}),
    proposal("b", { category: "bottle", kind: "thing" }),
  ]);
  assert.deepEqual(
    found.map(({ id, confidence }) => [id, confidence]),
    [["b", 1]],
  );
});
