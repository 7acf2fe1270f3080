/** Card of a project in the list: thumbnail, state and actions. */

import { h } from "../dom.js";
import { ago, bytes, counted } from "../lib/format.js";
import { stateChip as stateOf } from "../state-chip.js";

/** @typedef {import("../api-types").ProjectSummary} Project */
/** @typedef {"rename" | "tag" | "duplicate" | "export" | "archive" | "delete"} Act */
/**
 * @typedef {object} How
 * @property {boolean} admin
 * @property {boolean} open whether its actions are shown
 * @property {() => void} more show or hide them
 * @property {(act: Act) => void} act
 * @property {(tag: string) => void} find
 */

/**
 * @param {Project} project
 * @param {How} how
 */
export function projectCard(project, { admin, open, more, act, find }) {
  const { counts, job } = project;
  /** @type {(what: string, text: string, press: () => void) => HTMLElement} */
  const button = (what, text, press) => {
    const made = h("button", { type: "button", class: "quiet", "aria-label": `${text}: ${project.name}` }, text);
    made.dataset.at = `${what}:${project.id}`;
    made.addEventListener("click", press);
    return made;
  };
  /** @type {(what: Act, text: string) => HTMLElement} */
  const action = (what, text) => button(what, text, () => act(what));
  const menu = button("more", "More", more);
  menu.setAttribute("aria-expanded", String(open));
  /** @type {(tag: string) => HTMLElement} */
  const tagged = (tag) =>
    h("button", { type: "button", class: "chip tag", title: `Projects with ${tag}`, onClick: () => find(tag) }, tag);
  const busy = job && ["queued", "running", "cancelling"].includes(job.state) ? job : null;
  const facts = project.frame_count ? counted(project.frame_count, "frame") : "";
  const thumb = project.thumbnail
    ? h("img", { class: "thumb", src: project.thumbnail, alt: "", loading: "lazy" })
    : h("div", { class: "thumb" });
  const what = [facts, counted(counts.objects, "object")];
  const line = [bytes(project.size_bytes), ago(project.updated, Date.now() / 1000)];
  return h(
    "li",
    { class: "card" },
    thumb,
    h(
      "div",
      { class: "body" },
      h("h2", {}, h("a", { href: `/p/${project.id}` }, project.name)),
      h("div", { class: "row" }, stateChip(project), reviewChip(project)),
      busy ? h("progress", { value: busy.progress, max: 1, "aria-label": `${busy.kind} ${project.name}` }) : null,
      h("div", { class: "muted" }, what.filter(Boolean).join(" · "), h("br"), line.filter(Boolean).join(" · ")),
      project.tags.length ? h("div", { class: "row tags" }, ...project.tags.map(tagged)) : null,
      h("div", { class: "row acts" }, menu),
      h(
        "div",
        { class: "row acts", hidden: !open },
        action("rename", "Rename"),
        action("tag", "Tags"),
        action("duplicate", "Duplicate"),
        project.status === "ready" ? action("export", "Export") : null,
        action("archive", project.archived ? "Unarchive" : "Archive"),
        admin ? action("delete", "Delete") : null,
      ),
    ),
  );
}

/** @param {Project} project */
function stateChip(project) {
  if (project.status === "failed") return h("span", { class: "chip bad" }, "import failed");
  if (project.status === "importing") return h("span", { class: "chip" }, "importing…");
  if (project.job?.kind === "run" && ["queued", "running"].includes(project.job.state))
    return h("span", { class: "chip" }, "running…");
  if (project.result === "current") {
    const passed = project.bundle?.passed;
    return h(
      "span",
      { class: `chip ${passed ? "good" : "warn"}` },
      passed ? "bundle certified" : "bundle with findings",
    );
  }
  if (project.result === "stale") return h("span", { class: "chip warn" }, "changed since the last run");
  return h("span", { class: "chip" }, project.counts.objects ? "annotating" : "new");
}

/** Chip of the review state and the open comments. @param {Project} project */
function reviewChip(project) {
  const open = project.counts.open_comments;
  return h(
    "span",
    { class: "row" },
    stateOf(project.review_state),
    open ? h("span", { class: "chip warn" }, counted(open, "open comment")) : "",
    project.assignee ? h("span", { class: "chip", title: "assigned to" }, `@${project.assignee}`) : "",
  );
}
