import assert from "node:assert/strict";
import { test } from "node:test";

import { neighbour, surest } from "../../static/js/lib/proposals.js";

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
