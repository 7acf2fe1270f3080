import assert from "node:assert/strict";
import { test } from "node:test";

import { variantsTake } from "../../static/js/lib/variants.js";

/** @type {import("../../static/js/api-types").VariantsOffer} */
const OFFER = {
  version: 1,
  most: 1000,
  zip_bytes: 8_000_000,
  each_zip_bytes: 10_000,
  disk_bytes: 12_000_000,
  each_disk_bytes: 50_000,
  free_bytes: 30_000_000,
};

test("the space that variants need is shown together with the free space", () => {
  assert.deepEqual(variantsTake(OFFER, 100), {
    text: "About 9.0 MB to download; 26.0 MB of disk while they are made, 30.0 MB free.",
    fits: true,
  });
});

test("variants that exceed the free space, or a count of zero, are not possible", () => {
  const { text, fits } = variantsTake(OFFER, 1000);
  assert.match(text, /too little room: 80\.0 MB of disk/);
  assert.equal(fits, false);
  assert.deepEqual(variantsTake(OFFER, 0), { text: "", fits: false });
});
