/** Cards of the candidates, rendered from the same camera, each with its evidence; and the reason for the one in use. */

import { h, icon } from "../dom.js";
import { counted } from "../lib/format.js";
import { REVIEWERS } from "./decisions.js";

/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */
/** @typedef {import("../api-types").Candidate} Candidate */

/** @typedef {{ show: (candidate: Candidate) => void, verdict: (candidate: Candidate, verdict: "accepted" | "rejected") => void, judges: boolean }} Told */

/**
 * Card of each candidate, the one in use first.
 * @param {CandidateGroup} group
 * @param {string} current the one shown in 3D
 * @param {Told} told
 */
export function cards(group, current, told) {
  return ranked(group).map((candidate) => card(group, candidate, current, told));
}

/** Reason for the candidate in use. @param {CandidateGroup} group */
export function choice(group) {
  const how = group.chosen_by === "person" ? "Chosen by a person: " : "Chosen automatically: ";
  return h("p", { class: "why" }, group.chosen ? how : "None is used: ", h("span", { class: "muted" }, group.reason));
}

/** Next best candidate that is not rejected. @param {CandidateGroup} group */
function runnerUp(group) {
  const rejected = new Set(group.candidates.filter(({ verdict }) => verdict === "rejected").map(({ id }) => id));
  return group.ranking.find((id) => id !== group.chosen && !rejected.has(id));
}

/** Candidates by rank, the one in use first. @param {CandidateGroup} group */
export function ranked(group) {
  const place = new Map(group.ranking.map((id, k) => [id, k]));
  /** @type {(candidate: Candidate) => number} */
  const order = ({ id }) => (id === group.chosen ? -1 : (place.get(id) ?? group.ranking.length));
  return group.candidates.toSorted((a, b) => order(a) - order(b));
}

/**
 * @param {CandidateGroup} group
 * @param {Candidate} candidate
 * @param {string} current
 * @param {Told} told
 */
function card(group, candidate, current, told) {
  const show = h("button", { type: "button", class: "show", "aria-label": `Show ${candidate.id} in 3D` });
  show.append(h("img", { src: candidate.thumbnail, alt: "", loading: "lazy" }));
  show.dataset.at = `show:${candidate.id}`;
  show.addEventListener("click", () => told.show(candidate));
  const second = candidate.id === runnerUp(group);
  const said = candidate.verdict
    ? `${candidate.verdict} by ${candidate.verdict_by}${candidate.verdict_reason ? `: ${candidate.verdict_reason}` : ""}`
    : "";
  return h(
    "article",
    { class: `candidate ${candidate.id === current ? "current" : ""}` },
    show,
    h(
      "div",
      { class: "body" },
      h(
        "div",
        { class: "row" },
        h("strong", {}, candidate.id),
        candidate.id === group.chosen ? h("span", { class: "chip good" }, "★ used") : "",
        second ? h("span", { class: "chip" }, "runner-up") : "",
      ),
      candidate.assumes ? h("div", { class: "assumes" }, candidate.assumes) : "",
      doubts(candidate),
      said ? h("div", { class: "muted" }, said) : "",
      ...candidate.warnings.map((warning) => h("div", { class: "muted" }, warning)),
      h("div", { class: "verdicts" }, verdict(candidate, "accepted", told), verdict(candidate, "rejected", told)),
    ),
  );
}

/** Figures that are not in doubt, and those that are. @param {Candidate} candidate @returns {[string[], string[]]} */
function judged({ metrics, watertight, faces, generator }) {
  const { mask_iou: iou, depth_residual_m: off, seen_fraction: seen } = metrics;
  /** @type {[string, boolean][]} text, and whether it is in doubt */
  const all = [];
  if (iou !== undefined) all.push([`outline ${(100 * iou).toFixed(0)} % in the masks`, iou < 0.8]);
  if (off !== undefined) all.push([`${(1000 * off).toFixed(0)} mm from the depth`, off > 0.02]);
  if (seen !== undefined) all.push([`${(100 * seen).toFixed(0)} % of its surface seen`, false]);
  all.push([watertight ? "watertight" : "not watertight", !watertight]);
  all.push([counted(faces, "face"), false], [`made by ${generator}`, false]);
  return [all.filter(([, bad]) => !bad).map(([text]) => text), all.filter(([, bad]) => bad).map(([text]) => text)];
}

/** Line of the figures that are not in doubt. @param {Candidate} candidate */
export const figures = (candidate) => judged(candidate)[0].join(" · ");

/** Chips of the figures in doubt. @param {Candidate} candidate */
export function doubts(candidate) {
  const [, doubtful] = judged(candidate);
  return doubtful.length
    ? h("div", { class: "chips" }, ...doubtful.map((text) => h("span", { class: "chip warn" }, text)))
    : "";
}

/**
 * @param {Candidate} candidate
 * @param {"accepted" | "rejected"} said
 * @param {Told} told
 */
export function verdict(candidate, said, told) {
  const [name, text] = said === "accepted" ? ["check", "Accept"] : ["cross", "Reject"];
  const button = h(
    "button",
    {
      type: "button",
      disabled: !told.judges,
      title: told.judges ? "" : REVIEWERS,
      value: said,
      "aria-pressed": String(candidate.verdict === said),
    },
    icon(name ?? ""),
    text,
  );
  button.dataset.at = `${said}:${candidate.id}`;
  button.addEventListener("click", () => told.verdict(candidate, said));
  return button;
}
