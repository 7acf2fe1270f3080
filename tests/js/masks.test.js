import assert from "node:assert/strict";
import { test } from "node:test";

import { decodeBox, paintBox, rgbOf } from "../../static/js/lib/masks.js";

test("decoding a packed mask restores its pixels", async () => {
  const packed = Uint8Array.from([0b10110000]); // 1 0 1 1 0 0 of a 3 x 2 box
  const stream = new Blob([packed]).stream().pipeThrough(new CompressionStream("deflate"));
  const bits = Buffer.from(await new Response(stream).arrayBuffer()).toString("base64");
  const mask = {
    width: 9,
    height: 9,
    left: 1,
    top: 2,
    box_width: 3,
    box_height: 2,
    bits,
  };
  assert.deepEqual([...(await decodeBox(mask))], [1, 0, 1, 1, 0, 0]);
});

test("a mask is painted in its colour: opaque at the rim, translucent inside, transparent outside", () => {
  const full = new Uint8Array(25).fill(1);
  const rgba = paintBox(full, 5, 5, [10, 20, 30], 0.5);
  assert.deepEqual([...rgba.slice(0, 4)], [10, 20, 30, 255]);
  assert.equal(rgba[4 * 12 + 3], 128);
  assert.equal(paintBox(new Uint8Array(25), 5, 5, [1, 2, 3], 1)[3], 0);
  assert.deepEqual(rgbOf("#0b61c4"), [11, 97, 196]);
});
