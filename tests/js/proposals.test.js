import assert from "node:assert/strict";
import { test } from "node:test";

import { neighbour, proposedAt, surest } from "../../static/js/lib/proposals.js";

test("stepping through proposals wraps around and skips removed ones; confirming all leaves out doubtful ones", () => {
  const items = /** @type {any[]} */ (
    ["a", "b", "c"].map((id, k) => ({
      id,
      confidence: 0.9 - 0.3 * k,
      doubts: [],
    }))
  );
  const step = (/** @type {string | null} */ current, /** @type {1 | -1} */ by, /** @type {string[]} */ ...gone) =>
    neighbour(items, current, by, new Set(gone))?.id;
  assert.equal(step(null, 1), "a");
  assert.equal(step(null, -1), "c");
  assert.equal(step("c", 1), "a");
  assert.equal(step("a", -1), "c");
  assert.equal(step("a", 1, "a", "b"), "c");
  assert.equal(step("a", 1, "a", "b", "c"), undefined);
  const ids = (/** @type {any[]} */ all) => all.map((item) => item.id);
  assert.deepEqual(ids(surest(items, 0.6).sure), ["a", "b"]);
  const [first, second] = [{ ...items[0], doubts: ["overlaps a drawer"] }, items[1]];
  assert.deepEqual(ids(surest([first, second], 0.6).sure), ["b"]); // the other has a doubt that a person should check
  assert.deepEqual(ids(surest([first, second], 0.6).leftOut), ["a"]);
});

test("a click is on the smallest proposal of its frame whose outline contains it", () => {
  const square = (/** @type {number} */ from, /** @type {number} */ to) =>
    [from, to].flatMap((x) => (x === from ? [[x, from], [x, to]] : [[x, to], [x, from]]));
  const items = /** @type {any[]} */ ([
    { id: "cabinet", frame: 3, outline: square(0, 40) },
    { id: "bottle", frame: 3, outline: square(10, 20) },
    { id: "other", frame: 4, outline: square(0, 40) },
    { id: "nothing", frame: 3, outline: [] },
    { id: "ell", frame: 5, outline: [[0, 0], [40, 0], [40, 10], [10, 10], [10, 40], [0, 40]] },
  ]);
  const at = (/** @type {number} */ frame, /** @type {number} */ x, /** @type {number} */ y) =>
    proposedAt(items, { frame, x, y })?.id;
  assert.equal(at(3, 30, 30), "cabinet");
  assert.equal(at(3, 15, 15), "bottle");
  assert.equal(at(4, 15, 15), "other");
  assert.equal(at(5, 5, 30), "ell");
  assert.equal(at(5, 30, 30), undefined); // in the notch
  assert.equal(at(3, 50, 5), undefined);
});
