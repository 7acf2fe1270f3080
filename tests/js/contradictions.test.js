import assert from "node:assert/strict";
import { test } from "node:test";

import { contradictionsOn, unseenOn } from "../../static/js/lib/contradictions.js";

/** A mask of these columns, 10 rows high, in an image of 100 x 20 pixels. */
const columns = (object, left, right, clicks = []) => ({
  object,
  name: `door_${object}`,
  mask: {
    width: 100,
    height: 20,
    left,
    top: 5,
    box_width: right - left,
    box_height: 10,
    bits: "",
  },
  pixels: new Uint8Array((right - left) * 10).fill(1),
  clicks,
});

test("masks that overlap along a border only, or are empty, are no contradiction", () => {
  assert.deepEqual(contradictionsOn([columns(1, 0, 51), columns(2, 50, 100), columns(3, 80, 80)]), []);
});

test("a large overlap of two masks is reported for both objects, and a full one proposes to merge them", () => {
  const some = contradictionsOn([columns(1, 0, 50), columns(2, 40, 90)]);
  assert.deepEqual(
    some.map(({ object, text }) => [object, text.split(":")[0]]),
    [
      [1, "Shares 20 % with door_2 here"],
      [2, "Shares 20 % with door_1 here"],
    ],
  );
  const most = contradictionsOn([columns(1, 0, 50), columns(2, 20, 50)]);
  assert.match(most[0].text, /^On the same thing as door_2 \(100 % shared\): merge or delete one/);
  assert.deepEqual(
    most.map(({ mergesWith }) => mergesWith),
    [
      { object: 2, name: "door_2" },
      { object: 1, name: "door_1" },
    ],
  );
});

test("a positive click outside the mask and a negative click inside it are reported", () => {
  const click = (x, label) => ({ x, y: 10.5, label });
  assert.deepEqual(contradictionsOn([columns(1, 0, 50, [click(20.5, 1), click(50.5, 1), click(70.5, 0)])]), []);
  assert.match(contradictionsOn([columns(1, 0, 50, [click(60.5, 1)])])[0].text, /lies outside its mask/);
  assert.match(contradictionsOn([columns(1, 0, 50, [click(20.5, 1), click(30.5, 0)])])[0].text, /lies inside its mask/);
});

test("a click on a frame without a mask is reported once segmentation is done, unless a user corrected that frame", () => {
  const point = { frame: 4, label: 1 };
  const object = (more = {}) => ({ id: 1, segment: "done", points: [point], frames: [], ...more });
  const said = (more, frame = 4, seen = false) => unseenOn([object(more)], frame, () => seen).map(({ text }) => text);
  assert.match(said()[0], /found no mask in this frame: remove the click/);
  assert.deepEqual(said({}, 4, true), []);
  assert.deepEqual(said({}, 5), []);
  assert.deepEqual(said({ segment: "running" }), []);
  assert.deepEqual(said({ points: [{ ...point, label: 0 }] }), []);
  assert.deepEqual(said({ frames: [{ frame: 4, mask: null }] }), []);
});

test("an open front may share its mask with what lies behind it", () => {
  const open = { ...columns(1, 0, 50), isOpen: true };
  assert.deepEqual(contradictionsOn([open, columns(2, 10, 40)]), []);
});
