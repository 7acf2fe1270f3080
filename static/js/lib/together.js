/** Who else is here, said once a person. */

/** @typedef {{ tab: string, who: string, page: string, object: number | null }} Here */

/**
 * The others, each with where they are; one's own other tabs are said so.
 * @param {Here[]} people
 * @param {string} tab this one
 * @param {Map<number, string>} names of objects; one that is not known is left out
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
