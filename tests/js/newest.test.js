import assert from "node:assert/strict";
import { test } from "node:test";

import { Newest } from "../../static/js/lib/newest.js";

test("the newest complete set of bitmaps is held, whichever resolves first, and all others are closed", async () => {
  const closed = [];
  const bitmap = (name) => ({ name, close: () => closed.push(name) });
  const newest = new Newest();
  await newest.take([Promise.resolve(bitmap("first"))]);
  let arrive = (_) => {};
  const slow = new Promise((resolve) => (arrive = resolve));
  const overtaken = newest.take([slow, Promise.resolve(bitmap("b"))]);
  assert.equal(await newest.take([Promise.resolve(bitmap("c"))]), true);
  arrive(bitmap("a"));
  assert.equal(await overtaken, false);
  assert.deepEqual([newest.held.map((one) => one.name), closed], [["c"], ["first", "a", "b"]]);
  await assert.rejects(newest.take([Promise.resolve(bitmap("d")), Promise.reject(new Error("no room"))]), /no room/);
  assert.deepEqual([newest.held.map((one) => one.name), closed.at(-1)], [["c"], "d"]);
});
