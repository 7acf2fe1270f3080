/** All projects; import by upload, drop or path; the sample kitchen. */

import {
  cancelUpload,
  changeProject,
  deleteProject,
  getSystem,
  listProjects,
  listUploads,
  makeSample,
  uploadRecording,
} from "../api.js";
import { detailOf, h, icon, LiveElement } from "../dom.js";
import { matches } from "../lib/filter.js";
import { FolderDialog } from "../elements/folder-dialog.js";
import { stateChip as stateOf } from "../elements/review-state.js";
import { say, sayError } from "../elements/toasts.js";
import { UnknownList } from "../elements/unknown-list.js";
import { Answers } from "../lib/answers.js";
import { ago, bytes, counted } from "../lib/format.js";
import { live } from "../live.js";
import { go } from "../router.js";

/** @typedef {import("../api-types").ProjectSummary} Project */

/** @type {Record<string, (a: Project, b: Project) => number>} beside last changed first, as they come */
const ORDERS = {
  name: (a, b) => a.name.localeCompare(b.name),
  size: (a, b) => b.size_bytes - a.size_bytes,
};
const MANY = 4; // projects, from which they are searched through

export class ProjectsPage extends LiveElement {
  #answers = new Answers();
  #cards = h("ul", { class: "cards" });
  #upload = h("div", { class: "card", hidden: true });
  #stopped = h("ul", { class: "cards stopped", "aria-label": "Uploads that stopped" });
  #unknown = new UnknownList();
  #picker = h("input", { type: "file", accept: ".r3d,.zip", hidden: true, "aria-label": "Recording" });
  #folders = new FolderDialog();
  /** @type {Project[]} */
  #projects = [];
  #search = h("input", { type: "search", placeholder: "Name", "aria-label": "Find projects" });
  #sort = h(
    "select",
    { "aria-label": "Order of the projects" },
    ...[
      ["", "Last changed first"],
      ["name", "By name"],
      ["size", "Largest first"],
    ].map(([value, text]) => h("option", { value }, text ?? "")),
  );
  #count = h("span", { class: "muted", role: "status" });
  #find = h("div", { class: "row find-projects", hidden: true }, this.#search, this.#sort, this.#count);
  #browse = h("button", { type: "button", onClick: () => this.#folders.open() }, "From this machine…");
  #admin = true;
  #limit = Infinity;

  connected() {
    this.replaceChildren(
      h(
        "div",
        { class: "page" },
        h(
          "header",
          {},
          h("h1", {}, "Projects"),
          h("a", { class: "button quiet", href: "/people" }, "People"),
          h("button", { type: "button", onClick: () => this.#sample() }, "Sample kitchen"),
          this.#browse,
          h(
            "button",
            { type: "button", class: "primary", onClick: () => this.#picker.click() },
            icon("plus"),
            "Import a scan",
          ),
        ),
        this.#upload,
        this.#stopped,
        this.#unknown,
        this.#find,
        this.#cards,
      ),
      this.#picker,
      this.#folders,
    );
    const { signal } = this;
    this.#picker.addEventListener("change", () => this.#send(this.#picker.files?.[0]), { signal });
    this.#folders.addEventListener("imported", (event) => go(`/p/${detailOf(event).id}`), { signal });
    this.addEventListener("dragover", (event) => this.#dragging(event), { signal });
    this.addEventListener("dragleave", () => this.classList.remove("dropping"), { signal });
    this.addEventListener("drop", (event) => this.#drop(event), { signal });
    for (const type of ["projects", "project", "job"]) live.addEventListener(type, () => this.#load(), { signal });
    this.#search.addEventListener("input", () => this.#show(this.#projects), { signal });
    this.#sort.addEventListener("change", () => this.#show(this.#projects), { signal });
    getSystem().then((system) => this.#allow(system), sayError);
    this.#load();
    this.#showStopped();
  }

  /** @param {import("../api-types").SystemInfo} system */
  #allow(system) {
    this.#limit = system.max_upload_bytes;
    this.#admin = system.role === "admin";
    this.#browse.hidden = !this.#admin;
    if (this.#admin) this.#unknown.load();
    else this.#load();
  }

  async #load() {
    try {
      await this.#answers.take(listProjects(this.signal), (projects) => this.#show(projects));
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {Project[]} projects last touched first */
  #show(projects) {
    this.#projects = projects;
    this.#find.hidden = projects.length < MANY && !this.#search.value;
    const found = projects.filter(({ name }) => matches(this.#search.value.trim(), [name]));
    const order = ORDERS[this.#sort.value];
    const sorted = order ? found.toSorted(order) : found;
    this.#count.textContent = `${found.length} of ${projects.length}`;
    this.#cards.replaceChildren(...(projects.length ? sorted.map((project) => this.#card(project)) : [this.#empty()]));
  }

  #empty() {
    return h(
      "li",
      { class: "card empty" },
      h("div", {}, h("h2", {}, "Nothing here yet")),
      h(
        "div",
        {},
        h(
          "p",
          { class: "muted" },
          "Drop a scan here: Record3D's .r3d, or a zip of what Stray Scanner, Polycam or another RGB-D app or dataset exports.",
        ),
        h("p", { class: "muted" }, "Or try everything on a kitchen made for it."),
        h(
          "div",
          { class: "row" },
          h("button", { type: "button", class: "primary", onClick: () => this.#sample() }, "Open the sample kitchen"),
          h("button", { type: "button", onClick: () => this.#picker.click() }, "Import a scan"),
        ),
      ),
    );
  }

  /** @param {Project} project */
  #card(project) {
    const { counts, job } = project;
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
        h(
          "div",
          { class: "row acts" },
          h("button", { type: "button", class: "quiet", onClick: () => this.#rename(project) }, "Rename"),
          this.#admin
            ? h(
                "button",
                { type: "button", class: "quiet danger", onClick: () => this.#delete(project) },
                icon("trash"),
                "Delete",
              )
            : null,
        ),
      ),
    );
  }

  async #sample() {
    try {
      go(`/p/${(await makeSample({})).id}`);
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {DragEvent} event */
  #dragging(event) {
    event.preventDefault();
    this.classList.add("dropping");
  }

  /** @param {DragEvent} event */
  #drop(event) {
    event.preventDefault();
    this.classList.remove("dropping");
    this.#send(event.dataTransfer?.files[0]);
  }

  /** @param {File | undefined} file */
  async #send(file) {
    this.#picker.value = "";
    if (!file) return;
    if (file.size > this.#limit) {
      const hint = "put it on this machine and import it by its path";
      return say(`${file.name} is ${bytes(file.size)}; uploads end at ${bytes(this.#limit)}`, { kind: "bad", hint });
    }
    const controller = new AbortController();
    const bar = h("progress", { value: 0, max: 1, "aria-label": `Uploading ${file.name}` });
    const state = h("span", { class: "muted", role: "status" });
    const stop = h("button", { type: "button", onClick: () => controller.abort() }, "Stop");
    this.#upload.replaceChildren(
      h("div", { class: "row" }, `Uploading ${file.name}, ${bytes(file.size)}`, state, stop),
      bar,
    );
    this.#upload.hidden = false;
    this.#stopped.replaceChildren();
    /** @param {number} fraction @param {boolean} waiting */
    const show = (fraction, waiting) => {
      bar.value = fraction;
      state.textContent = waiting ? "no connection: it goes on by itself" : fraction === 1 ? "looking at it…" : "";
    };
    try {
      go(`/p/${(await uploadRecording(file, show, controller.signal)).id}`);
    } catch (error) {
      if (!controller.signal.aborted) sayError(error);
    }
    this.#upload.hidden = true;
    this.#showStopped();
  }

  /** Uploads that stopped: choosing the same file goes on with it. */
  async #showStopped() {
    try {
      const uploads = await listUploads();
      this.#stopped.replaceChildren(...uploads.map((upload) => this.#stoppedCard(upload)));
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {import("../api-types").Upload} upload */
  #stoppedCard(upload) {
    const forget = async () => {
      await cancelUpload(upload.id).catch(sayError);
      this.#showStopped();
    };
    const arrived = `${bytes(upload.offset)} of ${bytes(upload.size)} arrived`;
    return h(
      "li",
      { class: "card" },
      h(
        "div",
        { class: "body" },
        h("h2", {}, upload.file_name),
        h("p", { class: "muted" }, `${arrived}. Choose the same file again: only the rest is sent.`),
        h("progress", { value: upload.offset, max: upload.size, "aria-label": arrived }),
        h(
          "div",
          { class: "row" },
          h("button", { type: "button", onClick: () => this.#picker.click() }, "Choose the file"),
          h("button", { type: "button", class: "quiet danger", onClick: forget }, icon("trash"), "Give up"),
        ),
      ),
    );
  }

  /** @param {Project} project */
  async #rename(project) {
    const name = prompt("Name of the project", project.name)?.trim();
    if (!name || name === project.name) return;
    await changeProject(project.id, { name }).catch(sayError);
    this.#load();
  }

  /** @param {Project} project */
  async #delete(project) {
    if (!confirm(`Delete “${project.name}” with its recording, clicks and bundles? This cannot be undone.`)) return;
    try {
      const { freed_bytes } = await deleteProject(project.id);
      say(`Deleted ${project.name}: ${bytes(freed_bytes)} freed`);
    } catch (error) {
      sayError(error);
    }
    this.#load();
  }
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

/** Where it stands between annotator and reviewer, and what waits for an answer. @param {Project} project */
function reviewChip(project) {
  const open = project.counts.open_comments;
  return h(
    "span",
    { class: "row" },
    stateOf(project.review_state),
    open ? h("span", { class: "chip warn" }, counted(open, "open comment")) : "",
  );
}
