/** How it is said that an object's front was drawn anew for clicks on others. */

/**
 * @param {string} name of the object
 * @param {string[]} others clicked on the panel it was on; none when they are gone
 */
export function partedText(name, others) {
  if (others.length === 0) return `${name} has its whole front again`;
  return `${name} now ends at the seam to ${others.join(", ")}`;
}
