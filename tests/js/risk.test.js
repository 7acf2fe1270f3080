import assert from "node:assert/strict";
import { test } from "node:test";

import { riskiestFirst, riskOf } from "../../static/js/lib/risk.js";

/** @param {object} [placement] @returns {any} */
const group = (placement = {}) => ({
  placement: { unsure: false, mask_iou: 0.95, rms_m: 0.004, warnings: [], ...placement },
});
/** @param {object} [more] @returns {any} */
const item = (more = {}) => ({ warnings: [], joints: [{ sources: { axis: "measured", limits: "measured" } }], ...more });

test("a reliable object needs no decision, and each decision is stated in one line, the most important first", () => {
  assert.deepEqual(riskOf(group(), item(), []), { score: 0, decide: [] });
  assert.match(riskOf(/** @type {any} */ ({ placement: null }), undefined, []).decide[0] ?? "", /^Not placed/);
  const joints = [{ name: "drawer_1_joint", type: "prismatic", upper: 0.45, sources: { limits: "default" } }];
  const unsure = group({ unsure: true, mask_iou: 0.5, warnings: ["which side is the front?"] });
  assert.deepEqual(riskOf(unsure, item({ joints, warnings: ["drawer_1_joint opens to 0.3 m"] }), []).decide, [
    "which side is the front?",
    "Only 50 % of its outline fits",
    "Opens to 0.3 m",
    "Opens 45 cm? Not seen",
  ]);
  const failed = riskOf(group(), item(), [/** @type {any} */ ({ severity: "error", message: "falls over" })]);
  assert.equal(failed.decide[0], "The simulation test failed: falls over");
  assert.ok(failed.score > riskOf(group({ unsure: true }), item(), []).score);
});

test("objects with the highest risk come first, and equal ones keep their order", () => {
  const risks = new Map([1, 2, 3, 4].map((object) => [object, { score: object === 3 ? 5 : 1, decide: [] }]));
  const order = riskiestFirst([{ object: 4 }, { object: 1 }, { object: 3 }, { object: 2 }], risks);
  assert.deepEqual(order.map(({ object }) => object), [3, 4, 1, 2]);
});
