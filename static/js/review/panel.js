/** Right panel of the review page: the chosen object, what to decide about it, its evidence, candidates and corrections. */

import { h, icon } from "../dom.js";
import { counted } from "../lib/format.js";
import { cards, choice, figures } from "./candidates.js";
import { corrections } from "./corrections.js";
import { REVIEWERS } from "./decisions.js";
import { decisions as toDecide, findingsOf, placement } from "./evidence.js";
import { madePanel } from "./made-panel.js";

/** @typedef {import("../api-types").Candidate} Candidate */
/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */
/** @typedef {import("../api-types").SceneItem} SceneItem */
/** @typedef {import("./decisions.js").Decisions} Decisions */
/** @typedef {import("./objects.js").ReviewObjects} ReviewObjects */
/**
 * @typedef {object} Asked handlers of the page
 * @property {(candidate: Candidate) => void} show
 * @property {(() => void) | null} move null if there is no box to move
 * @property {() => void} comment
 */

const WHY = "why:";

/**
 * @param {ReviewObjects} objects
 * @param {Decisions} decisions
 * @param {Asked} asked
 * @param {Set<string>} unfolded `data-at` of the summaries whose details are open
 * @returns {(Node | string)[]}
 */
export function panel(objects, decisions, asked, unfolded) {
  const { group, item, groups, certificate, candidate, madeName } = objects;
  if (madeName && item) return madePanel(item, objects.judges, (patch) => decisions.correctMade(item, patch));
  if (!group) return [h("p", { class: "muted" }, groups.length ? "Choose an object." : "")];
  const names = groups.map(({ run_name }) => run_name);
  const { judges } = objects;
  const told = { show: asked.show, verdict: decisions.judge.bind(decisions), judges };
  const old = older(group);
  const [used, ...rest] = cards(group, candidate, told);
  return [
    heading(group, decisions, judges),
    judges ? "" : h("p", { class: "muted" }, REVIEWERS),
    used ?? "",
    old && h("p", { class: "chip warn", role: "status" }, `Below: ${old}`),
    ...toDecide(group, item, objects.risks.get(group.object)?.decide ?? [], old !== ""),
    certificate && !certificate.current ? stale(certificate) : "",
    findingsOf(certificate, group.run_name, names, old !== ""),
    why(group, item, old !== "", unfolded.has(WHY)),
    corrections(
      group,
      item,
      {
        move: asked.move,
        open: unfolded.has("correct:"),
        judges,
        categories: objects.categories,
        categorise: (category) => decisions.categorise(category),
        buildAs: (template) => decisions.buildAs(template),
      },
      (patch) => decisions.correct(patch),
    ),
    rest.length ? h("h3", {}, counted(rest.length, "other candidate")) : "",
    ...rest,
    others(group, decisions, asked, judges),
  ];
}

/**
 * Reason for the mesh in use and its figures, folded.
 * @param {CandidateGroup} group
 * @param {SceneItem | undefined} item
 * @param {boolean} old
 * @param {boolean} open
 */
function why(group, item, old, open) {
  const summary = h("summary", {}, "Why this one");
  summary.dataset.at = WHY;
  const used = group.candidates.find(({ id }) => id === group.chosen);
  return h(
    "details",
    { open },
    summary,
    choice(group),
    used ? h("p", { class: "muted" }, figures(used)) : "",
    group.placement ? placement(group.placement, item, old) : "",
  );
}

/** What makes the figures below older than what was said since; empty if nothing does. @param {CandidateGroup} group */
function older({ changed, chosen, placement }) {
  const other = placement && placement.candidate !== chosen ? `of ${placement.candidate}, which is no longer used` : "";
  return [changed ? "of the last run, before its last change" : "", other].filter(Boolean).join(", and ");
}

/** @param {import("../api-types").Certificate} certificate */
function stale({ version }) {
  return h("p", { class: "chip warn" }, `Findings of version ${version}, before the last change`);
}

/**
 * @param {CandidateGroup} group
 * @param {Decisions} decisions
 * @param {boolean} judges
 */
function heading(group, decisions, judges) {
  const undo = h(
    "button",
    { class: "quiet", disabled: !group.can_undo || !judges, "aria-label": "Undo" },
    icon("undo"),
  );
  undo.dataset.at = "undo:";
  undo.addEventListener("click", () => decisions.undoRedo("undo"));
  const category = h("span", { class: "chip" }, group.category);
  return h("div", { class: "row name" }, h("h2", {}, group.name), category, h("span", { class: "grow" }), undo);
}

/**
 * Buttons for more candidates, a mesh upload and a comment.
 * @param {CandidateGroup} group
 * @param {Decisions} decisions
 * @param {Asked} asked
 * @param {boolean} judges
 */
function others(group, decisions, { comment }, judges) {
  const mesh = h("input", { type: "file", accept: ".glb,.obj,.ply,.stl", hidden: true, "aria-label": "Mesh file" });
  mesh.addEventListener("change", () => {
    const [file] = mesh.files ?? [];
    mesh.value = ""; // allow choosing the same file again
    if (file) decisions.upload(file);
  });
  /** @type {[string, string, () => void, string][]} */
  const buttons = [
    [
      "more",
      "More candidates",
      () => decisions.more(),
      !judges ? REVIEWERS : group.can_regenerate ? "" : "no further ones are made",
    ],
    ["upload", "Upload a mesh…", () => mesh.click(), judges ? "" : REVIEWERS],
    ["comment", "Comment", comment, ""],
  ];
  const made = buttons.map(([at, text, act, not]) => {
    const button = h("button", { type: "button", disabled: not !== "", title: not, onClick: act }, text);
    button.dataset.at = `${at}:`;
    return button;
  });
  return h("div", { class: "row" }, ...made, mesh);
}
