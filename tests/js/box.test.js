import assert from "node:assert/strict";
import { test } from "node:test";

import { clicksOfBox } from "../../static/js/lib/box.js";

test("a box becomes a positive click in its middle and negative clicks beside its sides, within the frame", () => {
  const frame = { width: 100, height: 80, index: 4 };
  const clicks = clicksOfBox({ x: 60, y: 50 }, { x: 20, y: 10 }, frame);
  assert.deepEqual(clicks[0], { frame: 4, x: 40, y: 30, label: 1 });
  assert.ok(clicks.slice(1).every((c) => c.label === 0 && (c.x < 20 || c.x > 60 || c.y < 10 || c.y > 50)));
  assert.equal(clicks.length, 5);
  assert.equal(clicksOfBox({ x: 0, y: 0 }, { x: 40, y: 40 }, frame).length, 3); // no clicks outside the frame
  assert.equal(clicksOfBox({ x: 10, y: 10 }, { x: 13, y: 40 }, frame), null); // too small to be intended
});
