import assert from "node:assert/strict";
import { test } from "node:test";

import { Gestures } from "../../static/js/lib/gestures.js";

test("a press is a click, a drag draws a box, pans or moves the mark under it, and two fingers only pinch", () => {
  const at = (x, y) => ({ x, y });
  const free = { pan: false, held: null };
  const gestures = new Gestures();
  gestures.press(1, at(10, 10), free);
  assert.equal(gestures.move(1, at(12, 11), 3), null);
  assert.deepEqual(gestures.release(1, at(12, 11)), {
    kind: "click",
    at: at(12, 11),
  });
  gestures.press(1, at(10, 10), free);
  assert.deepEqual(gestures.move(1, at(30, 40), 3), {
    kind: "box",
    from: at(10, 10),
    to: at(30, 40),
  });
  assert.deepEqual(gestures.box, { from: at(10, 10), to: at(30, 40) });
  assert.deepEqual(gestures.release(1, at(31, 41)), {
    kind: "box",
    from: at(10, 10),
    to: at(31, 41),
  });
  gestures.press(1, at(10, 10), { pan: false, held: "mark" });
  assert.deepEqual(gestures.move(1, at(20, 10), 3), {
    kind: "carry",
    held: "mark",
    at: at(20, 10),
  });
  assert.equal(gestures.box, null);
  assert.deepEqual(gestures.release(1, at(20, 10)), {
    kind: "drop",
    held: "mark",
    at: at(20, 10),
  });
  gestures.press(1, at(10, 10), { pan: true, held: null });
  gestures.move(1, at(20, 10), 3);
  assert.deepEqual(gestures.move(1, at(21, 12), 3), {
    kind: "pan",
    by: at(1, 2),
  });
  assert.equal(gestures.release(1, at(21, 12)), null);
  gestures.press(1, at(10, 10), free);
  gestures.press(2, at(20, 10), free);
  assert.equal(gestures.move(2, at(30, 10), 3).kind, "pinch");
  assert.equal(gestures.release(2, at(30, 10)), null);
  assert.equal(gestures.release(1, at(10, 10)), null);
});
