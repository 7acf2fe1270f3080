/** Who else is here, said once a person. */

/** @typedef {{ tab: string, who: string, page: string, object: number | null }} Here */

/**
 * The others, each with where they are; one's own other tabs are said so.
 * @param {Here[]} people
 * @param {string} tab this one
 */
export function together(people, tab) {
  const me = people.find((each) => each.tab === tab);
  /** @type {Map<string, string[]>} */
  const places = new Map();
  for (const each of people) {
    if (each === me) continue;
    const who = each.who === me?.who ? "you, in another tab" : each.who;
    const place = each.object === null ? each.page : `${each.page} #${each.object}`;
    places.set(who, [...new Set([...(places.get(who) ?? []), place])]);
  }
  return [...places].map(([who, where]) => ({ who, where: where.filter(Boolean).join(", ") }));
}
