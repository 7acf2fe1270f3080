import assert from "node:assert/strict";
import { test } from "node:test";

import { disagreements } from "../../static/js/lib/merge.js";

test("only fields that two people set to different values are in conflict", () => {
  const seen = { name: "a", category: "drawer" };
  assert.deepEqual(disagreements(seen, { name: "b" }, { name: "c", category: "drawer" }), ["name"]);
  assert.deepEqual(disagreements(seen, { name: "b" }, { name: "a", category: "cabinet" }), []); // they changed another field
  assert.deepEqual(disagreements(seen, { name: "b" }, { name: "b", category: "drawer" }), []); // both set the same value
});
