import assert from "node:assert/strict";
import { test } from "node:test";

import { Answers } from "../../static/js/lib/answers.js";

test("an outdated response is ignored, and a failed later request does not discard earlier responses", async () => {
  const answers = new Answers();
  const shown = [];
  const say = [];
  const taken = [0, 1, 2].map((k) => {
    const asked = new Promise((resolve, reject) => (say[k] = { resolve, reject }));
    return answers.take(asked, (answer) => shown.push(answer));
  });
  say[2].reject(new Error("the server is away"));
  await assert.rejects(taken[2], /away/);
  say[1].resolve("second");
  await taken[1];
  say[0].resolve("first");
  await taken[0];
  assert.deepEqual(shown, ["second"]);
  await answers.take(Promise.resolve("fourth"), (answer) => shown.push(answer));
  assert.deepEqual(shown, ["second", "fourth"]);
});
