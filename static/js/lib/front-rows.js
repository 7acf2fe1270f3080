/** Rows and stacks of fronts: division by typed sizes, repetition, order and renaming; no DOM. */

import { heightOf, moved, SMALLEST_M, widthOf } from "./elevation.js";

/** @typedef {import("./elevation.js").Rect} Rect */
/** @typedef {"upright" | "level"} Way upright seams part a front's width, level ones its height */

const COLUMN_M = 0.05; // fronts whose left edges are this close form a column
const SEAM_M = 0.003; // gap between fronts of most manufacturers

/**
 * Divide a front as typed: "3" in equal parts, "600 450 600" in millimetres, with the rest as one more part; "/ 28" leaves gaps
 * of 28 mm.
 * @param {Rect} rect
 * @param {Way} way
 * @param {string} text
 * @returns {Rect[] | null} null where the text is invalid or does not fit
 */
export function divided(rect, way, text) {
  const [sizes, gap = 0, ...more] = text.split("/").map(numbersOf);
  const between = Array.isArray(gap) ? gap[0] : gap;
  if (!sizes?.length || more.length || between === undefined) return null;
  const long = way === "upright" ? widthOf(rect) : heightOf(rect);
  const parts =
    sizes.length === 1 && isCount(sizes[0])
      ? equal(long, sizes[0], between / 1000)
      : typed(long, sizes, between / 1000);
  if (parts.length < 2 || parts.some(([from, to]) => !(to - from >= SMALLEST_M) || to > long + 1e-6)) return null;
  return parts.map(([from, to]) =>
    way === "upright"
      ? { ...rect, left: rect.left + from, right: rect.left + to }
      : { ...rect, top: rect.top + from, bottom: rect.top + to },
  );
}

/** Whether a number is a count of parts, not a size. @param {number | undefined} number @returns {number is number} */
function isCount(number) {
  return number !== undefined && Number.isInteger(number) && number <= 12;
}

/** @param {string} text @returns {number[]} */
const numbersOf = (text) =>
  text
    .trim()
    .split(/[\s,;+]+/)
    .filter(Boolean)
    .map(Number);

/** @param {number} long @param {number} count @param {number} gap @returns {[number, number][]} */
function equal(long, count, gap) {
  const size = (long - gap * (count - 1)) / count;
  return Array.from({ length: count }, (_, k) => [k * (size + gap), k * (size + gap) + size]);
}

/** @param {number} long @param {number[]} sizes @param {number} gap @returns {[number, number][]} */
function typed(long, sizes, gap) {
  /** @type {[number, number][]} */
  const parts = [];
  let at = 0;
  for (const size of sizes) {
    parts.push([at, at + size / 1000]);
    at += size / 1000 + gap;
  }
  return long - at >= SMALLEST_M ? [...parts, [at, long]] : parts;
}

/** A front of the same size to the right or below. @param {Rect} rect @param {Way} way @returns {Rect} */
export function again(rect, way) {
  return way === "upright" ? moved(rect, widthOf(rect) + SEAM_M, 0) : moved(rect, 0, heightOf(rect) + SEAM_M);
}

/**
 * Fronts by columns from left to right, each from top to bottom.
 * @template {{ rect: Rect }} T
 * @param {T[]} fronts
 * @returns {T[]}
 */
export function inOrder(fronts) {
  /** @type {T[][]} */
  const columns = [];
  for (const front of fronts.toSorted((a, b) => a.rect.left - b.rect.left)) {
    const column = columns.at(-1);
    if (column?.[0] && front.rect.left - column[0].rect.left < COLUMN_M) column.push(front);
    else columns.push([front]);
  }
  return columns.flatMap((column) => column.toSorted((a, b) => a.rect.top - b.rect.top));
}

/**
 * Renaming steps, to be applied in order: to the name itself, or for several fronts to numbers that are not taken. A name still
 * used by another of the fronts is assigned after that one is renamed; in a cycle, one gets a temporary name first.
 * @param {{ key: string, name: string }[]} fronts in the order of their numbers
 * @param {string} name
 * @param {string[]} taken by others
 * @returns {{ key: string, name: string }[]}
 */
export function renamed(fronts, name, taken) {
  const wanted = fronts.length === 1 ? [name] : numbered(name, fronts.length, taken);
  let waiting = fronts.map((front, k) => ({ key: front.key, has: front.name, name: wanted[k] ?? name }));
  waiting = waiting.filter(({ has, name: to }) => has !== to);
  /** @type {{ key: string, name: string }[]} */
  const steps = [];
  while (waiting.length) {
    const free = waiting.find((one) => waiting.every((other) => other === one || !same(other.has, one.name)));
    if (free) {
      steps.push({ key: free.key, name: free.name });
      waiting = waiting.filter((one) => one !== free);
    } else {
      const [first] = waiting;
      if (!first) break;
      first.has = `${first.name}_aside`;
      steps.push({ key: first.key, name: first.has });
    }
  }
  return steps;
}

/** @param {string} name @param {number} count @param {string[]} taken */
function numbered(name, count, taken) {
  const stem = name.replace(/_\d+$/, "");
  const free = Array.from({ length: count + taken.length }, (_, k) => `${stem}_${k + 1}`);
  return free.filter((one) => !taken.some((other) => same(one, other))).slice(0, count);
}

/** Whether two names are equal, ignoring case. @param {string} a @param {string} b */
const same = (a, b) => a.toLowerCase() === b.toLowerCase();
