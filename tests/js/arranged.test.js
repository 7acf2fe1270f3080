import assert from "node:assert/strict";
import test from "node:test";

import { arranged } from "../../static/js/lib/arranged.js";

/**
 * A front 0.5 m wide and 0.2 m high.
 * @param {number} object @param {number[]} corner its top left @param {number[]} right direction of its width
 */
const front = (object, [x = 0, y = 0, z = 0], [rx = 0, ry = 0]) => ({
  object,
  corners_m: [
    [x, y, z],
    [x + rx / 2, y + ry / 2, z],
    [x + rx / 2, y + ry / 2, z - 0.2],
    [x, y, z - 0.2],
  ],
  handle: null,
  edges: [],
});
const NORTH = [1, 0]; // to the right when looking along +y
const EAST = [0, -1];
const ids = (/** @type {number[]} */ ...all) => all.map((id) => ({ id }));
const order = (/** @type {{ id: number }[]} */ objects) => objects.map(({ id }) => id);

test("objects on a wall are ordered by column from the left, each from top to bottom; those without a front come last", () => {
  const fronts = [
    front(1, [0.6, 2, 0.8], NORTH),
    front(2, [0, 2, 0.5], NORTH),
    front(3, [0.01, 2.3, 1.9], NORTH), // a wall unit is further back
    front(4, [0.6, 2, 0.5], NORTH),
    front(9, [0, 2, 3], NORTH), // of an object that is not in the list
  ];
  assert.deepEqual(order(arranged(ids(7, 1, 2, 3, 4, 6), fronts)), [3, 2, 1, 4, 7, 6]);
});

test("walls are ordered as seen when turning to the right, whatever the order of the input", () => {
  const fronts = [front(1, [2, 1, 0.8], EAST), front(2, [0, 2, 0.8], NORTH), front(3, [2, 1.6, 0.8], EAST)];
  assert.deepEqual(order(arranged(ids(1, 2, 3), fronts)), [2, 3, 1]);
  assert.deepEqual(order(arranged(ids(1, 2, 3), [...fronts].reverse())), [2, 3, 1]);
});
