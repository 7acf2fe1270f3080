/** Honeypots for admins: sample kitchens added to people's inboxes, their scores, and a form to add another. */

import { listAccounts, listHoneypots, listProjects, scoreHoneypot, slipHoneypot } from "../api.js";
import { h, LiveElement, renew } from "../dom.js";
import { ago } from "../lib/format.js";
import { stateChip } from "../state-chip.js";
import { say, sayError } from "./toasts.js";

/** @typedef {import("../api-types").Honeypot} Honeypot */
/** @typedef {import("../api-types").HoneypotScore} HoneypotScore */

const WHAT =
  "The recording of a sample kitchen waits in somebody's inbox like any other. Only admins know, and see how the person's objects compare with the ground truth. An object counts as found where its masks and the true ones have an IoU of 0.5 and more. The table of effort of such a project gives the result for each object. Nobody else sees a sample whose only member is you (Overview).";
const SAMPLE = "sample"; // source name of a synthetic kitchen
const HEAD = ["Person", "Project", "Found", "On nothing", "Mask IoU", "Categories", "Effort"];

export class HoneypotList extends LiveElement {
  #rows = h("tbody");
  #table = h(
    "div",
    { class: "scroll", tabIndex: 0, role: "region", "aria-label": "Honeypots" },
    h("table", {}, h("thead", {}, h("tr", {}, ...HEAD.map((text) => h("th", { scope: "col" }, text)))), this.#rows),
  );
  #sample = h("select", { required: true });
  #person = h("select", { required: true });
  #name = h("input", { type: "text", required: true, maxLength: 120 });
  #form = h(
    "form",
    { class: "row form" },
    h("label", {}, "Sample kitchen", this.#sample),
    h("label", {}, "For", this.#person),
    h("label", {}, "Called", this.#name),
    h("button", { type: "submit", class: "primary" }, "Add to the inbox"),
  );
  #none = h("p", { class: "muted" }, "Make a sample kitchen on the page Projects first.");

  connected() {
    this.replaceChildren(
      h("h2", {}, "Honeypots"),
      h("p", { class: "muted" }, WHAT),
      this.#table,
      this.#form,
      this.#none,
    );
    this.#form.addEventListener("submit", (event) => (event.preventDefault(), this.#slip()), { signal: this.signal });
    this.#offer();
    this.#load();
  }

  async #offer() {
    try {
      const [projects, accounts] = await Promise.all([listProjects(this.signal), listAccounts()]);
      const samples = projects.filter(({ source_name, status }) => source_name === SAMPLE && status === "ready");
      this.#sample.replaceChildren(...samples.map(({ id, name }) => h("option", { value: id }, name)));
      this.#person.replaceChildren(...accounts.map(({ name }) => h("option", { value: name }, name)));
      this.#form.hidden = !samples.length || !accounts.length;
      this.#none.hidden = samples.length > 0;
    } catch (error) {
      sayError(error);
    }
  }

  async #load() {
    try {
      const found = await listHoneypots(this.signal);
      this.#table.hidden = !found.length;
      renew(this.#rows, ...found.map((one) => this.#row(one)));
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {Honeypot} honeypot */
  #row({ project, name, person, review_state, made }) {
    const figures = [1, 2, 3, 4].map(() => h("td", {}, "…"));
    scoreHoneypot(project).then(
      (score) => told(score).forEach((text, k) => figures[k]?.replaceChildren(text)),
      (error) => {
        for (const figure of figures) figure.replaceChildren("–");
        sayError(error);
      },
    );
    const when = h("span", { class: "muted" }, ` ${ago(made, Date.now() / 1000)} `);
    const effort = h("a", { href: `/api/projects/${project}/effort.csv`, download: "" }, "Table");
    effort.setAttribute("aria-label", `Table of effort of ${name}`);
    return h(
      "tr",
      {},
      h("th", { scope: "row" }, person ?? "nobody"),
      h(
        "td",
        {},
        h("a", { href: `/p/${project}`, "data-at": `honeypot:${project}` }, name),
        when,
        stateChip(review_state),
      ),
      ...figures,
      h("td", {}, effort),
    );
  }

  async #slip() {
    try {
      const made = await slipHoneypot(this.#sample.value, { person: this.#person.value, name: this.#name.value });
      say(`${made.name} is in the inbox of ${made.person}`, { kind: "good" });
      this.#name.value = "";
      this.#load();
    } catch (error) {
      sayError(error);
    }
  }
}

/** @param {HoneypotScore} score */
function told({ found, extra, mean_iou, same_category, objects }) {
  const right = found ? `${same_category} of ${found}` : "–";
  return [`${found} of ${objects.length}`, String(extra), mean_iou === null ? "–" : mean_iou.toFixed(2), right];
}
