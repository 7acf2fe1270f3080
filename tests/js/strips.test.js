import assert from "node:assert/strict";
import { test } from "node:test";

import { strips } from "../../static/js/lib/strips.js";

test("outlier frames are marked in every strip and counted in its summary", () => {
  const usual = {
    sharpness: 1,
    depth_share: 0.9,
    brightness: 0.5,
    error_mm: 6,
  };
  const odd = {
    sharpness: 0.2,
    depth_share: 0.1,
    brightness: 0.99,
    error_mm: 60,
  };
  const moments = [usual, usual, usual, odd, { ...usual, error_mm: null }].map((m, k) => ({
    ...m,
    frame_index: 5 * k,
  }));
  const found = strips(moments);
  assert.deepEqual(
    found.map((strip) => strip.name),
    ["Sharpness", "Depth", "Brightness", "Depth mismatch"],
  );
  for (const { bars, summary } of found) {
    assert.deepEqual(
      bars.flatMap((bar) => (bar.off ? [bar.frame] : [])),
      [15],
    );
    assert.match(summary, /^1 of 5 frames/);
    assert.ok(bars.every((bar) => bar.height >= 0 && bar.height <= 1));
  }
});
