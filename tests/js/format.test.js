import assert from "node:assert/strict";
import { test } from "node:test";

import { ago, bytes, counted, duration, jointValue, usableName } from "../../static/js/lib/format.js";

test("sizes, durations, ages, counts and joint values are formatted with their units", () => {
  assert.equal(bytes(999), "999 B");
  assert.equal(bytes(1_500_000), "1.5 MB");
  assert.equal(duration(75), "1 min 15 s");
  assert.equal(ago(0, 10), "just now");
  assert.equal(ago(0, 7200), "2 h ago");
  assert.equal(counted(1, "object"), "1 object");
  assert.equal(jointValue("revolute", Math.PI / 2), "90°");
  assert.equal(jointValue("prismatic", 0.42), "42 cm");
});

test("a typed name is converted to one that simulators accept", () => {
  for (const [typed, name] of [
    ["cook books", "cook_books"],
    [" Müsli-Schüssel ", "Musli_Schussel"],
    ["mom's cup (blue)", "mom_s_cup_blue"],
    ["drawer_1", "drawer_1"],
    ["架子", ""],
    ["2-door cabinet", "item_2_door_cabinet"],
    ["CON", "item_CON"], // a reserved name on Windows
    ["console", "console"],
  ])
    assert.equal(usableName(typed ?? ""), name);
});
