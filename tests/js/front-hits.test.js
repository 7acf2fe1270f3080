import assert from "node:assert/strict";
import { test } from "node:test";

import { carried, drawn, heldAt, settled, smallestAt } from "../../static/js/lib/front-hits.js";
import { edgeMiddle, edgeOf, hingeLine, labelCorner, slideArrow } from "../../static/js/lib/front-marks.js";

/** @typedef {import("../../static/js/lib/elevation.js").Rect} Rect */

/** @param {number} left @param {number} right @returns {Rect} 0.4 m wide by default, 0.8 m high */
const door = (left, right = left + 0.4) => ({ left, right, top: 0, bottom: 0.8 });
/** @type {import("../../static/js/lib/front-hits.js").Snap} to multiples of 10 cm within 3 cm */
const snap = (_side, at) => (Math.abs(at - Math.round(10 * at) / 10) < 0.03 ? Math.round(10 * at) / 10 : at);

/** @param {Rect} found @param {Rect} wanted metres */
function same(found, wanted) {
  for (const side of /** @type {const} */ (["left", "top", "right", "bottom"]))
    assert.ok(Math.abs(found[side] - wanted[side]) < 1e-9, `${side}: ${found[side]}, not ${wanted[side]}`);
}

test("a press takes an edge within reach, of the chosen front at a shared seam, else a chosen front around it", () => {
  const fronts = [
    { key: "a", rect: door(0), chosen: false },
    { key: "b", rect: door(0.4), chosen: true },
  ];
  assert.deepEqual(heldAt(fronts, { x: 0.399, y: 0.4 }, 0.01), { key: "b", side: "left" });
  assert.deepEqual(heldAt(fronts, { x: 0.002, y: 0.4 }, 0.01), { key: "a", side: "left" });
  assert.deepEqual(heldAt(fronts, { x: 0.6, y: 0.4 }, 0.01), { key: "b", side: null });
  assert.equal(heldAt(fronts, { x: 0.2, y: 0.4 }, 0.01), null);
});

test("a click on nested fronts selects the smallest", () => {
  const fronts = [{ rect: door(0, 1) }, { rect: door(0.2) }];
  assert.equal(smallestAt(fronts, { x: 0.3, y: 0.4 }), fronts[1]);
  assert.equal(smallestAt(fronts, { x: 0.9, y: 0.4 }), fronts[0]);
  assert.equal(smallestAt(fronts, { x: 2, y: 0.4 }), null);
});

test("a dragged edge snaps, or follows the pointer without snapping, and leaves the front its minimum size", () => {
  same(carried(door(0), "right", { x: 0.4, y: 0 }, { x: 0.52, y: 0 }, snap), door(0, 0.5));
  same(carried(door(0), "right", { x: 0.4, y: 0 }, { x: 0.52, y: 0 }, null), door(0, 0.52));
  same(carried(door(0), "right", { x: 0.4, y: 0 }, { x: -1, y: 0 }, null), door(0, 0.02));
});

test("a front dragged as a whole keeps its size and snaps by its nearest edge", () => {
  const rect = { left: 0.02, right: 0.41, top: 0.1, bottom: 0.8 };
  same(settled(rect, snap), { left: 0.01, right: 0.4, top: 0.1, bottom: 0.8 });
  same(carried(rect, null, { x: 0, y: 0 }, { x: 0.25, y: 0.05 }, null), {
    left: 0.27,
    right: 0.66,
    top: 0.15,
    bottom: 0.85,
  });
});

test("a new rectangle snaps on all sides unless that makes it too small", () => {
  same(drawn({ x: 0.41, y: 0.79 }, { x: 0.02, y: 0.01 }, snap), { left: 0, right: 0.4, top: 0, bottom: 0.8 });
  const narrow = { left: 0.08, right: 0.12, top: 0, bottom: 0.8 };
  same(drawn({ x: 0.08, y: 0 }, { x: 0.12, y: 0.8 }, snap), narrow);
});

test("the marks of a front are its edges, a triangle that points to the hinge and the arrow of a sliding door", () => {
  const rect = { left: 10, right: 110, top: 20, bottom: 60 };
  assert.deepEqual(edgeOf(rect, "bottom"), [
    [10, 60],
    [110, 60],
  ]);
  assert.deepEqual(edgeMiddle(rect, "right"), [110, 40]);
  assert.deepEqual(hingeLine(rect, "top"), [
    [10, 60],
    [60, 20],
    [110, 60],
  ]);
  const [shaft, upper, lower] = slideArrow(rect, "left");
  assert.deepEqual(shaft, [
    [85, 40],
    [35, 40],
  ]);
  assert.deepEqual(upper?.[1], [47, 34]);
  assert.deepEqual(lower?.[1], [47, 46]);
});

test("the label of a front is in the first corner where it covers no handle", () => {
  const [front, size] = [{ left: 0, right: 100, top: 0, bottom: 80 }, { width: 40, height: 20 }];
  assert.deepEqual(labelCorner(front, size, null), { x: 0, y: 0 });
  assert.deepEqual(labelCorner(front, size, { left: 10, right: 14, top: 5, bottom: 40 }), { x: 60, y: 0 });
  assert.deepEqual(labelCorner(front, size, { left: 10, right: 90, top: 5, bottom: 10 }), { x: 60, y: 60 });
});
