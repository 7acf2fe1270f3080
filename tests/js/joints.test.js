import assert from "node:assert/strict";
import { test } from "node:test";

import { motionOf, withLimit } from "../../static/js/lib/joints.js";

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

test("a limit is stored by the joint's name where an object has several joints, and without it where it has one", () => {
  const override = /** @type {any} */ ({ joints: { left: [0, 1], right: [0, 1.2] } });
  assert.deepEqual(withLimit(override, "left", false, 1.5), { joints: { left: [0, 1.5], right: [0, 1.2] } });
  assert.deepEqual(withLimit(override, "left", false, null), { joints: { right: [0, 1.2] } });
  assert.deepEqual(withLimit(override, "left", true, 1.5), { joint_lower: 0, joint_upper: 1.5 });
  assert.deepEqual(withLimit(override, "left", true, null), { joint_lower: null, joint_upper: null });
});
