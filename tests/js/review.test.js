// @ts-check
import assert from "node:assert/strict";
import { test } from "node:test";

import {
  apply,
  motion,
  product,
} from "../../r2c2r_core/export/review_page/algebra.js";
import { Kitchen } from "../../r2c2r_core/export/review_page/kitchen.js";

const STILL = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
const unitBox = {
  low: [0, 0, 0],
  span: [1, 1, 1],
  positions: "",
  uv: "",
  indices: "",
  texture: -1,
  colour: [1, 1, 1],
};

/** A cupboard at the origin, its door hinged about z at x = 1, and a drawer on the door that slides along x. */
function kitchen() {
  const shape = { object: "a", surface: unitBox, colliders: null };
  const moved = [...STILL.slice(0, 12), 1, 0, 0, 1];
  const hinge = {
    name: "h",
    kind: /** @type {const} */ ("revolute"),
    axis: [0, 0, 1],
    lower: 0,
    upper: Math.PI / 2,
  };
  const slide = {
    name: "s",
    kind: /** @type {const} */ ("prismatic"),
    axis: [1, 0, 0],
    lower: 0,
    upper: 0.5,
  };
  return new Kitchen({
    name: "k",
    passed: true,
    yaw: 0,
    textures: [],
    objects: [],
    findings: [],
    bodies: [
      { ...shape, name: "base", parent: -1, pose: STILL, joint: null },
      { ...shape, name: "door", parent: 0, pose: moved, joint: hinge },
      { ...shape, name: "box", parent: 1, pose: STILL, joint: slide },
    ],
  });
}

/** @type {(got: number[], wanted: number[]) => void} */
function near(got, wanted) {
  wanted.forEach((value, k) =>
    assert.ok(Math.abs((got[k] ?? NaN) - value) < 1e-9, `${got} / ${wanted}`),
  );
}

test("a joint motion followed by its inverse is the identity", () => {
  const turn = {
    name: "",
    kind: /** @type {const} */ ("revolute"),
    axis: [0.6, 0, 0.8],
    lower: 0,
    upper: 1,
  };
  near(product(motion(turn, 0.7), motion(turn, -0.7)), STILL);
});

test("a drawer on an open door turns with the door and slides along its own axis", () => {
  const scene = kitchen();
  scene.put(1, Math.PI / 2);
  scene.put(2, 0.5);
  scene.place();
  near(apply(scene.worlds[2] ?? [], [0, 0, 0]), [1, 0.5, 0]);
});

test("a joint moves to its goal in steps and stops there", () => {
  const scene = kitchen();
  scene.toggle(2);
  assert.equal(scene.step(0.1), true);
  near([scene.positions[2] ?? NaN], [0.075]);
  for (let k = 0; k < 20; k += 1) scene.step(0.1);
  near([scene.positions[2] ?? NaN], [0.5]);
  assert.equal(scene.step(0.1), false);
});

test("a ray hits the nearest body at its current pose", () => {
  const scene = kitchen();
  assert.equal(scene.hit([0.5, 0.5, 5], [0, 0, -1]), 0);
  assert.equal(scene.hit([1.5, 0.5, 5], [0, 0, -1]), 1);
  assert.equal(scene.hit([9, 9, 5], [0, 0, -1]), -1);
  scene.put(1, Math.PI / 2);
  scene.place();
  assert.equal(scene.hit([1.5, 0.5, 5], [0, 0, -1]), -1);
});
