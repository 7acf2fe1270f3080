/** Overview page: facts of the recording, and the state of the project. */

import { changeProject, getHistory, getProject, getSystem, readAgain } from "../api.js";
import { detailOf, h, LiveElement, renew, spinner } from "../dom.js";
import { allFigures, momentStrips, scanPictures, verdictCard } from "../elements/capture-report.js";
import { Assignee } from "../elements/assignee.js";
import { BackendChoice } from "../elements/backend-choice.js";
import { JobPanel } from "../elements/job-panel.js";
import { ObjectChecklist } from "../elements/object-checklist.js";
import { MemberList } from "../elements/member-list.js";
import { offerExport } from "../elements/export-dialog.js";
import { historyRow, NewsList } from "../elements/news-list.js";
import { OpinionList } from "../elements/opinion-list.js";
import { sayError } from "../elements/toasts.js";
import { TrueLengthList } from "../elements/true-lengths.js";
import { UploadCard } from "../elements/upload-card.js";
import { ViewerFrame } from "../elements/viewer-frame.js";
import { Answers } from "../lib/answers.js";
import { bytes, counted } from "../lib/format.js";
import { live } from "../live.js";

/** @typedef {import("../api-types").Project} Project */

const SEAMS = /** @type {const} */ (["segmenter", "generator", "matcher", "arm"]);
const BESIDE = new Set(["unregistered", "colour_focal_length"]); // causes that depth registration fixes

export class OverviewPage extends LiveElement {
  project = "";
  #answers = new Answers();
  #assignee = new Assignee();
  #title = h("h1");
  #next = h("span");
  #loading = spinner("Loading the project…");
  #head = h("header", {}, this.#title, this.#assignee, this.#next);
  #importing = h("section", { class: "card stack", hidden: true });
  #arriving = h("div", { class: "arriving" }); // reserves space for the next picture
  #scan = h("div", { class: "split", hidden: true });
  #work = h("div", { class: "split", hidden: true });
  #history = h("section", { class: "stack" });
  #upload = new UploadCard();
  #picker = h("input", { type: "file", accept: ".r3d,.zip", hidden: true, "aria-label": "Recording" });
  #job = new JobPanel();
  #viewer = new ViewerFrame();
  #news = new NewsList();
  #members = new MemberList();
  #checklist = new ObjectChecklist();
  #opinions = new OpinionList();
  #lengths = new TrueLengthList();
  #choices = SEAMS.map((seam) => Object.assign(new BackendChoice(), { seam }));
  /** Chosen method of each stage; unfolds to the list of all. */
  #methods = h("summary", {}, "Methods");
  #shown = false;
  #read = ""; // key of the facts drawn; redrawing the same would make the page jump

  connected() {
    this.#assignee.project = this.#news.project = this.#members.project = this.#lengths.project = this.project;
    this.#checklist.project = this.#opinions.project = this.project;
    this.#work.replaceChildren(
      h("section", { class: "card cloud" }, this.#viewer),
      h("details", { class: "card stack methods" }, this.#methods, ...this.#choices),
    );
    this.replaceChildren(
      h(
        "div",
        { class: "page" },
        this.#head,
        this.#loading,
        this.#news,
        this.#importing,
        this.#upload,
        this.#scan,
        this.#work,
        this.#checklist,
        this.#lengths,
        this.#opinions,
        this.#members,
        this.#history,
      ),
      this.#picker,
    );
    for (const part of [this.#head, this.#checklist, this.#lengths, this.#opinions]) part.hidden = true;
    const { signal } = this;
    this.#picker.addEventListener("change", () => this.#give(), { signal });
    for (const choice of this.#choices) {
      choice.addEventListener("choose", (event) => this.#choose(detailOf(event)), { signal });
    }
    this.#lengths.addEventListener("rescaled", (event) => this.#draw(detailOf(event)), { signal });
    getSystem().then((system) => {
      this.#upload.limit = system.max_upload_bytes;
      for (const choice of this.#choices) choice.backends = system[`${choice.seam}s`];
    }, sayError);
    live.addEventListener("project", () => this.#load(), { signal });
    live.addEventListener("job", () => this.#load(), { signal });
    live.addEventListener("online", () => !this.#loading.hidden && this.#load(), { signal }); // else the first load failed
    this.#load();
  }

  async #load() {
    try {
      await this.#answers.take(getProject(this.project, this.signal), (project) => this.#draw(project));
    } catch (error) {
      sayError(error);
    }
  }

  /** Prompt to upload a missing recording. @param {Project} project */
  #missing(project) {
    const made = project.counts.objects;
    return h(
      "p",
      {},
      made ? `Waiting for the recording: ${counted(made, "object")}, with their comments. ` : "",
      h("button", { type: "button", class: "primary", onClick: () => this.#picker.click() }, "Choose the recording"),
    );
  }

  async #give() {
    const file = this.#picker.files?.[0];
    this.#picker.value = "";
    const project = file && (await this.#upload.send(file, this.project));
    if (project) this.#draw(project);
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
    this.#loading.hidden = true;
    this.#head.hidden = this.#checklist.hidden = false;
    for (const choice of this.#choices) choice.chosen = project[choice.seam];
    this.#methods.textContent = `Methods: ${SEAMS.map((seam) => project[seam])
      .filter((name) => name !== "none")
      .join(", ")}`;
    this.#job.job = project.status === "ready" ? null : project.job;
    const ready = project.status === "ready";
    const capture = ready ? project.capture : null;
    this.#title.textContent = project.name;
    renew(this.#next, exporting(project), " ", nextStep(project));
    this.#assignee.name = project.assignee;
    this.#importing.hidden = ready;
    const missing = project.awaits_recording;
    this.#importing.replaceChildren(
      h("h2", {}, missing ? "The recording is missing" : "Importing"),
      failure(project) ?? "",
      ...(missing ? [this.#missing(project)] : []),
      ...(project.job ? [h("div", { class: "split" }, this.#job, this.#arriving)] : []),
    );
    this.#arriving.hidden = ready || project.job?.kind !== "sample";
    if (!ready && project.thumbnail) this.#drawArriving(project.thumbnail);
    this.#scan.hidden = this.#work.hidden = this.#lengths.hidden = this.#opinions.hidden = !capture;
    if (capture) this.#drawScan(project, capture);
    this.#drawHistory();
    this.#checklist.show(project);
    if (capture && !this.#shown) {
      this.#shown = true;
      this.#viewer.open(this.project, { mode: "cloud" });
    }
  }

  /** Show the last rendered frame of a sample, once it is loaded. @param {string} address */
  async #drawArriving(address) {
    const picture = h("img", { src: address, alt: "The frame that was rendered last" });
    try {
      await picture.decode();
    } catch {
      return; // gone: the sample has been read, and its frames are shown instead
    }
    this.#arriving.replaceChildren(picture);
  }

  /**
   * @param {Project} project
   * @param {NonNullable<Project["capture"]>} capture
   */
  #drawScan(project, capture) {
    const read = JSON.stringify([
      capture,
      project.notices,
      project.register_depth,
      project.size_bytes,
      project.media_version,
    ]);
    if (read === this.#read) return;
    this.#read = read;
    this.#scan.replaceChildren(this.#facts(project, capture), scanCard(project));
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
      verdictCard(capture, project.notices.length),
      this.#registering(project, capture),
      h("dl", { class: "facts" }, ...rows.flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, value)])),
      list(project.notices),
      momentStrips(capture),
      allFigures(capture),
    );
  }

  /**
   * Button to register misaligned depth to the colour images, or to undo that; never done without the user's consent.
   * @param {Project} project
   * @param {NonNullable<Project["capture"]>} capture
   */
  #registering(project, capture) {
    const beside = capture.remarks.some((remark) => BESIDE.has(remark.cause));
    if (!beside && !project.register_depth) return null;
    const said = project.register_depth
      ? "Depth was registered to the colour images when the recording was read."
      : "Depth can be registered to the colour images by the fit above: the recording is read again, clicks stay.";
    const button = h(
      "button",
      { type: "button" },
      project.register_depth ? "Read depth as recorded" : "Register depth",
    );
    button.addEventListener("click", () => this.#readAgain(button, !project.register_depth), { signal: this.signal });
    return h("div", { class: "row", role: "note" }, h("span", {}, said), button);
  }

  /**
   * @param {HTMLButtonElement} button
   * @param {boolean} registered
   */
  async #readAgain(button, registered) {
    button.disabled = true;
    try {
      this.#draw(await readAgain(this.project, { register_depth: registered }));
    } catch (error) {
      sayError(error);
      button.disabled = false;
    }
  }

  async #drawHistory() {
    try {
      const entries = await getHistory(this.project);
      const now = Date.now() / 1000;
      const rows = entries.slice(0, 20).map((entry) => historyRow(entry, now));
      const told = rows.length
        ? h("table", {}, h("tbody", {}, ...rows))
        : h("p", { class: "muted" }, "No one has changed anything yet.");
      const effort = h(
        "a",
        { href: `/api/projects/${this.project}/effort.csv`, download: "" },
        "Clicks and minutes of each person and object, as a table",
      );
      this.#history.replaceChildren(
        h("h2", {}, "History"),
        told,
        rows.length ? h("p", {}, effort, " (CSV; pauses beyond two minutes are left out)") : "",
      );
    } catch (error) {
      sayError(error);
    }
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
function exporting(project) {
  if (project.status !== "ready") return "";
  return h(
    "button",
    { type: "button", "data-at": "export:", onClick: () => offerExport(project).catch(sayError) },
    "Export…",
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
  return h("a", { class: "button primary", href: `${base}/${path}`, "data-at": "next:" }, text ?? "");
}
