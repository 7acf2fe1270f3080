import assert from "node:assert/strict";
import { test } from "node:test";

import { inkOn } from "../../static/js/lib/colour.js";

test("text is light on the dark colours of the palette and dark on the light ones", () => {
  assert.deepEqual(["#0072b2", "#f0e442", "#000000", "#e69f00"].map(inkOn), [
    "#ffffff",
    "#10131a",
    "#ffffff",
    "#10131a",
  ]);
});
