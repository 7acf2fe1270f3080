import assert from "node:assert/strict";
import test from "node:test";
import {
  asText,
  following,
  fromText,
  remaining,
} from "../../static/js/lib/checklist.js";

const list = [
  { name: "drawer_1", category: "drawer" },
  { name: "oven_1", category: "oven" },
  { name: "mug", category: "mug" },
];

test("what no object is called is still to be clicked", () => {
  const left = remaining(list, [{ name: "Oven_1" }, { name: "vase" }]);
  assert.deepEqual(
    left.map(({ name }) => name),
    ["drawer_1", "mug"],
  );
});

test("the next one follows the last in the order of the list, and the first the end", () => {
  const left = [list[0], list[2]];
  assert.equal(following(list, left, "oven_1"), list[2]);
  assert.equal(following(list, left, "mug"), list[0]);
  assert.equal(following(list, left, null), list[0]);
  assert.equal(following(list, [], "mug"), null);
});

test("a list as text is that list again", () => {
  assert.deepEqual(fromText(asText(list)), list);
});

test("what a person wrote becomes names that can be used, each with a category", () => {
  assert.deepEqual(
    fromText("Top drawer; drawer\n\n wall_cabinet_2\n7\n,oven\n"),
    [
      { name: "Top_drawer", category: "drawer" },
      { name: "wall_cabinet_2", category: "wall_cabinet" },
      { name: "item_7", category: "object" }, // no name begins with a digit
    ],
  );
});
