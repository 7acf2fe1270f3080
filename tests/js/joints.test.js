import assert from "node:assert/strict";
import { test } from "node:test";

import { handleAtHinge, jointLine, motionOf, withLimit } from "../../static/js/lib/joints.js";

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

const door = (/** @type {object} */ more) =>
  /** @type {any} */ ({ type: "revolute", axis: [0, 0, -1], origin: [-0.3, -0.3, 0], upper: 1.92, ...more });

test("a joint is one line: its motion and limit, and where each comes from", () => {
  const guessed = door({ sources: { axis: "default", origin: "inferred", limits: "default" } });
  assert.equal(jointLine(guessed), "Hinged left, a guess: usual for its category; opens 110°, usual for its category");
  const drawer = door({ type: "prismatic", axis: [0, -1, 0], upper: 0.35, sources: { axis: "inferred", limits: "at_least" } });
  assert.equal(jointLine(drawer), "Slides out; opens 35 cm or more: seen so far open");
});

test("a hinge set on the handle's side is questioned, and only that", () => {
  const doors = [door({ handle: [-0.25, -0.3, 0.1], sources: {} })];
  assert.match(handleAtHinge("left", doors), /on the hinge's side \(left\)/);
  assert.equal(handleAtHinge("right", doors), "");
  assert.equal(handleAtHinge(null, doors), "");
  assert.equal(handleAtHinge("left", [door({ handle: null, sources: {} })]), "");
});
