import assert from "node:assert/strict";
import { test } from "node:test";

import { clearOf } from "../../static/js/lib/frame-marks.js";

test("a label stands above the click that it would cover, else in the middle of its mask", () => {
  const middle = { x: 100, y: 100 };
  assert.deepEqual(clearOf(middle, [{ x: 140, y: 100 }]), middle);
  const { x, y } = clearOf(middle, [{ x: 104, y: 97 }]);
  assert.equal(x, 100);
  assert.ok(97 - y >= 18, "half a label and a click's radius");
});
