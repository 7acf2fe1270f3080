import assert from "node:assert/strict";
import { test } from "node:test";

import { between, copied, copiedWords } from "../../static/js/lib/copied.js";

/** @param {object} override @returns {any} */
const group = (override) => ({
  override: {
    hinge: null,
    joint_lower: null,
    joint_upper: null,
    built_as: null,
    colour: null,
    ...override,
  },
});

test("hinge, limits and type of opening are copied to other objects; size, pose and candidate are not", () => {
  const from = group({
    hinge: "left",
    joint_lower: 0,
    joint_upper: 1.5,
    dimensions_m: [1, 1, 1],
    pose: [[1]],
    candidate: "c2",
  });
  assert.deepEqual(copied(from), {
    hinge: "left",
    joint_lower: 0,
    joint_upper: 1.5,
  });
  assert.equal(copiedWords(copied(from)), "hinge and limits");
  assert.equal(
    copiedWords(copied(group({ built_as: "drawer" }))),
    "how it opens",
  );
  assert.equal(copiedWords(copied(group({}))), "");
});

test("a Shift selection includes all objects between two in the list, in either direction", () => {
  assert.deepEqual(between([4, 7, 9, 2], 9, 7), [7, 9]);
  assert.deepEqual(between([4, 7, 9, 2], 4, 2), [4, 7, 9, 2]);
  assert.deepEqual(between([4, 7], 99, 7), [7]);
});
