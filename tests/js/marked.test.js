import assert from "node:assert/strict";
import test from "node:test";
import { addPoint, getProject, marked } from "../../static/js/api.js";

test("a change sent again carries the key it had, and only what the act asks for at once is marked", async () => {
  const sent = [];
  globalThis.fetch = async (path, { method, headers }) => {
    sent.push([method, headers["Idempotency-Key"]]);
    return Response.json({});
  };
  const click = { frame: 0, x: 1, y: 1, label: 1 };
  const act = () => addPoint("p", 1, click);
  await marked("k", act);
  await marked("k", act);
  await marked("k", () => Promise.all([act(), act(), getProject("p")]));
  await act();
  assert.deepEqual(sent, [
    ["POST", "k.0"],
    ["POST", "k.0"],
    ["POST", "k.0"],
    ["POST", "k.1"],
    ["GET", undefined],
    ["POST", undefined],
  ]);
});
