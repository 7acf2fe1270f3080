import assert from "node:assert/strict";
import { test } from "node:test";

import { edges, moved, sides, sizes } from "../../static/js/lib/crop-box.js";

const CAMERA = {
  width: 160,
  height: 120,
  fx: 100,
  fy: 100,
  cx: 80,
  cy: 60,
  camera_from_capture: [
    [1, 0, 0, 0],
    [0, 1, 0, 0],
    [0, 0, 1, 0],
    [0, 0, 0, 1],
  ],
};
const BOX = {
  corner_m: [-0.5, -0.5, 2],
  edges_m: [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ],
};

test("a crop box in front of the camera has twelve edges and six sides, named as seen in the photo", () => {
  assert.equal(edges(BOX, CAMERA).length, 12);
  const named = Object.fromEntries(
    sides(BOX, CAMERA).map((side) => [side.name, side]),
  );
  assert.deepEqual(Object.keys(named).toSorted(), [
    "Back",
    "Bottom",
    "Front",
    "Left side",
    "Right side",
    "Top",
  ]);
  assert.ok(named["Left side"].at.x < named["Right side"].at.x);
  assert.ok(named.Top.at.y < named.Bottom.at.y);
  assert.ok(named.Front.distance < named.Back.distance);
});

test("the names of the sides do not depend on the axes in which the crop box is stored", () => {
  const turned = {
    corner_m: [0.5, 0.5, 3],
    edges_m: [
      [0, -1, 0],
      [0, 0, -1],
      [-1, 0, 0],
    ],
  };
  const at = (box) =>
    Object.fromEntries(sides(box, CAMERA).map(({ name, at }) => [name, at]));
  assert.deepEqual(at(turned), at(BOX));
});

test("moving a side keeps the opposite side in place and a minimum thickness", () => {
  const nearer = moved(BOX, { axis: 2, away: false }, 0.25);
  assert.deepEqual(nearer.corner_m, [-0.5, -0.5, 1.75]);
  assert.deepEqual(sizes(nearer), [1, 1, 1.25]);
  const thin = moved(BOX, { axis: 0, away: true }, -5);
  assert.deepEqual(thin.corner_m, BOX.corner_m);
  assert.ok(sizes(thin)[0] > 0);
});

test("edges that reach behind the camera are not drawn", () => {
  assert.equal(
    edges({ ...BOX, corner_m: [-0.5, -0.5, -0.5] }, CAMERA).length,
    4,
  );
});
