import assert from "node:assert/strict";
import { test } from "node:test";

import { nextDoubtful, runs, worstFirst } from "../../static/js/lib/lanes.js";

test("the next doubtful frame is found in a direction, and the frames to check are sorted worst first", () => {
  const frames = [0, 3, 7, 9].map((index) => ({ index }));
  const sure = new Map([
    [0, 0.9],
    [3, 0.4],
    [7, 0.8],
    [9, 0.1],
  ]);
  assert.equal(nextDoubtful(frames, sure, 0, 1), 1);
  assert.equal(nextDoubtful(frames, sure, 1, 1), 3);
  assert.equal(nextDoubtful(frames, sure, 1, -1), null);
  assert.deepEqual(
    worstFirst(sure, 3)
      .map((e) => e.frame)
      .slice(0, 2),
    [9, 3],
  );
  assert.equal(worstFirst(sure, 10).length, 4);
});

test("a lane has one bar for each run of consecutive frames that are all sure or all doubtful", () => {
  assert.deepEqual(runs([0.9, 0.8, undefined, 0.9, 0.2, 0.1]), [
    { from: 0, to: 2, doubtful: false },
    { from: 3, to: 4, doubtful: false },
    { from: 4, to: 6, doubtful: true },
  ]);
});
