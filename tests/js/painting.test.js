import assert from "node:assert/strict";
import { test } from "node:test";

import { decodeBox } from "../../static/js/lib/masks.js";
import {
  encoded,
  isEmpty,
  runsOf,
  wholeMask,
} from "../../static/js/lib/painting.js";

const MASK = {
  width: 4,
  height: 2,
  pixels: Uint8Array.from([0, 1, 1, 0, 0, 0, 0, 1]),
};

test("the run lengths of a mask start with unset pixels and cover the frame", () => {
  assert.deepEqual(runsOf(MASK), { width: 4, height: 2, runs: [1, 2, 4, 1] });
  assert.deepEqual(
    runsOf({ width: 2, height: 1, pixels: Uint8Array.from([1, 1]) }).runs,
    [0, 2],
  );
  assert.deepEqual(
    runsOf({ width: 2, height: 1, pixels: new Uint8Array(2) }).runs,
    [2],
  );
});

test("an encoded mask decodes to the same mask, and a box is placed in its frame", async () => {
  const bits = await encoded(MASK);
  assert.deepEqual(wholeMask(bits, await decodeBox(bits)), MASK);
  assert.equal(isEmpty(MASK), false);
  const box = { ...bits, left: 1, top: 1, box_width: 2, box_height: 1 };
  assert.deepEqual(
    [...wholeMask(box, Uint8Array.from([1, 1])).pixels],
    [0, 0, 0, 0, 0, 1, 1, 0],
  );
});

test("an empty mask is encoded with an empty box and decodes to an empty mask", async () => {
  const none = { width: 4, height: 2, pixels: new Uint8Array(8) };
  assert.ok(isEmpty(none));
  const bits = await encoded(none);
  assert.deepEqual([bits.box_width, bits.box_height], [0, 0]);
  assert.deepEqual(wholeMask(bits, await decodeBox(bits)), none);
});
