import assert from "node:assert/strict";
import { test } from "node:test";

import { riskiestFirst, riskOf } from "../../static/js/lib/risk.js";

/** @param {object} [placement] @returns {any} */
const group = (placement = {}) => ({ placement: { unsure: false, mask_iou: 0.95, rms_m: 0.004, ...placement } });
/** @param {object} [more] @returns {any} */
const item = (more = {}) => ({ warnings: [], joints: [{ sources: { axis: "measured", limits: "measured" } }], ...more });

test("a reliable object has no risk, and every problem of an object is described in words", () => {
  assert.deepEqual(riskOf(group(), item(), []), { score: 0, why: "" });
  assert.equal(riskOf(/** @type {any} */ ({ placement: null }), undefined, []).why, "not placed");
  const doubtful = riskOf(group({ unsure: true, mask_iou: 0.5 }), item({ joints: [{ sources: { limits: "default" } }] }), []);
  assert.equal(doubtful.why, "its place is unsure; its outline hardly fits the photos; limits by default");
  const failed = riskOf(group(), item(), [/** @type {any} */ ({ severity: "error" })]);
  assert.ok(failed.score > riskOf(group({ unsure: true }), item(), []).score);
});

test("objects with the highest risk come first, and equal ones keep their order", () => {
  const risks = new Map([1, 2, 3, 4].map((object) => [object, { score: object === 3 ? 5 : 1, why: "" }]));
  const order = riskiestFirst([{ object: 4 }, { object: 1 }, { object: 3 }, { object: 2 }], risks);
  assert.deepEqual(order.map(({ object }) => object), [3, 4, 1, 2]);
});
