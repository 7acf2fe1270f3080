/** Checklist of the objects to click: progress, taking the list from a template, and saving the project's objects as one. */

import { addTemplate, listObjects, listTemplates, setChecklist } from "../api.js";
import { h, LiveElement } from "../dom.js";
import { Answers } from "../lib/answers.js";
import { remaining } from "../lib/checklist.js";
import { counted } from "../lib/format.js";
import { askForText } from "./ask-dialog.js";
import { say, sayError } from "./toasts.js";

/** @typedef {import("../api-types").Project} Project */
/** @typedef {import("../api-types").ListedObject} ListedObject */

export class ObjectChecklist extends LiveElement {
  project = "";
  #answers = new Answers();
  #name = "";
  /** @type {ListedObject[]} objects already clicked */
  #made = [];
  #state = h("p", { role: "status" });
  #choice = h("select");
  #keep = h("button", { type: "button", hidden: true }, "Keep this project's objects as a template…");

  connected() {
    const { signal } = this;
    this.replaceChildren(
      h(
        "section",
        { class: "card stack", "aria-label": "Objects to click" },
        h("h2", {}, "Objects to click"),
        this.#state,
        h(
          "div",
          { class: "row" },
          h("label", { class: "row" }, "Take the objects of", this.#choice),
          this.#keep,
          h("a", { href: "/templates" }, "Templates"),
        ),
      ),
    );
    this.#choice.addEventListener("change", () => this.#take(this.#choice.value), { signal });
    this.#keep.addEventListener("click", () => this.#store(), { signal });
    this.#offer();
  }

  /** Load and show the project's progress. @param {Project} project */
  async show(project) {
    try {
      await this.#answers.take(listObjects(project.id), (objects) => {
        this.#name = project.name;
        this.#made = objects.map(({ name, category }) => ({ name, category }));
        this.#keep.hidden = !objects.length;
        this.#state.textContent = told(project.checklist, this.#made);
      });
    } catch (error) {
      sayError(error);
    }
  }

  async #offer() {
    try {
      const templates = await listTemplates(this.signal);
      this.#choice.replaceChildren(
        h("option", { value: "" }, "choose a template"),
        ...templates.map(({ id, name, objects }) => h("option", { value: String(id) }, `${name} (${objects.length})`)),
        h("option", { value: "none" }, "none"),
      );
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {string} wanted */
  async #take(wanted) {
    if (!wanted) return;
    this.#choice.value = "";
    try {
      const project = await setChecklist(this.project, wanted === "none" ? null : Number(wanted));
      say(
        wanted === "none" ? "No list of objects to click" : `${counted(project.checklist.length, "object")} to click`,
        {
          kind: "good",
        },
      );
      this.show(project);
    } catch (error) {
      sayError(error);
    }
  }

  async #store() {
    const notes = [
      `${counted(this.#made.length, "object")}: names and categories, no clicks`,
      "Everybody on this server sees it",
    ];
    const name = await askForText("Keep as a template", "Its name", { button: "Keep", notes, value: this.#name });
    if (!name) return;
    try {
      const template = await addTemplate({ name, objects: this.#made });
      say(`${template.name} is a template`, { kind: "good", hint: "Projects can take over its objects." });
      this.#offer();
    } catch (error) {
      sayError(error);
    }
  }
}

/**
 * @param {ListedObject[]} checklist
 * @param {ListedObject[]} made
 */
function told(checklist, made) {
  if (!checklist.length)
    return "A template lists the names and categories of a kitchen like this one: Annotate offers them as the objects still to click.";
  const left = remaining(checklist, made).map(({ name }) => name);
  const done = `${checklist.length - left.length} of ${checklist.length} are clicked.`;
  return left.length ? `${done} Still to click: ${left.slice(0, 8).join(", ")}${left.length > 8 ? ", …" : ""}.` : done;
}
