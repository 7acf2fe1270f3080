import assert from "node:assert/strict";
import { test } from "node:test";

import { fit, pinch, toImage, toScreen, zoom } from "../../static/js/lib/view.js";

test("zooming keeps the point under the cursor, and screen and image coordinates are inverse", () => {
  const view = fit({ width: 960, height: 720 }, { width: 500, height: 500 });
  const at = { x: 123, y: 321 };
  const before = toImage(view, at);
  const after = toImage(zoom(view, 1.7, at, 0.1), at);
  assert.ok(Math.abs(before.x - after.x) < 1e-9 && Math.abs(before.y - after.y) < 1e-9);
  const there = toScreen(view, before);
  assert.ok(Math.abs(there.x - at.x) < 1e-9 && Math.abs(there.y - at.y) < 1e-9);
});

test("a fitted image is wholly visible and centred", () => {
  const view = fit({ width: 200, height: 100 }, { width: 400, height: 400 });
  assert.deepEqual(view, { scale: 2, x: 0, y: 100 });
});

test("a pinch keeps the point between the fingers in place and scales by their distance", () => {
  const view = { scale: 2, x: 10, y: -5 };
  const [before, after] = [
    [
      { x: 0, y: 0 },
      { x: 10, y: 20 },
    ],
    [
      { x: 40, y: 40 },
      { x: 60, y: 80 },
    ],
  ];
  const pinched = pinch(view, before, after, 0.1);
  assert.equal(pinched.scale, 4);
  const [there, still] = [toImage(view, { x: 5, y: 10 }), toImage(pinched, { x: 50, y: 60 })];
  assert.ok(Math.abs(there.x - still.x) < 1e-9 && Math.abs(there.y - still.y) < 1e-9);
});
