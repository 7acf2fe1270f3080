/** Projects page: list of all projects; import by upload, drop or path; the sample kitchen. */

import {
  cancelUpload,
  changeProject,
  deleteProject,
  duplicateProject,
  getSystem,
  listProjects,
  listTemplates,
  listUploads,
  makeSample,
  restoreProject,
  setChecklist,
} from "../api.js";
import { detailOf, h, icon, LiveElement, renew, spinner } from "../dom.js";
import { matches } from "../lib/filter.js";
import { FolderDialog } from "../elements/folder-dialog.js";
import { askForText } from "../elements/ask-dialog.js";
import { projectCard } from "../elements/project-card.js";
import { say, sayError } from "../elements/toasts.js";
import { TrashList } from "../elements/trash-list.js";
import { UnknownList } from "../elements/unknown-list.js";
import { UploadCard } from "../elements/upload-card.js";
import { Answers } from "../lib/answers.js";
import { bytes } from "../lib/format.js";
import { live } from "../live.js";
import { go } from "../router.js";

/** @typedef {import("../api-types").ProjectSummary} Project */

/** @type {Record<string, (a: Project, b: Project) => number>} besides the server's order, last changed first */
const ORDERS = {
  name: (a, b) => a.name.localeCompare(b.name),
  size: (a, b) => b.size_bytes - a.size_bytes,
};
const MANY = 4; // projects from which the search is shown

export class ProjectsPage extends LiveElement {
  #answers = new Answers();
  #cards = h("ul", { class: "cards" });
  #upload = new UploadCard();
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
  #place = h(
    "select",
    { "aria-label": "Which projects" },
    ...[
      ["", "In work"],
      ["archive", "Archived"],
    ].map(([value, text]) => h("option", { value }, text ?? "")),
  );
  #trash = new TrashList();
  #count = h("span", { class: "muted", role: "status" });
  #find = h("div", { class: "row find-projects", hidden: true }, this.#place, this.#search, this.#sort, this.#count);
  #template = h("select", {});
  #templates = h("label", { class: "row", hidden: true }, "Objects to click", this.#template);
  #people = h("a", { class: "button quiet", href: "/people" }, "People");
  #browse = h("button", { type: "button", onClick: () => this.#folders.open() }, "From this machine…");
  #admin = true;
  #opened = ""; // id of the project whose actions are shown

  connected() {
    this.replaceChildren(
      h(
        "div",
        { class: "page" },
        h(
          "header",
          {},
          h("h1", {}, "Projects"),
          this.#people,
          h("a", { class: "button quiet", href: "/templates" }, "Templates"),
          this.#templates,
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
        this.#trash,
      ),
      this.#picker,
      this.#folders,
    );
    this.#cards.replaceChildren(h("li", { class: "none" }, spinner("Loading the projects…")));
    const { signal } = this;
    this.#picker.addEventListener("change", () => this.#send(this.#picker.files?.[0]), { signal });
    this.#folders.addEventListener("imported", (event) => this.#made(detailOf(event)), { signal });
    this.addEventListener("dragover", (event) => this.#dragging(event), { signal });
    this.addEventListener("dragleave", () => this.classList.remove("dropping"), { signal });
    this.addEventListener("drop", (event) => this.#drop(event), { signal });
    for (const type of ["projects", "project", "job"]) live.addEventListener(type, () => this.#load(), { signal });
    this.#search.addEventListener("input", () => this.#show(this.#projects), { signal });
    for (const select of [this.#sort, this.#place])
      select.addEventListener("change", () => this.#show(this.#projects), { signal });
    this.#trash.addEventListener("trash", () => this.#show(this.#projects), { signal });
    getSystem().then((system) => this.#allow(system), sayError);
    listTemplates(signal).then((templates) => this.#offer(templates), sayError);
    this.#load();
    this.#showStopped();
  }

  /** Fill the menu of templates for new projects. @param {import("../api-types").Template[]} templates */
  #offer(templates) {
    this.#templates.hidden = !templates.length;
    this.#template.replaceChildren(
      h("option", { value: "" }, "no list"),
      ...templates.map(({ id, name }) => h("option", { value: String(id) }, name)),
    );
  }

  /** Open a new project, after giving it the chosen template's checklist. @param {{ id: string }} project */
  async #made({ id }) {
    const taken = this.#template.value ? setChecklist(id, Number(this.#template.value)) : null;
    const refused = await taken?.then(
      () => null,
      (error) => error,
    );
    go(`/p/${id}`);
    if (refused) sayError(refused);
  }

  /** @param {import("../api-types").SystemInfo} system */
  #allow(system) {
    this.#upload.limit = system.max_upload_bytes;
    this.#admin = system.role === "admin";
    this.#browse.hidden = !this.#admin;
    this.#people.textContent = this.#admin ? "People" : "Your account";
    this.#load();
    if (!this.#admin) return;
    this.#unknown.load();
    this.#place.append(h("option", { value: "trash" }, "Trash"));
    this.#trash.open();
  }

  async #load() {
    try {
      await this.#answers.take(listProjects(this.signal), (projects) => this.#show(projects));
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {Project[]} projects last changed first */
  #show(projects) {
    this.#projects = projects;
    const place = this.#place.value;
    const typed = this.#search.value.trim();
    const here = projects.filter(({ archived }) => archived === (place === "archive"));
    const found = here.filter(({ name, tags }) => matches(typed, [name, ...tags]));
    const order = ORDERS[this.#sort.value];
    const sorted = order ? found.toSorted(order) : found;
    const set = typed || place;
    const used = set || this.#find.contains(document.activeElement);
    this.#find.hidden = projects.length < MANY && !used && here.length === projects.length && !this.#trash.size;
    this.#count.textContent = `${found.length} of ${here.length}`;
    this.#trash.hidden = place !== "trash";
    for (const each of [this.#search, this.#sort, this.#count, this.#cards]) each.hidden = place === "trash";
    const nothing = place ? h("li", { class: "muted none" }, "Nothing is archived.") : this.#empty();
    const card = (/** @type {Project} */ project) =>
      projectCard(project, {
        admin: this.#admin,
        open: this.#opened === project.id,
        more: () => this.#unfold(project.id),
        act: (act) => this.#act(act, project),
        find: (tag) => this.#look(tag),
      });
    renew(this.#cards, ...(here.length || set ? sorted.map(card) : []), ...(here.length ? [] : [nothing]));
  }

  /** Show a project's actions, or hide those shown. @param {string} id */
  #unfold(id) {
    this.#opened = this.#opened === id ? "" : id;
    this.#show(this.#projects);
  }

  /** @param {string} typed */
  #look(typed) {
    this.#search.value = typed;
    this.#show(this.#projects);
    this.#find.hidden = false;
    this.#search.focus();
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
          "Drop a scan here: Record3D's .r3d, a zip of what Stray Scanner, Polycam or another RGB-D app or dataset exports, or a project's file from another server.",
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

  async #sample() {
    try {
      await this.#made(await makeSample({}));
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
    this.#stopped.replaceChildren();
    const project = await this.#upload.send(file);
    if (project) await this.#made(project);
    this.#showStopped();
  }

  /** Show interrupted uploads; choosing the same file resumes one. */
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

  /** @type {Record<import("../elements/project-card.js").Act, (project: Project) => Promise<unknown>>} */
  #acts = {
    rename: async ({ id, name }) => {
      const given = await askForText(`Rename ${name}`, "Name of the project", { button: "Rename", value: name });
      const wanted = given?.replace(/\s+/g, " ");
      if (wanted && wanted !== name) await changeProject(id, { name: wanted });
    },
    tag: async ({ id, name, tags }) => {
      const label = "Tags, separated by commas";
      const given = await askForText(`Tags of ${name}`, label, {
        button: "Keep",
        required: false,
        value: tags.join(", "),
      });
      if (given !== null)
        await changeProject(id, {
          tags: given
            .split(",")
            .map((tag) => tag.trim())
            .filter(Boolean),
        });
    },
    duplicate: async ({ id, name }) => {
      const copy = await duplicateProject(id);
      const offer = { text: "Open it", run: () => go(`/p/${copy.id}`) };
      say(`${name} is duplicated`, { kind: "good", hint: copy.name, offer });
    },
    export: async (project) => (await import("../elements/export-dialog.js")).offerExport(project), // few ask for it
    archive: async ({ id, name, archived }) => {
      await changeProject(id, { archived: !archived });
      const undo = () => changeProject(id, { archived }).then(() => this.#load(), sayError);
      say(archived ? `${name} is out of the archive` : `${name} is archived`, { offer: { text: "Undo", run: undo } });
    },
    delete: async ({ id, name }) => {
      await deleteProject(id);
      const undo = () => restoreProject(id).then(() => this.#load(), sayError);
      say(`${name} is in the trash`, { hint: "All of it is kept there.", offer: { text: "Undo", run: undo } });
    },
  };

  /**
   * @param {import("../elements/project-card.js").Act} act
   * @param {Project} project
   */
  async #act(act, project) {
    await this.#acts[act](project).catch(sayError);
    this.#load();
  }
}
