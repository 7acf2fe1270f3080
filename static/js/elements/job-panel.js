/** Panel of one job: stages, progress, time left, cancel, retry, log. */

import { cancelJob, getJobEvents, getJobLog, retryJob } from "../api.js";
import { h, LiveElement, renew } from "../dom.js";
import { duration } from "../lib/format.js";
import { stageWord } from "../lib/words.js";
import { sayError } from "./toasts.js";

/** @typedef {import("../api-types").Job} Job */

const STATES = {
  queued: "waiting",
  running: "running",
  cancelling: "stopping…",
  cancelled: "cancelled",
  failed: "failed",
  done: "done",
};

export class JobPanel extends LiveElement {
  /** @type {Job | null} */
  #job = null;
  #log = h("pre", { class: "log", hidden: true, tabIndex: 0, "aria-label": "Log" });

  /** @param {Job | null} job */
  set job(job) {
    const further = job?.id === this.#job?.id && (job?.state !== this.#job?.state || job?.stage !== this.#job?.stage);
    this.#job = job;
    if (job && further && !this.#log.hidden) this.#readLog(job.id).catch(sayError);
    this.#draw();
  }

  get job() {
    return this.#job;
  }

  #draw() {
    const job = this.#job;
    if (!job) return this.replaceChildren();
    const running = ["queued", "running", "cancelling"].includes(job.state);
    const tone =
      job.state === "failed" ? "bad" : job.state === "done" ? "good" : job.state === "cancelled" ? "warn" : "";
    const left = job.eta_s !== null && running ? `about ${duration(job.eta_s)} left` : "";
    const queue = job.state === "queued" && job.position ? `number ${job.position} in the queue` : "";
    const head = h(
      "div",
      { class: "row" },
      h("span", { class: `chip ${tone}` }, STATES[job.state]),
      h("span", { class: "muted" }, [running ? job.message : "", left || queue].filter(Boolean).join(" · ")),
    );
    renew(
      this,
      h(
        "div",
        { class: "stack" },
        head,
        running ? h("progress", { value: job.progress, max: 1, "aria-label": "Progress" }) : null,
        h("ol", { class: "stages" }, ...job.stages.map((stage) => this.#stage(job, stage))),
        job.error ? this.#error(job.error) : null,
        this.#buttons(job, running),
        this.#log,
      ),
    );
  }

  /**
   * @param {Job} job
   * @param {Job["stages"][number]} stage
   */
  #stage(job, stage) {
    const value = stage.state === "done" ? 1 : stage.name === job.stage ? job.stage_fraction : 0;
    const bar = h("progress", { value, max: 1, "aria-label": stageWord(stage.name) });
    return h(
      "li",
      { class: stage.state },
      h("span", {}, stageWord(stage.name)),
      bar,
      h("span", { class: "state" }, stage.state),
    );
  }

  /** @param {NonNullable<Job["error"]>} error */
  #error(error) {
    return h("p", { role: "alert", class: "failure" }, h("strong", {}, error.message), h("span", {}, error.hint ?? ""));
  }

  /** Load the output of the job's processes, or its events while there is no output. @param {number} job */
  async #readLog(job) {
    const text = await getJobLog(job);
    const events = text ? [] : await getJobEvents(job);
    const lines = events.map(
      ({ at, stage, text: line }) => `${new Date(1000 * at).toLocaleTimeString()}  ${stage.padEnd(11)} ${line}`,
    );
    this.#log.textContent = text || lines.join("\n") || "Nothing has been written yet.";
  }

  /**
   * @param {Job} job
   * @param {boolean} running
   */
  #buttons(job, running) {
    const row = h("div", { class: "row" });
    /** @type {(text: string, act: () => Promise<unknown>, tone?: string) => void} */
    const add = (text, act, tone = "") => {
      const button = h("button", { type: "button", class: tone, onClick: () => act().catch(sayError) }, text);
      button.dataset.at = `${text}:`;
      row.append(button);
    };
    if (running) add("Cancel", async () => (this.job = await cancelJob(job.id)));
    const ended = ["failed", "cancelled"].includes(job.state);
    if (ended && job.no_retry) row.append(h("span", { class: "muted" }, `It cannot be tried again: ${job.no_retry}.`));
    else if (ended) add("Try again", async () => (this.job = await retryJob(job.id)), "primary");
    if (job.has_log) {
      add(this.#log.hidden ? "Show the log" : "Hide the log", async () => {
        this.#log.hidden = !this.#log.hidden;
        if (!this.#log.hidden) await this.#readLog(job.id);
        this.#draw();
      });
    }
    return row;
  }
}
