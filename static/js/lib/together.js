/** Other people in the project, each listed once. */

/** @typedef {{ tab: string, who: string, page: string, object: number | null }} Here */

/**
 * Other people, each with their places; the user's own other tabs are labelled as such.
 * @param {Here[]} people
 * @param {string} tab this one
 * @param {Map<number, string>} names of objects by id; an unknown one is left out
 */
export function together(people, tab, names) {
  const me = people.find((each) => each.tab === tab);
  /** @type {Map<string, string[]>} */
  const places = new Map();
  for (const each of people) {
    if (each === me) continue;
    const who = each.who === me?.who ? "you, in another tab" : each.who;
    const name = each.object === null ? undefined : names.get(each.object);
    const place = name === undefined ? each.page : `${each.page} ${name}`;
    places.set(who, [...new Set([...(places.get(who) ?? []), place])]);
  }
  return [...places].map(([who, where]) => ({ who, where: where.filter(Boolean).join(", ") }));
}
