import assert from "node:assert/strict";
import test from "node:test";
import { moved, read } from "../../static/js/lib/panels.js";

const LIST = /** @type {const} */ ({ name: "list", label: "List", along: "x", grows: 1, least: 200, most: 480 });

test("a panel is limited to its minimum and maximum size, and folds when dragged far below the minimum", () => {
  assert.deepEqual(moved(310.4, LIST), { px: 310, folded: false });
  assert.deepEqual(moved(150, LIST), { px: 200, folded: false });
  assert.deepEqual(moved(900, LIST), { px: 480, folded: false });
  assert.deepEqual(moved(99, LIST), { px: null, folded: true });
});

test("a stored panel size is restored; one that is out of range or unreadable is ignored", () => {
  assert.deepEqual(read('{"px": 310, "folded": true}', LIST), { px: 310, folded: true });
  assert.deepEqual(read('{"px": 9000, "folded": false}', LIST), { px: null, folded: false });
  for (const kept of [null, "", "null", "{", '{"px": "wide"}'])
    assert.deepEqual(read(kept, LIST), { px: null, folded: false });
});
