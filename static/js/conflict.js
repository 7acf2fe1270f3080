/** Resolution of conflicting changes by two users: asks only about fields that disagree, and returns the change to store. */

import { askToMerge } from "./elements/merge-dialog.js";
import { disagreements } from "./lib/merge.js";
import { verdictOf } from "./lib/rebased.js";

/** @typedef {import("./changes.js").Change} Change */
/** @typedef {import("./api-types").CandidateGroup} CandidateGroup */
/** @typedef {import("./api-types").PromptsFileFrontOutput} PromptsFileFrontOutput */
/** @typedef {Record<string, unknown>} Fields */
/** @typedef {{ version: number, name?: string, override?: Fields, group?: CandidateGroup }} Stored content of a 409 response */

/** @type {Record<string, string>} */
const LABELS = {
  name: "Name",
  category: "Category",
  assignee: "Assigned to",
  front: "Drawn front",
  hinge: "Hinge",
  joint_lower: "Opens from",
  joint_upper: "Opens to",
  joints: "Each joint opens to",
  states: "Frames marked closed or open",
  dimensions_m: "Width, depth, height",
  pose: "Place",
  candidate: "Candidate",
  regenerate: "Batches of candidates",
  verdict: "Verdict",
};

/**
 * Change to send instead; null to leave the other user's as it is.
 * @param {Change} change
 * @param {unknown} current what is stored now
 * @returns {Promise<Change | null>}
 */
export async function merged(change, current) {
  const stored = /** @type {Stored} */ (current);
  const { version: _, ...json } = change.json;
  const says = "verdict" in json;
  const wanted = says ? { verdict: `${json.verdict} ${json.candidate}` } : json;
  const theirs = fieldsOf(stored);
  const kept = await wantedStill(stored.name ?? stored.group?.name ?? "It", change.seen ?? {}, wanted, theirs);
  if (!Object.keys(kept).length) return null;
  return { ...change, json: { ...(says ? json : kept), version: stored.version }, seen: theirs };
}

/** @param {Stored} stored @returns {Fields} */
function fieldsOf({ group, override, ...fields }) {
  return group ? { ...override, verdict: verdictOf(group) } : fields;
}

/**
 * @param {string} name
 * @param {Fields} seen
 * @param {Fields} wanted
 * @param {Fields} theirs
 */
async function wantedStill(name, seen, wanted, theirs) {
  const names = disagreements(seen, wanted, theirs);
  if (!names.length) return wanted;
  const fields = names.map((field) => ({
    name: field,
    label: LABELS[field] ?? field,
    mine: inWords(field, wanted[field]),
    theirs: inWords(field, theirs[field]),
  }));
  const mine = await askToMerge(`${name} was changed twice`, fields);
  return Object.fromEntries(Object.entries(wanted).filter(([field]) => mine?.has(field) || !names.includes(field)));
}

/**
 * @param {string} field
 * @param {unknown} value
 */
function inWords(field, value) {
  if (value === "" && field === "verdict") return "none";
  if (!value && field === "assignee") return "nobody";
  if (value === null || value === undefined || value === "") return "computed";
  if (field === "pose" && Array.isArray(value)) {
    return `at ${value
      .slice(0, 3)
      .map((row) => `${(100 * row[3]).toFixed(1)}`)
      .join(", ")} cm`;
  }
  if (field === "dimensions_m" && Array.isArray(value))
    return `${value.map((side) => (100 * side).toFixed(1)).join(" × ")} cm`;
  if (field === "states") return marksInWords(/** @type {import("./lib/opening-marks.js").States} */ (value));
  if (field === "front") return sizeInWords(/** @type {PromptsFileFrontOutput} */ (value));
  if (typeof value === "number" && field.startsWith("joint_")) return `${value.toFixed(3)} (radians or metres)`;
  return String(value);
}

/** @param {import("./lib/opening-marks.js").States} states */
function marksInWords(states) {
  const frames = Object.values(states).flatMap((marks) => marks.map(({ frame }) => frame));
  return frames.length ? `frames ${frames.join(", ")}` : "none";
}

/** @param {PromptsFileFrontOutput} front */
function sizeInWords({ corners_m: [a = [], b = [], , d = []] }) {
  const [wide, high] = [b, d].map((end) => Math.hypot(...end.map((value, k) => value - (a[k] ?? 0))));
  return `${Math.round(1000 * (wide ?? 0))} × ${Math.round(1000 * (high ?? 0))} mm`;
}
