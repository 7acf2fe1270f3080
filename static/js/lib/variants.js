/** Disk space and download size of variants of a bundle; no DOM. */

import { bytes } from "./format.js";

/**
 * Space needed for a number of variants, in words, and whether the disk has room for it.
 * @param {import("../api-types").VariantsOffer} offer
 * @param {number} count 0: no number was given
 */
export function variantsTake(offer, count) {
  if (!count) return { text: "", fits: false };
  const zip = offer.zip_bytes + count * offer.each_zip_bytes;
  const disk = zip + offer.disk_bytes + count * offer.each_disk_bytes;
  const fits = disk <= offer.free_bytes;
  const room = `${bytes(disk)} of disk while they are made, ${bytes(offer.free_bytes)} free`;
  return { text: `About ${bytes(zip)} to download; ${fits ? room : `too little room: ${room}`}.`, fits };
}
