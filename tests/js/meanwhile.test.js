import assert from "node:assert/strict";
import test from "node:test";
import { Meanwhile } from "../../static/js/lib/meanwhile.js";

test("an update received while a list is loading is applied at once and again after the list", async () => {
  const [meanwhile, known] = [new Meanwhile(), new Map([["a", "waiting"]])];
  /** @type {(list: [string, string][]) => void} */
  let answer = () => {};
  const list = new Promise(
    (/** @type {(list: [string, string][]) => void} */ done) => (answer = done),
  );
  const filled = meanwhile.during(
    list,
    (found) => (
      known.clear(),
      found.forEach(([name, state]) => known.set(name, state))
    ),
  );
  meanwhile.take(() => known.set("a", "done"));
  assert.deepEqual([...known], [["a", "done"]]);
  answer([
    ["a", "waiting"],
    ["b", "waiting"],
  ]);
  await filled;
  assert.deepEqual(
    [...known],
    [
      ["a", "done"],
      ["b", "waiting"],
    ],
  );
});

test("updates received during a failed load stay, and a later load does not apply them again", async () => {
  const [meanwhile, told] = [new Meanwhile(), /** @type {string[]} */ ([])];
  const refused = meanwhile.during(Promise.reject(new Error("away")), () =>
    told.push("filled"),
  );
  meanwhile.take(() => told.push("told"));
  await assert.rejects(refused, /away/);
  await meanwhile.during(Promise.resolve(), () => told.push("filled"));
  assert.deepEqual(told, ["told", "filled"]);
});
