import assert from "node:assert/strict";
import { test } from "node:test";

import { together } from "../../static/js/lib/together.js";

test("other people are listed once with all their pages, and the user's other tabs as their own", () => {
  const here = (tab, who, page, object = null) => ({ tab, who, page, object });
  const people = [
    here("a", "ann", "annotate", 3),
    here("b", "bob", "review", 4),
    here("c", "bob", "download"),
    here("d", "ann", "run"),
  ];
  assert.deepEqual(together(people, "a", new Map([[4, "drawer_1"]])), [
    { who: "bob", where: "review drawer_1, download" },
    { who: "you, in another tab", where: "run" },
  ]);
  assert.deepEqual(together([here("a", "ann", "annotate")], "a", new Map()), []);
});
