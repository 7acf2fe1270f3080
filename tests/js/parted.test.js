import assert from "node:assert/strict";
import { test } from "node:test";

import { partedText } from "../../static/js/lib/parted.js";

test("who gave way to whom is said by their names, and also that a front is whole again", () => {
  assert.equal(partedText("door_1", ["door_2", "door_3"]), "door_1 now ends at the seam to door_2, door_3");
  assert.equal(partedText("door_1", []), "door_1 has its whole front again");
});
