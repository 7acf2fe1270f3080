import assert from "node:assert/strict";
import { test } from "node:test";

import { motionOf } from "../../static/js/lib/joints.js";

test("the motion of a joint is described as seen by a person in front of the object", () => {
  const joint = (
    /** @type {any} */ type,
    /** @type {number[]} */ axis,
    /** @type {number[]} */ origin,
  ) => motionOf(/** @type {any} */ ({ type, axis, origin }));
  assert.equal(joint("prismatic", [0, -1, 0], [0, 0, 0]), "Slides out");
  assert.equal(joint("prismatic", [1, 0, 0], [0, 0, 0]), "Slides right");
  assert.equal(joint("prismatic", [-0.99, 0.05, 0], [0, 0, 0]), "Slides left");
  assert.equal(joint("revolute", [0, 0, -1], [-0.3, -0.3, 0]), "Hinged left");
  assert.equal(joint("revolute", [0, 0, 1], [0.3, -0.3, 0]), "Hinged right");
  assert.equal(joint("revolute", [1, 0, 0], [0, -0.3, -0.3]), "Hinged below");
});
