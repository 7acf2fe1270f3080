import assert from "node:assert/strict";
import { test } from "node:test";

import { readings, spansOf, stateIn } from "../../static/js/lib/openings.js";

const state = (frame, value, sigma = 0.01) => ({ frame, value, sigma });
const DOOR = {
  object: 1,
  part: "",
  kind: "revolute",
  largest: 1.5,
  source: "measured",
  states: [
    state(0, 0.01),
    state(10, 0.7, 0.05),
    state(20, 1.4),
    state(30, null, null),
    state(50, 0.02),
  ],
};

test("the state of an opening is given in words, with twice its standard deviation", () => {
  assert.equal(stateIn(DOOR, 0), "closed");
  assert.equal(stateIn(DOOR, 10), "opening, 40° ± 6°");
  assert.equal(stateIn(DOOR, 20), "open, 80° ± 1°");
  assert.equal(stateIn(DOOR, 30), "unknown");
  assert.equal(stateIn(DOOR, 40), "");
  const drawer = {
    ...DOOR,
    kind: "prismatic",
    largest: 0.4,
    states: [state(0, 0.2, 0.003)],
  };
  assert.equal(stateIn(drawer, 0), "opening, 20 cm ± 6 mm");
});

test("frames that do not show the front split its spans", () => {
  const spans = spansOf(
    { ...DOOR, states: [state(0, 0), state(10, 0), state(30, 0)] },
    [0, 10, 20, 30],
  );
  assert.deepEqual(spans, [
    { from: 0, to: 2, phase: "closed" },
    { from: 3, to: 4, phase: "closed" },
  ]);
});

test("the curve has known states only, at the positions of their frames", () => {
  assert.deepEqual(
    readings(DOOR, [0, 10, 20, 30, 40, 50]).map(({ position }) => position),
    [0, 1, 2, 5],
  );
});
