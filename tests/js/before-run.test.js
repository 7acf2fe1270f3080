import assert from "node:assert/strict";
import test from "node:test";
import { framesToLook, spoiling } from "../../static/js/lib/before-run.js";

/** @type {(object: number, frames: number[]) => any} */
const lane = (object, frames) => ({
  object,
  frames,
  state: "done",
  source: "live",
  complete: true,
  confidences: [],
});
/** @type {(id: number, more?: object) => any} */
const object = (id, more = {}) => ({
  id,
  points: [{ frame: 4 }],
  front: null,
  segment: "done",
  notices: [],
  ...more,
});

test("the frames to check together show every object that has frames, up to the given limit", () => {
  assert.deepEqual(
    framesToLook([
      lane(1, [0, 3]),
      lane(2, [3, 7]),
      lane(3, [7, 9]),
      lane(4, []),
    ]),
    [3, 7],
  );
  assert.deepEqual(
    framesToLook([lane(1, [0]), lane(2, [1]), lane(3, [2])], 2),
    [0, 1],
  );
  assert.deepEqual(framesToLook([]), []);
});

test("a contradiction between two objects is reported once, on the first frame that shows it", () => {
  const said = [
    { object: 1, other: 2, text: "on the same thing as b" },
    { object: 2, other: 1, text: "on the same thing as a" },
  ];
  const told = spoiling(
    [object(1), object(2)],
    [
      { frame: 3, said },
      { frame: 7, said },
    ],
  );
  assert.deepEqual(told, [
    { object: 1, frame: 3, text: "on the same thing as b" },
  ]);
});

test("an object without clicks is reported without a frame, one without a mask with the frame of its click", () => {
  const told = spoiling(
    [
      object(1, { points: [] }),
      object(2, { segment: "failed", notices: ["no depth there"] }),
    ],
    [],
  );
  assert.deepEqual(
    told.map(({ object, frame }) => [object, frame]),
    [
      [1, null],
      [2, 4],
    ],
  );
  assert.match(told[0]?.text ?? "", /no click yet/);
  assert.match(told[1]?.text ?? "", /no depth there/);
});
