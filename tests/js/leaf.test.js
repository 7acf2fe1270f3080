import assert from "node:assert/strict";
import { test } from "node:test";

import { holdAt, leafAt, openingAt } from "../../static/js/lib/leaf.js";
import { isMarked, withMark } from "../../static/js/lib/opening-marks.js";
import { stateSaid } from "../../static/js/lib/openings.js";

const STILL = [
  [1, 0, 0, 0],
  [0, 1, 0, 0],
  [0, 0, 1, 0],
  [0, 0, 0, 1],
];
/** Looks along the world's y from 3 m before the fronts, z up. */
const CAMERA = {
  fx: 500,
  fy: 500,
  cx: 320,
  cy: 240,
  camera_from_world: [
    [1, 0, 0, 0],
    [0, 0, -1, 0],
    [0, 1, 0, 3],
    [0, 0, 0, 1],
  ],
};
/** Hinged on its left, its front towards -y. */
const DOOR = {
  joint: "a_door_joint",
  part: "door",
  type: "revolute",
  most: Math.PI,
  pose: STILL,
  size_m: [0.6, 0.02, 0.7],
  axis: [0, 0, -1],
  pivot: [-0.3, -0.01, 0],
  opening: null,
};
const DRAWER = { ...DOOR, part: "drawer", type: "prismatic", most: 0.5, axis: [0, -1, 0] };

const near = (a, b) => a.forEach((row, k) => row.forEach((x, j) => assert.ok(Math.abs(x - b[k][j]) < 1e-9)));

test("a door rotates about its hinge, and a drawer slides along its axis", () => {
  near(leafAt(DOOR, 0), STILL);
  const [[, , , x], [, , , y]] = leafAt(DOOR, Math.PI / 2);
  assert.ok(Math.abs(x - -0.29) < 1e-9);
  assert.ok(Math.abs(y - -0.31) < 1e-9); // towards a person in front of it
  assert.equal(leafAt(DRAWER, 0.25)[1][3], -0.25);
});

test("a leaf is dragged by the edge that swings furthest, and the position of the drag gives its opening", () => {
  assert.ok(holdAt(DOOR, 0, CAMERA)[0] > 360); // its right edge
  for (const value of [0.3, 1.2, 1.9]) {
    const [x, y] = holdAt(DOOR, value, CAMERA);
    assert.ok(Math.abs(openingAt(DOOR, CAMERA, x, y) - value) < 0.01);
  }
  const above = { ...CAMERA, camera_from_world: [[1, 0, 0, 0], [0, -0.6, -0.8, 0], [0, 0.8, -0.6, 3], [0, 0, 0, 1]] };
  const [x, y] = holdAt(DRAWER, 0.2, above);
  assert.ok(Math.abs(openingAt(DRAWER, above, x, y) - 0.2) < 0.005);
  const behind = { ...CAMERA, camera_from_world: STILL };
  assert.equal(holdAt(DOOR, 0, behind), null);
});

test("marks are stored by part in the order of frames, replaced on the same frame and removed with null", () => {
  const one = withMark({}, DOOR, 7, 0.5);
  assert.deepEqual(one, { door: [{ frame: 7, state: 0.5 }] });
  const two = withMark(one, DOOR, 3, 0);
  assert.deepEqual(two.door.map(({ frame }) => frame), [3, 7]);
  assert.deepEqual(withMark(two, DOOR, 7, 0.6).door[1], { frame: 7, state: 0.6 });
  assert.deepEqual(withMark(one, DOOR, 7, null), {});
  assert.deepEqual(withMark({ a_door_joint: one.door, lid: [] }, DOOR, 3, 0), { lid: [], door: two.door });
});

test("a state set by a user is distinguished from a measured one", () => {
  const states = [
    { frame: 0, value: 0, sigma: null },
    { frame: 1, value: null, sigma: null },
    { frame: 2, value: 1, sigma: 0.01 },
  ];
  assert.deepEqual(states.map(isMarked), [true, false, false]);
  const opening = { kind: "revolute", largest: 1, states };
  assert.deepEqual(
    [0, 1, 2, 9].map((frame) => stateSaid(opening, frame)),
    ["closed, set by a person", "unknown", "open, 57° ± 1°", ""],
  );
});
