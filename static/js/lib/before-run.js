/** Checks before a run: objects that would spoil it, each with a frame that shows the problem. */

/** @typedef {import("../api-types").SceneObject} SceneObject */
/** @typedef {import("../api-types").Lane} Lane */
/** @typedef {import("./contradictions.js").Said} Said */
/** @typedef {{ object: number, frame: number | null, text: string }} Told */

const FRAMES = 12; // checked: a front that was clicked as two objects shows as such on many frames

/**
 * Frames that together show each object, those that show most objects first.
 * @param {Lane[]} lanes
 * @param {number} [most]
 * @returns {number[]}
 */
export function framesToLook(lanes, most = FRAMES) {
  /** @type {Map<number, Set<number>>} objects by frame */
  const seen = new Map();
  for (const { object, frames } of lanes)
    for (const frame of frames) seen.set(frame, (seen.get(frame) ?? new Set()).add(object));
  const left = new Set(lanes.filter(({ frames }) => frames.length).map(({ object }) => object));
  /** @type {number[]} */
  const chosen = [];
  while (left.size && chosen.length < most) {
    const worth = (/** @type {number} */ frame) => [...(seen.get(frame) ?? [])].filter((one) => left.has(one)).length;
    const best = [...seen.keys()].toSorted((a, b) => worth(b) - worth(a) || a - b)[0];
    if (best === undefined) break;
    for (const object of seen.get(best) ?? []) left.delete(object);
    chosen.push(best);
  }
  return chosen;
}

/**
 * Problems that would spoil the run: each contradiction between two objects once, and objects without clicks or masks.
 * @param {SceneObject[]} objects
 * @param {{ frame: number, said: Said[] }[]} looked by frame
 * @returns {Told[]}
 */
export function spoiling(objects, looked) {
  const told = objects.flatMap((object) => unfound(object));
  const pairs = new Set();
  for (const { frame, said } of looked)
    for (const { object, other, text } of said) {
      const pair = other === undefined ? `${object} ${text}` : [object, other].toSorted((a, b) => a - b).join();
      if (!pairs.has(pair)) told.push({ object, frame, text });
      pairs.add(pair);
    }
  return told;
}

/** @param {SceneObject} object @returns {Told[]} */
function unfound({ id, points, front, segment, notices }) {
  if (!points.length && !front)
    return [{ object: id, frame: null, text: "Has no click yet, and is left out: click on it, or delete it" }];
  if (segment === "failed")
    return [{ object: id, frame: points[0]?.frame ?? null, text: `Has no mask: ${notices.join("; ")}` }];
  return [];
}
