import assert from "node:assert/strict";
import { test } from "node:test";

import { actionOf, clashes, KEYMAP, printed } from "../../static/js/lib/keymap.js";

const key = (name, held = {}) => ({
  key: name,
  ctrlKey: false,
  metaKey: false,
  shiftKey: false,
  altKey: false,
  ...held,
});

test("no key has two meanings on a page", () => assert.deepEqual(clashes(), []));

test("every key of the table finds its action", () => {
  assert.equal(actionOf(key("ArrowRight"), "annotate"), "next-frame");
  assert.equal(actionOf(key("ArrowRight", { shiftKey: true }), "annotate"), "forward-ten");
  assert.equal(actionOf(key("Z", { ctrlKey: true, shiftKey: true }), "annotate"), "redo");
  assert.equal(actionOf(key("z", { metaKey: true }), "review"), "undo");
  assert.equal(actionOf(key("?", { shiftKey: true }), "review"), "help");
  assert.equal(actionOf(key("ArrowRight"), "review"), null);
  assert.ok(KEYMAP.every((binding) => binding.keys.length > 0));
});

test("keys that viser takes are free on the review page", () => {
  for (const taken of ["w", "a", "s", "d", "q", "e", "ArrowLeft", "ArrowRight"])
    assert.equal(actionOf(key(taken), "review"), null);
});

test("letters alone can be turned off; keys with Ctrl stay", () => {
  assert.equal(actionOf(key("g"), "annotate"), "segment");
  assert.equal(actionOf(key("g"), "annotate", false), null);
  assert.equal(actionOf(key("k", { ctrlKey: true }), "annotate", false), "palette");
  assert.equal(actionOf(key("ArrowRight"), "annotate", false), "next-frame");
});

test("keys are printed as they stand on a keyboard, and none twice", () => {
  assert.deepEqual(printed(["Shift+ArrowRight", "v"]), ["Shift →", "V"]);
  assert.deepEqual(printed(["1", "2", "3"]), ["1 – 3"]);
  assert.deepEqual(printed(["j", "l", "Shift+j", "Shift+l"]), ["J", "L"]);
});
