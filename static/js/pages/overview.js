/** What the recording is, before any work starts; and where the project stands. */

import { changeProject, getHistory, getProject, getSystem } from "../api.js";
import { detailOf, h, LiveElement } from "../dom.js";
import { allFigures, momentStrips, scanPictures, verdictCard } from "../elements/capture-report.js";
import { BackendChoice } from "../elements/backend-choice.js";
import { JobPanel } from "../elements/job-panel.js";
import { sayError } from "../elements/toasts.js";
import { ViewerFrame } from "../elements/viewer-frame.js";
import { ago, bytes, counted } from "../lib/format.js";
import { live } from "../live.js";

/** @typedef {import("../api-types").Project} Project */

const SEAMS = /** @type {const} */ (["segmenter", "generator", "matcher"]);

export class OverviewPage extends LiveElement {
  project = "";
  #body = h("div", { class: "page" });
  #job = new JobPanel();
  #viewer = new ViewerFrame();
  #choices = SEAMS.map((seam) => Object.assign(new BackendChoice(), { seam }));
  #shown = false;

  connected() {
    this.replaceChildren(this.#body);
    const { signal } = this;
    for (const choice of this.#choices) {
      choice.addEventListener("choose", (event) => this.#choose(detailOf(event)), { signal });
    }
    getSystem().then((system) => {
      for (const choice of this.#choices) choice.backends = system[`${choice.seam}s`];
    }, sayError);
    live.addEventListener("project", () => this.#load(), { signal });
    live.addEventListener("job", () => this.#load(), { signal });
    this.#load();
  }

  async #load() {
    try {
      this.#draw(await getProject(this.project, this.signal));
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {{ seam: string, name: string }} chosen */
  async #choose({ seam, name }) {
    try {
      this.#draw(await changeProject(this.project, { [seam]: name }));
    } catch (error) {
      sayError(error);
      this.#load();
    }
  }

  /** @param {Project} project */
  #draw(project) {
    if (project.id !== this.project) return;
    for (const choice of this.#choices) choice.chosen = project[choice.seam];
    this.#job.job = project.status === "ready" ? null : project.job;
    const capture = project.capture;
    this.#body.replaceChildren(
      h("header", {}, h("h1", {}, project.name), nextStep(project)),
      project.status === "ready"
        ? ""
        : h("section", { class: "card stack" }, h("h2", {}, "Importing"), failure(project), this.#job),
      ...(capture && project.status === "ready"
        ? [
            h("div", { class: "split" }, this.#facts(project, capture), scanCard(project)),
            h("div", { class: "split" }, h("div", { class: "stack" }, ...this.#choices), this.#cloud()),
          ]
        : []),
      h("section", { class: "stack" }, h("h2", {}, "History"), this.#history()),
    );
    if (capture && project.status === "ready" && !this.#shown) {
      this.#shown = true;
      this.#viewer.open(this.project, { mode: "cloud" });
    }
  }

  /**
   * @param {Project} project
   * @param {NonNullable<Project["capture"]>} capture
   */
  #facts(project, capture) {
    /** @type {[string, string][]} */
    const rows = [
      ["Format", capture.format],
      ["Frames", `${capture.frame_count}${capture.duration_s ? `, ${capture.duration_s.toFixed(1)} s` : ""}`],
      ["Colour", `${capture.width} × ${capture.height}`],
      ["Depth", `${capture.depth_width} × ${capture.depth_height}`],
      ["Camera path", `${capture.path_length_m.toFixed(1)} m`],
      ["Up", capture.up_source === "file" ? "from the recording" : `from ${capture.up_source}`],
      ["Floor", capture.floor_found ? "found" : "not found: heights are relative"],
      ["On disk", bytes(project.size_bytes)],
    ];
    return h(
      "section",
      { class: "card stack" },
      h("h2", {}, "The recording"),
      verdictCard(capture),
      h("dl", { class: "facts" }, ...rows.flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, value)])),
      list(project.notices),
      momentStrips(capture),
      allFigures(capture),
    );
  }

  #cloud() {
    return h("section", { class: "card cloud" }, this.#viewer);
  }

  #history() {
    const table = h("table", {}, h("tbody", {}));
    getHistory(this.project).then((entries) => {
      const now = Date.now() / 1000;
      table.tBodies[0]?.replaceChildren(
        ...entries
          .slice(0, 20)
          .map((entry) =>
            h(
              "tr",
              {},
              h("td", {}, entry.undone ? h("s", {}, entry.text) : entry.text),
              h("td", { class: "muted" }, entry.who),
              h("td", { class: "muted" }, ago(entry.at, now)),
            ),
          ),
      );
      if (!entries.length) table.replaceWith(h("p", { class: "muted" }, "No one has changed anything yet."));
    }, sayError);
    return table;
  }
}

/** @param {Project} project */
function scanCard(project) {
  return h(
    "section",
    { class: "card stack" },
    h("h2", {}, "The scan"),
    scanPictures(project.id, project.media_version),
  );
}

/** @param {string[]} lines */
function list(lines) {
  return lines.length ? h("ul", {}, ...lines.map((line) => h("li", {}, line))) : null;
}

/** @param {Project} project */
function failure(project) {
  if (!project.error) return null;
  return h(
    "p",
    { role: "alert" },
    h("strong", {}, project.error.message),
    project.error.hint ? ` — ${project.error.hint}` : "",
  );
}

/** @param {Project} project */
function nextStep(project) {
  if (project.status !== "ready") return "";
  const base = `/p/${project.id}`;
  const [path, text] =
    project.result === "current"
      ? ["review", "Review the scene"]
      : project.counts.objects
        ? ["run", `Run on ${counted(project.counts.objects, "object")}`]
        : ["annotate", "Click objects"];
  return h("a", { class: "button primary", href: `${base}/${path}` }, text ?? "");
}
