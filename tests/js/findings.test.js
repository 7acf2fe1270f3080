// @ts-check
import assert from "node:assert/strict";
import test from "node:test";

import { findingsAbout } from "../../static/js/lib/findings.js";

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
