import assert from "node:assert/strict";
import { test } from "node:test";

import { partedText } from "../../static/js/lib/parted.js";

test("the message names the objects that a front now borders on, or says that the front is whole again", () => {
  assert.equal(partedText("door_1", ["door_2", "door_3"]), "door_1 now ends at the seam to door_2, door_3");
  assert.equal(partedText("door_1", []), "door_1 has its whole front again");
});
