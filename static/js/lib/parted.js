/** Message that an object's front was redrawn because of clicks on other objects. */

/**
 * @param {string} name of the object
 * @param {string[]} others names of objects clicked on the same panel; none when they are gone
 */
export function partedText(name, others) {
  if (others.length === 0) return `${name} has its whole front again`;
  return `${name} now ends at the seam to ${others.join(", ")}`;
}
