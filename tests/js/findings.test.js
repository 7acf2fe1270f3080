// @ts-check
import assert from "node:assert/strict";
import test from "node:test";

import { byPlace, findingsAbout } from "../../static/js/lib/findings.js";

const names = ["cabinet_1", "cabinet_1_door", "mug_1"];

/** @param {string} where */
const certificate = (where) =>
  /** @type {import("../../static/js/api-types").Certificate} */ (
    /** @type {unknown} */ ({
      findings: [{ rule: "same-thing", severity: "error", where, message: "" }],
    })
  );

/** @param {string} where */
const concerned = (where) =>
  names.filter((name) => findingsAbout(certificate(where), name, names).length);

test("a finding about several objects is shown at each of them", () => {
  assert.deepEqual(concerned("cabinet_1, mug_1"), ["cabinet_1", "mug_1"]);
});

test("a finding about a part is shown at the object with the longest name that the part's name starts with", () => {
  assert.deepEqual(concerned("cabinet_1_door_hinge"), ["cabinet_1_door"]);
  assert.deepEqual(concerned("cabinet_1_hinge"), ["cabinet_1"]);
});

test("findings of one place are one entry, which does not repeat the place's name", () => {
  const found = ["hood_1: the click is outside", "hood_1: the click is outside", "is 70 x 7 cm"].map((message) =>
    /** @type {import("../../static/js/api-types").Finding} */ ({ rule: "", severity: "warning", where: "hood_1", message }),
  );
  assert.deepEqual(byPlace(found), [
    { where: "hood_1", severity: "warning", messages: ["the click is outside", "is 70 x 7 cm"] },
  ]);
});
