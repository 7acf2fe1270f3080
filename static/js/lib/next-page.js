/**
 * The page that was asked for before signing in, when it is one of ours.
 * @param {string | null} wanted an address, as it stands in the query
 * @param {string} origin
 */
export function nextPage(wanted, origin) {
  const home = `${origin}/`;
  if (!wanted || !URL.canParse(wanted, origin)) return home;
  const url = new URL(wanted, origin);
  return url.origin === origin ? url.href : home; // whole: a path that begins with two slashes would be another host
}
