import assert from "node:assert/strict";
import { test } from "node:test";

import { patiently } from "../../static/js/lib/patience.js";

test("a request refused with a retry time is sent again after it, at most 20 times in all, and reported once", async () => {
  const heard = [];
  const waits = {
    retryMs: ({ ms }) => ms ?? null,
    told: ({ ms }) => heard.push(`told ${ms}`),
    wait: async (ms) => heard.push(ms),
  };
  const answers = [{ ms: 2000 }, { ms: 3000 }, "taken"];
  const ask = async () => {
    const answer = answers.shift();
    if (typeof answer === "string") return answer;
    throw answer;
  };
  assert.equal(await patiently(ask, waits), "taken");
  assert.deepEqual(heard, ["told 2000", 2000, 3000]);
  await assert.rejects(
    patiently(() => Promise.reject({ name: "no" }), waits),
    { name: "no" },
  );
  let asked = 0;
  await assert.rejects(
    patiently(() => (asked++, Promise.reject({ ms: 1 })), waits),
    { ms: 1 },
  );
  assert.equal(asked, 20);
});
