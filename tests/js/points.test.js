import assert from "node:assert/strict";
import { test } from "node:test";

import { project } from "../../static/js/lib/points.js";

test("of two points on one line of sight the nearer one is drawn", () => {
  const cloud = {
    positions: Int16Array.from([0, -50, 0, 0, 50, 0]),
    colours: Uint8Array.from([9, 9, 9, 200, 0, 0]),
    radius: 50,
  };
  const picture = {
    width: 21,
    height: 21,
    data: new Uint8ClampedArray(4 * 21 * 21),
  };
  project(cloud, { yaw: 0, pitch: 0 }, picture);
  assert.deepEqual([...picture.data.slice(4 * (11 * 21 + 11), 4 * (11 * 21 + 11) + 4)], [9, 9, 9, 255]);
});
