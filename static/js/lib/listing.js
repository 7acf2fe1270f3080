/** List of objects: search, filter by state, order and headings; no DOM. */

import { matches } from "./filter.js";
import { DOUBTFUL } from "./lanes.js";

/** @typedef {{ id: number, name: string, category: string, assignee: string | null }} Named */
/**
 * @template {Named} T
 * @typedef {{ object: T, number: number, sure: number | null, hidden: boolean, locked: boolean, current: boolean, mine: boolean }} Entry
 * `number` as shown on the frame; `sure`: mean confidence of its masks, null without one; `mine`: assigned to this user
 */
/** @typedef {keyof typeof ORDERS} Order */
/** @typedef {keyof typeof STATES} State */

export const ORDERS = { made: "As made", name: "By name", unsure: "Least sure first", category: "By category" };
export const STATES = {
  all: "All",
  doubtful: "Doubtful",
  unmasked: "No masks",
  hidden: "Hidden",
  locked: "Locked",
  mine: "Assigned to me",
  nobodys: "Assigned to nobody",
};
export const OF_PEOPLE = ["mine", "nobodys"]; // states that apply only where people have accounts

/** @type {Record<State, (entry: Entry<any>) => boolean>} */
const KEPT = {
  all: () => true,
  doubtful: ({ sure }) => sure !== null && sure < DOUBTFUL,
  unmasked: ({ sure }) => sure === null,
  hidden: ({ hidden }) => hidden,
  locked: ({ locked }) => locked,
  mine: ({ mine }) => mine,
  nobodys: ({ object }) => object.assignee === null,
};

/** @type {Record<Order, (a: Entry<any>, b: Entry<any>) => number>} */
const BEFORE = {
  made: (a, b) => a.number - b.number,
  name: (a, b) => byName(a.object.name, b.object.name),
  unsure: (a, b) => (a.sure ?? -1) - (b.sure ?? -1),
  category: (a, b) => byName(a.object.category, b.object.category) || byName(a.object.name, b.object.name),
};

/**
 * Entries to show, under headings where they are grouped. The current one is always included, as the user works on it.
 * @template {Named} T
 * @param {Entry<T>[]} entries
 * @param {{ typed: string, state: State, order: Order }} wanted
 * @returns {{ heading: string, entries: Entry<T>[] }[]}
 */
export function listed(entries, { typed, state, order }) {
  const kept = entries.filter((entry) => entry.current || (KEPT[state](entry) && matches(typed, words(entry.object))));
  const ordered = kept.toSorted(BEFORE[order]);
  if (order !== "category") return ordered.length ? [{ heading: "", entries: ordered }] : [];
  const headings = [...new Set(ordered.map(({ object }) => object.category))];
  return headings.map((heading) => ({
    heading,
    entries: ordered.filter(({ object }) => object.category === heading),
  }));
}

/** Texts by which an object is found. @param {Named} object */
const words = ({ name, category, assignee }) => [name, category, ...(assignee ? [`@${assignee}`] : [])];

/** Natural order of names: drawer_2 before drawer_10. @param {string} a @param {string} b */
const byName = (a, b) => a.localeCompare(b, "en", { numeric: true });

/**
 * Ids from one to another in the order shown, both included; only the last where the first is not shown.
 * @param {number[]} shown
 * @param {number | null} from
 * @param {number} to
 */
export function span(shown, from, to) {
  const [a, b] = [from === null ? -1 : shown.indexOf(from), shown.indexOf(to)];
  return a < 0 ? [to] : shown.slice(Math.min(a, b), Math.max(a, b) + 1);
}

/** Mean confidence; null without a mask. @param {Map<number, number>} lane confidence by frame */
export function meanOf(lane) {
  return lane.size ? [...lane.values()].reduce((sum, sure) => sum + sure, 0) / lane.size : null;
}

/** Whether the object's masks are being found or are queued for it. @param {{ segment: string }} object */
export const isComing = ({ segment }) => segment === "waiting" || segment === "running";
