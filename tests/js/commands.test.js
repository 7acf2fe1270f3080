import assert from "node:assert/strict";
import { test } from "node:test";

import { ranked } from "../../static/js/lib/commands.js";

test("the command palette lists commands that contain all typed words, sorted by rank", () => {
  const commands = ["Next frame", "Object drawer_1", "Frame without masks"].map((text) => ({ text, run: () => {} }));
  assert.deepEqual(
    ranked(commands, "frame").map((c) => c.text),
    ["Frame without masks", "Next frame"],
  );
  assert.deepEqual(
    ranked(commands, "draw obj").map((c) => c.text),
    ["Object drawer_1"],
  );
  assert.equal(ranked(commands, "").length, 3);
});
