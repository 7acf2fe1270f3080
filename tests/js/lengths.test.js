import assert from "node:assert/strict";
import { test } from "node:test";

import {
  offBy,
  parseLength,
  rescaleNotes,
} from "../../static/js/lib/lengths.js";

test("a typed length is in millimetres or in its unit, and may be followed by a description", () => {
  assert.deepEqual(parseLength("596"), { metres: 0.596, text: "" });
  assert.deepEqual(parseLength(" 596 mm, worktop beside the sink "), {
    metres: 0.596,
    text: "worktop beside the sink",
  });
  assert.deepEqual(parseLength("59,6 cm"), { metres: 0.596, text: "" });
  assert.deepEqual(parseLength("2.1m height"), { metres: 2.1, text: "height" });
  assert.deepEqual(parseLength("600 mug"), { metres: 0.6, text: "mug" });
  for (const wrong of ["", "wide", "0", "-3", "900 m"])
    assert.equal(parseLength(wrong), null);
});

test("the error of the scan is given in millimetres and percent", () => {
  assert.equal(offBy({ metres: 0.6, error_m: -0.0072, compared: true }), "−7 mm, −1.2 %");
  assert.equal(offBy({ metres: 0.6, error_m: 0.0001, compared: true }), "as measured");
  assert.equal(offBy({ metres: 0.6, error_m: null, compared: false }), "not in the scene now");
  const typed = offBy({ metres: 0.6, error_m: 0.02, compared: false });
  assert.equal(typed, "+20 mm, +3.3 % (typed or a default: does not affect the scale)");
});

test("the notes on a rescale give the change in percent, the new largest sizes and a warning about a single length", () => {
  const one = {
    id: 1,
    text: "",
    object: 1,
    side: "width",
    points_world: null,
    metres: 0.6,
    measured_m: 0.594,
  };
  const length = { ...one, error_m: -0.006, compared: true, who: "ann", at: 0 };
  const all = {
    lengths: [length],
    scale: 1,
    scale_wanted: 1.0101,
    mean_error: 0.01,
    mean_error_scaled: 0,
  };
  const notes = rescaleNotes(all, [
    { name: "mug", dimensions_m: [0.1, 0.1, 0.1] },
    { name: "refrigerator", dimensions_m: [0.6, 0.6, 1.8] },
  ]);
  assert.match(notes[0] ?? "", /changes by \+1\.0 %/);
  assert.match(notes[1] ?? "", /refrigerator 1800 → 1818 mm, mug 100 → 101 mm/);
  assert.match(notes[3] ?? "", /Only one true length/);
  assert.deepEqual(rescaleNotes({ ...all, scale_wanted: null }, []), []);
});
