import assert from "node:assert/strict";
import { test } from "node:test";

import { disagreements } from "../../static/js/lib/merge.js";

test("only what two people set differently is asked about", () => {
  const seen = { name: "a", category: "drawer" };
  assert.deepEqual(disagreements(seen, { name: "b" }, { name: "c", category: "drawer" }), ["name"]);
  assert.deepEqual(disagreements(seen, { name: "b" }, { name: "a", category: "cabinet" }), []); // theirs is elsewhere
  assert.deepEqual(disagreements(seen, { name: "b" }, { name: "b", category: "drawer" }), []); // the same thought
});
