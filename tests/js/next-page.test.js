import assert from "node:assert/strict";
import { test } from "node:test";

import { nextPage } from "../../static/js/lib/next-page.js";

test("after signing in only pages of the same origin are opened, with their query", () => {
  const here = "http://localhost:8000";
  assert.equal(nextPage("/p/a/review?object=3", here), `${here}/p/a/review?object=3`);
  assert.equal(new URL(nextPage("/.//evil.example/x", here), here).host, "localhost:8000");
  for (const other of [null, "", "//evil.example", "https://evil.example", "javascript:alert(1)", "http://["])
    assert.equal(nextPage(other, here), `${here}/`);
});
