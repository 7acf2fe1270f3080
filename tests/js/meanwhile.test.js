import assert from "node:assert/strict";
import test from "node:test";
import { Meanwhile } from "../../static/js/lib/meanwhile.js";

test("what is told while a list is on its way stands over that list, and is known at once", async () => {
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

test("a list that is refused leaves what was told, and later ones do not hear of it again", async () => {
  const [meanwhile, told] = [new Meanwhile(), /** @type {string[]} */ ([])];
  const refused = meanwhile.during(Promise.reject(new Error("away")), () =>
    told.push("filled"),
  );
  meanwhile.take(() => told.push("told"));
  await assert.rejects(refused, /away/);
  await meanwhile.during(Promise.resolve(), () => told.push("filled"));
  assert.deepEqual(told, ["told", "filled"]);
});
