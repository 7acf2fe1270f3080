/** Corrections copied from one object to others of its kind: how it opens and its colour, never its place or size; no DOM. */

/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */
/** @typedef {import("../api-types").OverridePatch} OverridePatch */

/**
 * Corrections of an object that others of its kind may adopt.
 * @param {CandidateGroup} from
 * @returns {Partial<OverridePatch>}
 */
export function copied({ override }) {
  const { hinge, joint_lower, joint_upper, built_as, colour } = override;
  const said = Object.entries({ hinge, joint_lower, joint_upper, built_as, colour });
  return Object.fromEntries(said.filter(([, value]) => value !== null));
}

/** @type {[keyof OverridePatch, string][]} */
const WORDS = [
  ["hinge", "hinge"],
  ["joint_upper", "limits"],
  ["built_as", "how it opens"],
  ["colour", "colour"],
];

/** Corrections in words, as "hinge and limits"; empty without any. @param {Partial<OverridePatch>} patch */
export function copiedWords(patch) {
  const words = WORDS.filter(([key]) => key in patch).map(([, word]) => word);
  return words.length < 2 ? words.join("") : `${words.slice(0, -1).join(", ")} and ${words.at(-1)}`;
}

/**
 * Objects of a list from one to another, as selected with Shift.
 * @param {number[]} order
 * @param {number} from
 * @param {number} to
 */
export function between(order, from, to) {
  const [a, b] = [order.indexOf(from), order.indexOf(to)];
  return a < 0 || b < 0 ? [to] : order.slice(Math.min(a, b), Math.max(a, b) + 1);
}
