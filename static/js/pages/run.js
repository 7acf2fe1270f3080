/** Run page: start the pipeline, progress of each stage, cancel, log of a failed one, then the results and the certificate. */

import { getCertificate, getProject, getScene, listJobs, startRun } from "../api.js";
import { detailOf, h, LiveElement, spinner } from "../dom.js";
import { BeforeRun } from "../elements/before-run.js";
import { JobPanel } from "../elements/job-panel.js";
import { certificateCard, sceneTable } from "../elements/results.js";
import { sayError } from "../elements/toasts.js";
import { counted } from "../lib/format.js";
import { RUN, stageWord } from "../lib/words.js";
import { live } from "../live.js";

/** @typedef {import("../api-types").Job} Job */

const SOON_MS = 500;
/** Text about a run's work, by the state of the result. */
const WORK = {
  none: "Nothing is computed yet: a run computes everything, in some minutes.",
  current: "The result is up to date: running again does no work.",
  stale: "Only what changed will be computed.",
};

export class RunPage extends LiveElement {
  project = "";
  #job = new JobPanel();
  #start = h("button", { type: "button", class: "primary", disabled: true }, "Run");
  #lead = h("p", { class: "muted" }, spinner("Loading…"));
  #before = new BeforeRun();
  #soon = 0;
  #ready = false; // whether there is something to run
  #result = h("div", { class: "stack" });
  #stale = h("span", { class: "chip warn" });

  connected() {
    this.replaceChildren(
      h(
        "div",
        { class: "page stack" },
        h("header", {}, h("h1", {}, "Run"), this.#start),
        this.#lead,
        this.#before.element,
        h("section", { class: "card", hidden: true }, this.#job),
        this.#result,
      ),
    );
    const { signal } = this;
    this.#start.addEventListener("click", () => this.#run(), { signal });
    live.addEventListener("job", (event) => this.#hear(/** @type {{ job: Job }} */ (detailOf(event)).job), { signal });
    live.addEventListener("online", () => this.#load(), { signal });
    live.addEventListener("project", () => !this.#ready && this.#load(), { signal });
    live.addEventListener("segment", (event) => this.#found(detailOf(event)), { signal });
    this.#load();
  }

  async #load() {
    try {
      const [project, jobs] = await Promise.all([getProject(this.project, this.signal), listJobs(this.project)]);
      const job = jobs.find((candidate) => candidate.kind === "run") ?? null;
      this.#show(job);
      this.#job.closest("section")?.toggleAttribute("hidden", job === null);
      const objects = counted(project.counts.objects, "object");
      this.#ready = project.status === "ready" && project.counts.objects > 0;
      this.#start.disabled = project.counts.objects === 0;
      this.#lead.textContent = project.counts.objects
        ? `${objects}. ${WORK[project.result]}`
        : "Click at least one object on the Annotate page first.";
      if (project.result !== "none") await this.#drawResult(project.result);
      else this.#result.replaceChildren(job ? "" : stages());
      if (project.status === "ready") await this.#before.look(this.project, this.signal);
    } catch (error) {
      sayError(error);
    }
  }

  /** Check for contradictions after masks end, debounced, as others may follow soon. @param {{ state: string }} told */
  #found({ state }) {
    if (state !== "done" && state !== "failed") return;
    clearTimeout(this.#soon);
    this.#soon = window.setTimeout(() => this.#before.look(this.project, this.signal).catch(sayError), SOON_MS);
  }

  async #run() {
    try {
      this.#show(await startRun(this.project));
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {Job} job */
  #hear(job) {
    if (job.project !== this.project || job.kind !== "run") return;
    const finished = this.#job.job?.state !== job.state && ["done", "failed", "cancelled"].includes(job.state);
    this.#show(job);
    if (finished) this.#load();
  }

  /** @param {Job | null} job */
  #show(job) {
    this.#job.job = job;
    this.#job.closest("section")?.toggleAttribute("hidden", job === null);
    const running = job !== null && ["queued", "running", "cancelling"].includes(job.state);
    this.#start.textContent = running ? "Running…" : job?.state === "done" ? "Run again" : "Run";
    this.#stale.textContent = `older than the last change: ${running ? "the next one is being computed" : "run again"}`;
    if (running) this.#start.disabled = true;
    else if (job) this.#start.disabled = false;
  }

  /** @param {"current" | "stale"} result */
  async #drawResult(result) {
    const [scene, certificate] = await Promise.all([
      getScene(this.project),
      getCertificate(this.project).catch(() => null),
    ]);
    this.#result.replaceChildren(
      h(
        "section",
        { class: "card stack" },
        h(
          "div",
          { class: "row" },
          h("h2", { class: "grow" }, "Result"),
          result === "stale" ? this.#stale : null,
          h("a", { class: "button", href: `/p/${this.project}/review` }, "Review"),
          h("a", { class: "button", href: `/p/${this.project}/download` }, "Download"),
        ),
        sceneTable(scene),
      ),
      certificate ? certificateCard(certificate) : "",
    );
  }
}

/** What a run does, before the first one. */
function stages() {
  return h(
    "section",
    { class: "card" },
    h("h2", {}, "What a run does"),
    h("dl", { class: "facts" }, ...RUN.flatMap(([stage, text]) => [h("dt", {}, stageWord(stage)), h("dd", {}, text)])),
  );
}
