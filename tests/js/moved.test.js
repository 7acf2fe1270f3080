import assert from "node:assert/strict";
import { test } from "node:test";

import { moved, shiftBetween } from "../../static/js/lib/moved.js";

test("the shift between two poses is the one that was applied, along the axes of the box", () => {
  const [c, s] = [Math.cos(0.7), Math.sin(0.7)];
  const pose = [
    [c, -s, 0, 1],
    [s, c, 0, 2],
    [0, 0, 1, 0.5],
    [0, 0, 0, 1],
  ];
  const shift = { right: 0.1, back: -0.02, up: 0.3, turn: -0.4 };
  const back = shiftBetween(pose, moved(pose, shift));
  for (const name of Object.keys(shift)) assert.ok(Math.abs(back[name] - shift[name]) < 1e-12, name);
  const faced = moved(
    [
      [1, 0, 0, 0],
      [0, 1, 0, 0],
      [0, 0, 1, 0],
      [0, 0, 0, 1],
    ],
    { right: 1, back: 2, up: 3, turn: Math.PI / 2 },
  );
  assert.deepEqual(
    faced.slice(0, 3).map((row) => row[3]),
    [1, 2, 3],
  ); // to the right as seen by a person facing its front at -Y
  assert.deepEqual(
    faced.slice(0, 2).map((row) => Math.round(row[0])),
    [0, 1],
  ); // its width now runs along +Y
});
