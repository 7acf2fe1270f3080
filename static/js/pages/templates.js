/** Templates page: lists of names and categories that projects use as checklists of objects to click. */

import { addTemplate, changeTemplate, listTemplates, removeTemplate } from "../api.js";
import { h, LiveElement, renew } from "../dom.js";
import { say, sayError } from "../elements/toasts.js";
import { asText, fromText } from "../lib/checklist.js";
import { ago, counted } from "../lib/format.js";

/** @typedef {import("../api-types").Template} Template */
/** @typedef {import("../api-types").TemplateIn} TemplateIn */

const WHAT =
  "A project takes over a template's objects on its overview, or when it is made; Annotate then offers those that are still to be clicked. What a project took over stays as it is when the template changes.";
const LINES = "An object a line: its name, a comma, its category";

export class TemplatesPage extends LiveElement {
  #list = h("ul", { class: "plain stack" });
  #new = h("section", { class: "card stack", "aria-label": "A new template" });

  connected() {
    document.title = "Templates · r2c2r";
    this.replaceChildren(
      h(
        "div",
        { class: "page stack" },
        h("header", {}, h("h1", {}, "Templates")),
        h("p", { class: "muted" }, WHAT),
        this.#list,
        this.#new,
      ),
    );
    this.#drawNew();
    this.#load();
  }

  async #load() {
    try {
      const templates = await listTemplates(this.signal);
      renew(this.#list, ...templates.map((template) => this.#item(template)));
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {Template} template */
  #item(template) {
    const { id, name, objects, who, changed, may_change } = template;
    const about = `${counted(objects.length, "object")} · ${who} · ${ago(changed, Date.now() / 1000)}`;
    const summary = h(
      "summary",
      { "data-at": `template:${id}` },
      h("strong", {}, name),
      " ",
      h("span", { class: "muted" }, about),
    );
    const remove = h("button", { type: "button", class: "quiet danger" }, "Delete");
    remove.setAttribute("aria-label", `Delete ${name}`);
    remove.addEventListener("click", () => this.#remove(template));
    const shown = may_change
      ? form(`of ${name}`, template, "Save", (wanted) => this.#store(changeTemplate(id, wanted), "is saved"), remove)
      : h("pre", {}, asText(objects));
    return h("li", { class: "card" }, h("details", { class: "stack" }, summary, shown));
  }

  #drawNew() {
    const empty = { name: "", objects: [] };
    const made = form("of the new template", empty, "Add", async (wanted) => {
      if (await this.#store(addTemplate(wanted), "is added")) this.#drawNew();
    });
    this.#new.replaceChildren(h("h2", {}, "A new template"), made);
  }

  /**
   * @param {Promise<Template>} sent
   * @param {string} done
   */
  async #store(sent, done) {
    try {
      say(`${(await sent).name} ${done}`, { kind: "good" });
      this.#load();
      return true;
    } catch (error) {
      sayError(error);
      return false;
    }
  }

  /** @param {Template} template */
  async #remove({ id, name, objects }) {
    try {
      await removeTemplate(id);
      const undo = () => this.#store(addTemplate({ name, objects }), "is back");
      say(`${name} is deleted`, { offer: { text: "Undo", run: undo } });
      this.#load();
    } catch (error) {
      sayError(error);
    }
  }
}

/**
 * @param {string} whose suffix of the accessible labels
 * @param {TemplateIn} template
 * @param {string} button
 * @param {(wanted: TemplateIn) => void} send
 * @param {...HTMLElement} more further buttons
 */
function form(whose, { name, objects }, button, send, ...more) {
  const called = h("input", {
    type: "text",
    value: name,
    required: true,
    maxLength: 120,
    "aria-label": `Name ${whose}`,
  });
  const lines = h("textarea", { rows: 8, required: true, value: asText(objects), "aria-label": `Objects ${whose}` });
  const made = h(
    "form",
    { class: "stack" },
    h("label", { class: "stack" }, "Name", called),
    h("label", { class: "stack" }, LINES, lines),
    h("div", { class: "row" }, h("button", { type: "submit", class: "primary" }, button), ...more),
  );
  made.addEventListener("submit", (event) => {
    event.preventDefault();
    send({ name: called.value, objects: fromText(lines.value) });
  });
  return made;
}
