import assert from "node:assert/strict";
import test from "node:test";
import { listed, meanOf, span } from "../../static/js/lib/listing.js";

const entry = (number, name, category, more = {}) => ({
  object: { id: 10 + number, name, category },
  number,
  sure: 0.9,
  hidden: false,
  locked: false,
  current: false,
  ...more,
});
const entries = [
  entry(1, "drawer_10", "drawer", { locked: true }),
  entry(2, "oven_1", "oven", { sure: 0.2 }),
  entry(3, "drawer_2", "drawer", { sure: null, hidden: true }),
];
const all = { typed: "", state: "all", order: "made" };
const names = (wanted) =>
  listed(entries, { ...all, ...wanted }).flatMap((group) =>
    group.entries.map(({ object }) => object.name),
  );

test("objects are filtered by assignment and found by the name of their assignee", () => {
  const some = [
    entry(1, "drawer_1", "drawer", { mine: true }),
    entry(2, "oven_1", "oven"),
    entry(3, "hood_1", "hood"),
  ];
  Object.assign(some[0].object, { assignee: "ann" });
  Object.assign(some[1].object, { assignee: "bea" });
  Object.assign(some[2].object, { assignee: null });
  const found = (wanted) =>
    listed(some, { ...all, ...wanted }).flatMap((group) =>
      group.entries.map(({ object }) => object.name),
    );
  assert.deepEqual(found({ state: "mine" }), ["drawer_1"]);
  assert.deepEqual(found({ state: "nobodys" }), ["hood_1"]);
  assert.deepEqual(found({ typed: "@bea" }), ["oven_1"]);
});

test("objects are sorted by name in natural order or by confidence, or grouped by category", () => {
  assert.deepEqual(names({ order: "name" }), [
    "drawer_2",
    "drawer_10",
    "oven_1",
  ]);
  assert.deepEqual(names({ order: "unsure" }), [
    "drawer_2",
    "oven_1",
    "drawer_10",
  ]);
  const groups = listed(entries, { ...all, order: "category" });
  assert.deepEqual(
    groups.map(({ heading, entries: of }) => [heading, of.length]),
    [
      ["drawer", 2],
      ["oven", 1],
    ],
  );
});

test("objects are filtered by state and by search text; the current one is always listed", () => {
  assert.deepEqual(names({ state: "doubtful" }), ["oven_1"]);
  assert.deepEqual(names({ state: "unmasked" }), ["drawer_2"]);
  assert.deepEqual(names({ state: "hidden" }), ["drawer_2"]);
  assert.deepEqual(names({ state: "locked" }), ["drawer_10"]);
  assert.deepEqual(names({ typed: "oven" }), ["oven_1"]);
  const worked = [...entries, entry(4, "sink_1", "sink", { current: true })];
  assert.deepEqual(
    listed(worked, { ...all, typed: "oven" })[0].entries.map(
      ({ number }) => number,
    ),
    [2, 4],
  );
});

test("a range of objects is selected in either direction, and a single object without a valid start", () => {
  assert.deepEqual(span([4, 7, 9, 2], 9, 4), [4, 7, 9]);
  assert.deepEqual(span([4, 7, 9, 2], 7, 2), [7, 9, 2]);
  assert.deepEqual(span([4, 7], null, 7), [7]);
  assert.deepEqual(span([4, 7], 99, 7), [7]);
});

test("the confidence of an object is the mean over its masks, and null without masks", () => {
  assert.equal(meanOf(new Map()), null);
  assert.equal(
    meanOf(
      new Map([
        [1, 0.5],
        [2, 1],
      ]),
    ),
    0.75,
  );
});
