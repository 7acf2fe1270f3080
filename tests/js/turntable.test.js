import assert from "node:assert/strict";
import { test } from "node:test";

import { differs, turnedBy } from "../../static/js/lib/turntable.js";

test("a drag turns the candidate by whole images in either direction", () => {
  assert.equal(turnedBy(3, 25), 5);
  assert.equal(turnedBy(3, -25), 1);
  assert.equal(turnedBy(3, 2), 3);
});

test("the deviation of a candidate is in millimetres where its size is known, else in percent", () => {
  const all = { against: "c0", longest_m: 0.8 };
  assert.equal(
    differs({ share: 0.124, most: 0.05 }, all),
    "Differs from c0 on 12 % of its surface, by 40 mm at most.",
  );
  assert.equal(
    differs({ share: 0.001, most: 0.01 }, all),
    "Almost the same as c0: 8 mm at most.",
  );
  assert.match(
    differs({ share: 0.5, most: 0.05 }, { against: "c0", longest_m: null }),
    /by 5 % of its longest side/,
  );
});
