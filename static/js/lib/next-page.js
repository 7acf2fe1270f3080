/**
 * Page requested before signing in if it is on this origin, else the start page.
 * @param {string | null} wanted address from the query
 * @param {string} origin
 */
export function nextPage(wanted, origin) {
  const home = `${origin}/`;
  if (!wanted || !URL.canParse(wanted, origin)) return home;
  const url = new URL(wanted, origin);
  return url.origin === origin ? url.href : home; // absolute: a path that begins with two slashes would be another host
}
