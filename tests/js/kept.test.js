import assert from "node:assert/strict";
import { test } from "node:test";

import { forget, keep, keptBy, named } from "../../static/js/lib/kept.js";

test("pending changes are stored per user and in order until they are answered; unreadable ones are skipped", () => {
  const items = new Map();
  const store = {
    get length() {
      return items.size;
    },
    key: (k) => [...items.keys()][k] ?? null,
    getItem: (name) => items.get(name) ?? null,
    setItem: (name, text) => items.set(name, text),
    removeItem: (name) => items.delete(name),
  };
  const change = (key, at, user = "ann") => ({
    key,
    at,
    user,
    method: "POST",
    path: `/p/{${key}}`,
    json: {},
  });
  for (const one of [change("c", 30), change("a", 4), change("b", 5, "bob")]) assert.ok(keep(store, one));
  items.set("theme", "dark");
  items.set("r2c2r-change-0-torn", "{");
  assert.deepEqual(
    keptBy(store, "ann").map(({ key }) => key),
    ["a", "c"],
  );
  forget(store, change("a", 4));
  assert.deepEqual(
    keptBy(store, "ann").map(({ key }) => key),
    ["c"],
  );
  assert.equal(
    keep(
      {
        ...store,
        setItem: () => {
          throw new Error("full");
        },
      },
      change("d", 1),
    ),
    false,
  );
});

test("a click on an object still being created gets the id of that object once it is known", () => {
  const click = {
    method: "POST",
    path: "/api/projects/p/objects/{k1}/points?infer=true",
    json: {},
  };
  assert.equal(named(click, "k1", 7).path, "/api/projects/p/objects/7/points?infer=true");
  assert.equal(named(click, "k2", 7), click);
});
