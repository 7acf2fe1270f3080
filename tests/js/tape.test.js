import assert from "node:assert/strict";
import { test } from "node:test";

import { reading, withPoint } from "../../static/js/review/tape.js";

test("the tape measure gives length, horizontal and vertical parts, slope and heights above the floor", () => {
  const points = [
    [0, 0, 0.1],
    [0.3, 0.4, 0.6],
  ].reduce(withPoint, []);
  assert.equal(
    reading(points),
    "707 mm long; 500 mm level, 500 mm up, 45.0° steep; 100 mm and 600 mm above the floor",
  );
  assert.deepEqual(withPoint(points, [1, 1, 1]), [[1, 1, 1]]); // a third point starts a new measurement
  assert.match(reading([[0, 0, 0.9]]), /^900 mm above the floor/);
});
