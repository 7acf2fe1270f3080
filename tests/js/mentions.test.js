import assert from "node:assert/strict";
import { test } from "node:test";

import { typedName, withName } from "../../static/js/lib/mentions.js";

test("a mention is recognised after an @ that begins a word", () => {
  assert.deepEqual(typedName("look, @Be", 9), { at: 6, typed: "be" });
  assert.deepEqual(typedName("@", 1), { at: 0, typed: "" });
  assert.equal(typedName("bea@home", 8), null);
  assert.equal(typedName("@bea look", 9), null);
  assert.deepEqual(typedName("@be look", 3), { at: 0, typed: "be" });
});

test("a chosen name replaces the typed part of a mention, followed by one space", () => {
  assert.deepEqual(withName("ask @be", 7, "bea"), { text: "ask @bea ", caret: 9 });
  assert.deepEqual(withName("ask @be or so", 7, "bea"), { text: "ask @bea or so", caret: 9 });
});
