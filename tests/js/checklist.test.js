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

test("checklist entries remain until an object has their name, ignoring case", () => {
  const left = remaining(list, [{ name: "Oven_1" }, { name: "vase" }]);
  assert.deepEqual(
    left.map(({ name }) => name),
    ["drawer_1", "mug"],
  );
});

test("the next entry is the first remaining one after the given entry, wrapping around at the end", () => {
  const left = [list[0], list[2]];
  assert.equal(following(list, left, "oven_1"), list[2]);
  assert.equal(following(list, left, "mug"), list[0]);
  assert.equal(following(list, left, null), list[0]);
  assert.equal(following(list, [], "mug"), null);
});

test("a checklist converted to text is parsed to the same checklist", () => {
  assert.deepEqual(fromText(asText(list)), list);
});

test("a typed checklist is parsed to valid object names, each with a category", () => {
  assert.deepEqual(
    fromText("Top drawer; drawer\n\n wall_cabinet_2\n7\n,oven\n"),
    [
      { name: "Top_drawer", category: "drawer" },
      { name: "wall_cabinet_2", category: "wall_cabinet" },
      { name: "item_7", category: "object" }, // a name must not begin with a digit
    ],
  );
});
