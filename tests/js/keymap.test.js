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

test("no key is bound to two actions on one page", () => assert.deepEqual(clashes(), []));

test("a key press finds the action bound to it on the page", () => {
  assert.equal(actionOf(key("ArrowRight"), "annotate"), "next-frame");
  assert.equal(actionOf(key("ArrowRight", { shiftKey: true }), "annotate"), "forward-ten");
  assert.equal(actionOf(key("Z", { ctrlKey: true, shiftKey: true }), "annotate"), "redo");
  assert.equal(actionOf(key("z", { metaKey: true }), "review"), "undo");
  assert.equal(actionOf(key("?", { shiftKey: true }), "review"), "help");
  assert.equal(actionOf(key("ArrowRight"), "review"), null);
  assert.ok(KEYMAP.every((binding) => binding.keys.length > 0));
});

test("keys used by the viser viewer are not bound on the review page", () => {
  for (const taken of ["w", "a", "s", "d", "q", "e", "ArrowLeft", "ArrowRight"])
    assert.equal(actionOf(key(taken), "review"), null);
});

test("single-letter shortcuts can be turned off; Ctrl combinations and arrow keys keep working", () => {
  assert.equal(actionOf(key("g"), "annotate"), "segment");
  assert.equal(actionOf(key("g"), "annotate", false), null);
  assert.equal(actionOf(key("k", { ctrlKey: true }), "annotate", false), "palette");
  assert.equal(actionOf(key("ArrowRight"), "annotate", false), "next-frame");
});

test("keys are printed with their symbols, digits as a range, and no letter twice", () => {
  assert.deepEqual(printed(["Shift+ArrowRight", "v"]), ["Shift →", "V"]);
  assert.deepEqual(printed(["1", "2", "3"]), ["1 – 3"]);
  assert.deepEqual(printed(["j", "l", "Shift+j", "Shift+l"]), ["J", "L"]);
});
