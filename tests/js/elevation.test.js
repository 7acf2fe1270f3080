import assert from "node:assert/strict";
import { test } from "node:test";

import {
  around,
  cornersOf,
  decoded,
  handleAfter,
  handleAt,
  handleLike,
  likelyCategory,
  nearestEdge,
  overlap,
  profileOf,
  rectOf,
  resized,
  sameFront,
  seenAfter,
  SMALLEST_M,
  snapped,
  split,
  withEdge,
} from "../../static/js/lib/elevation.js";

// A plane of 2.4 x 0.9 m, rotated by 0.5 rad, in a world whose y points up
const [c, s] = [Math.cos(0.5), Math.sin(0.5)];
const PLANE = /** @type {any} */ ({
  cell_m: 0.01,
  columns: 240,
  rows: 90,
  origin_m: [1, 0.9, 2],
  right: [c, 0, s],
  down: [0, -1, 0],
  top_m: 0.9,
});
const RECT = { left: 0.2, top: 0.1, right: 0.8, bottom: 0.82 };

test("a rectangle on a plane converts to world coordinates and back", () => {
  const corners = cornersOf(PLANE, RECT);
  assert.deepEqual(corners[0]?.[1], 0.8);
  const back = rectOf(PLANE, corners);
  for (const side of /** @type {const} */ (["left", "top", "right", "bottom"]))
    assert.ok(Math.abs((back?.[side] ?? 9) - RECT[side]) < 1e-4);
});

test("a front off the plane, outside its extent or facing backwards does not belong to the plane", () => {
  const off = (/** @type {number} */ by) =>
    cornersOf(PLANE, RECT).map(([x = 0, y = 0, z = 0]) => [
      x - s * by,
      y,
      z + c * by,
    ]);
  assert.ok(rectOf(PLANE, off(0.02)));
  assert.equal(rectOf(PLANE, off(0.05)), null);
  assert.equal(
    rectOf(PLANE, cornersOf(PLANE, { ...RECT, left: 3, right: 3.5 })),
    null,
  );
  const [a, b, d, e] = cornersOf(PLANE, RECT);
  assert.equal(rectOf(PLANE, /** @type {number[][]} */ ([b, a, e, d])), null);
});

/** Lines at 60 and 120 cm, the second in the lower half only. */
function lines() {
  const clarity = new Uint8Array(9 * 240);
  for (let block = 0; block < 9; block++) {
    clarity[block * 240 + 60] = 255;
    if (block > 4) clarity[block * 240 + 120] = 255;
  }
  return decoded({
    block: 10,
    blocks: 9,
    positions: 240,
    clarity: btoa(String.fromCharCode(...clarity)),
  });
}

test("an edge snaps to a line that is visible at its own height, within reach", () => {
  const low = profileOf(lines(), 0.01, 0.5, 0.9);
  const high = profileOf(lines(), 0.01, 0, 0.4);
  assert.equal(snapped(0.615, 0.02, [], low), 0.605);
  assert.equal(snapped(0.64, 0.02, [], low), 0.64);
  assert.equal(snapped(1.21, 0.02, [], low), 1.205);
  assert.equal(snapped(1.21, 0.02, [], high), 1.21);
});

test("an edge snaps to another front's edge or to a line, whichever is nearer", () => {
  const profile = profileOf(lines(), 0.01, 0, 0.9);
  assert.equal(snapped(0.612, 0.02, [0.6], null), 0.6);
  assert.equal(snapped(0.606, 0.02, [0.62], profile), 0.605);
  assert.equal(snapped(0.618, 0.02, [0.62], profile), 0.62);
});

test("splitting a front at a seam gives two adjacent parts, or null where one would be too small", () => {
  assert.deepEqual(split(RECT, "upright", 0.5), [
    { ...RECT, right: 0.5 },
    { ...RECT, left: 0.5 },
  ]);
  assert.deepEqual(split(RECT, "level", 0.4)?.[1], { ...RECT, top: 0.4 });
  assert.equal(split(RECT, "upright", 0.21), null);
  assert.deepEqual(around(split(RECT, "level", 0.4) ?? []), RECT);
});

test("a moved edge leaves the front its minimum size, and adjacent fronts do not overlap", () => {
  assert.equal(withEdge(RECT, "left", 2).left, 0.78);
  assert.equal(withEdge(RECT, "bottom", 0).bottom, RECT.top + SMALLEST_M);
  assert.equal(overlap(RECT, { ...RECT, left: 0.8, right: 1.4 }), false);
  assert.equal(overlap(RECT, { ...RECT, left: 0.7, right: 1.4 }), true);
  assert.deepEqual(nearestEdge(RECT, { x: 0.79, y: 0.4 }).side, "right");
});

test("a new handle lies within its front: vertical near the side of a door, horizontal on a drawer", () => {
  const door = handleAt(RECT, { x: 0.79, y: 0.2 });
  assert.ok(door.top_m - door.bottom_m > door.right_m - door.left_m);
  assert.ok(door.right_m <= 0.3 + 1e-9);
  const drawer = handleAt(
    { left: 0, right: 0.6, top: 0, bottom: 0.15 },
    { x: 0.3, y: 0.05 },
  );
  assert.ok(drawer.right_m - drawer.left_m > drawer.top_m - drawer.bottom_m);
});

test("a handle stays in place when an edge of its front is moved, and moves along with the whole front", () => {
  const box = { left_m: 0.2, right_m: 0.22, bottom_m: 0.1, top_m: 0.26 };
  const wider = handleAfter(box, RECT, { ...RECT, right: 1, bottom: 0.92 });
  assert.deepEqual(wider, {
    left_m: 0.1,
    right_m: 0.12,
    bottom_m: 0.15,
    top_m: 0.31,
  });
  assert.equal(handleAfter(box, RECT, { ...RECT, left: 0.3, right: 0.9 }), box);
  assert.equal(handleAfter("none", RECT, { ...RECT, right: 1 }), "none");
});

test("a copied handle keeps its distance from a near edge, else from the centre, and stays within the front", () => {
  const box = { left_m: 0.2, right_m: 0.22, bottom_m: -0.05, top_m: 0.05 };
  const from = { left: 0, right: 0.5, top: 0, bottom: 0.7 };
  const to = (/** @type {number} */ wide, /** @type {number} */ high) => ({ left: 2, right: 2 + wide, top: 1, bottom: 1 + high });
  assert.deepEqual(handleLike(box, from, to(0.5, 0.7)), box);
  assert.deepEqual(handleLike(box, from, to(0.7, 0.3)), { left_m: 0.3, right_m: 0.32, bottom_m: -0.05, top_m: 0.05 });
  assert.deepEqual(handleLike(box, from, to(0.5, 0.06)), { ...box, bottom_m: -0.03, top_m: 0.03 });
});

test("a handle that no longer lies on its changed front is reset to null", () => {
  const box = { left_m: 0.2, right_m: 0.22, bottom_m: 0.1, top_m: 0.26 };
  assert.equal(handleAfter(box, RECT, { ...RECT, right: 0.71 }), null);
  assert.equal(handleAfter(box, RECT, { ...RECT, top: 0.25 }), null);
  assert.notEqual(handleAfter(box, RECT, { ...RECT, right: 0.72 }), null); // ends exactly at the front's edge
});

test("fronts with the same corners, handle and hinge are equal, whatever the key order of the handle", () => {
  const handle = { left_m: 0.2, right_m: 0.22, bottom_m: 0.1, top_m: 0.26 };
  const said = { right_m: 0.22, top_m: 0.26, left_m: 0.2, bottom_m: 0.1 };
  const front = { corners_m: cornersOf(PLANE, RECT), handle, hinge: null };
  const back = cornersOf(PLANE, rectOf(PLANE, front.corners_m) ?? RECT);
  assert.ok(sameFront(front, { corners_m: back, handle: said }));
  assert.ok(
    !sameFront(front, {
      ...front,
      corners_m: cornersOf(PLANE, { ...RECT, right: 0.801 }),
    }),
  );
  assert.ok(
    !sameFront(front, { ...front, handle: { ...handle, top_m: 0.261 } }),
  );
  assert.ok(!sameFront(front, { ...front, handle: "none" }));
  assert.ok(!sameFront(front, { ...front, hinge: "left" }));
});

test("the likely category of a front follows from its shape and height", () => {
  assert.equal(likelyCategory(RECT, 0.9), "cabinet");
  assert.equal(likelyCategory({ ...RECT, bottom: 0.3 }, 0.9), "drawer");
  assert.equal(likelyCategory(RECT, 2.2), "wall_cabinet");
});

test("an edge among equally clear lines stays in place, and a near line wins over a clearer one further away", () => {
  const cell = 0.0025;
  const at = (/** @type {(i: number) => number} */ clear) => ({
    positions: Float32Array.from({ length: 400 }, (_, i) => clear(i)),
    cell,
  });
  const wide = at((i) => (i > 180 && i < 220 ? 1 : 0));
  assert.ok(Math.abs(snapped(0.501, 0.012, [], wide) - 0.501) < 0.002); // within a cell: lines are at the centres of cells
  const two = at((i) => (i === 200 ? 0.8 : i === 204 ? 1 : 0));
  assert.ok(Math.abs(snapped(0.502, 0.012, [], two) - 200.5 * cell) < 1e-9);
});

test("a typed size moves the chosen edge, else the less certain one, else one without a neighbour", () => {
  const front = { left: 1, right: 1.6, top: 0.1, bottom: 0.8 };
  const beside = { left: 1.6, right: 2, top: 0.1, bottom: 0.8 };
  /** @type {(chosen: import("../../static/js/lib/elevation.js").Side | null, sure: number[], others?: typeof front[]) => number[]} */
  const ends = (chosen, sure, others = []) => {
    const { left, right } = resized(front, "width", 0.5, { chosen, sure, others });
    return [left, right].map((at) => Math.round(1000 * at) / 1000);
  };
  assert.deepEqual(ends(null, []), [1, 1.5]);
  assert.deepEqual(ends(null, [0.2, 0.9, 0.9, 0.9]), [1.1, 1.6]);
  assert.deepEqual(ends("right", [0.2, 0.9, 0.9, 0.9]), [1, 1.5]);
  assert.deepEqual(ends(null, [], [beside]), [1.1, 1.6]);
  assert.deepEqual(ends(null, [], [{ ...beside, top: 0.8, bottom: 1.4 }]), [1, 1.5]); // below it, not beside it
  const high = resized(front, "height", 0.5, { chosen: null, sure: [0.9, 0.9, 0.1, 0.9], others: [] });
  assert.deepEqual([high.top.toFixed(2), high.bottom], ["0.30", 0.8]);
});

test("a detected handle stays where the photo shows it when its front is moved, and is gone where it is off the front", () => {
  const box = { left_m: 0.2, right_m: 0.22, bottom_m: 0.1, top_m: 0.26 };
  const right = { ...RECT, left: RECT.left + 0.05, right: RECT.right + 0.05 };
  assert.deepEqual(seenAfter(box, RECT, right), { ...box, left_m: 0.15, right_m: 0.17 });
  assert.equal(seenAfter(box, RECT, { ...RECT, right: 0.71 }), null);
});
