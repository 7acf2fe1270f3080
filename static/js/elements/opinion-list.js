/** Second opinions: independent projects of the same recording, and a button to ask for another. */

import { askOpinion, listNames, listOpinions } from "../api.js";
import { h, LiveElement, renew } from "../dom.js";
import { Answers } from "../lib/answers.js";
import { counted } from "../lib/format.js";
import { live } from "../live.js";
import { go } from "../router.js";
import { stateChip } from "../state-chip.js";
import { say, sayError } from "./toasts.js";

/** @typedef {import("../api-types").Opinion} Opinion */

const WHAT =
  "Another person annotates a copy of this recording that starts without objects; then both are compared object by object.";

export class OpinionList extends LiveElement {
  project = "";
  #answers = new Answers();
  #list = h("ul", { class: "plain stack" });
  #person = h("select", { "aria-label": "Who gives the second opinion" });
  #ask = h("button", { type: "button" }, "Ask for a second opinion");

  connected() {
    const { signal } = this;
    this.replaceChildren(
      h(
        "section",
        { class: "card stack", "aria-label": "Second opinions" },
        h("h2", {}, "Second opinions"),
        h("p", { class: "muted" }, WHAT),
        this.#list,
        h("div", { class: "row" }, this.#person, this.#ask),
      ),
    );
    this.#ask.addEventListener("click", () => this.#send(), { signal });
    live.addEventListener("projects", () => this.#load(), { signal });
    listNames(this.project).then((names) => {
      this.#person.hidden = !names.length;
      this.#person.replaceChildren(
        h("option", { value: "" }, "nobody yet"),
        ...names.map((name) => h("option", { value: name }, name)),
      );
    }, sayError);
    this.#load();
  }

  async #load() {
    try {
      await this.#answers.take(listOpinions(this.project, this.signal), (opinions) =>
        renew(this.#list, ...opinions.map((opinion) => this.#line(opinion))),
      );
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {Opinion} opinion */
  #line({ project, name, assignee, review_state, objects }) {
    const compare = h("a", { class: "button", href: `/p/${this.project}/agreement?other=${project}` }, "Compare");
    compare.setAttribute("aria-label", `Compare with ${name}`);
    compare.dataset.at = `compare:${project}`;
    return h(
      "li",
      { class: "row" },
      h("a", { href: `/p/${project}`, "data-at": `opinion:${project}` }, name),
      stateChip(review_state),
      assignee ? h("span", { class: "chip", title: "assigned to" }, `@${assignee}`) : "",
      h("span", { class: "muted" }, counted(objects, "object")),
      compare,
    );
  }

  async #send() {
    this.#ask.disabled = true;
    try {
      const made = await askOpinion(this.project, this.#person.value || null);
      const hint = made.assignee ? `It is in the inbox of ${made.assignee}.` : "";
      say(`${made.name} is made`, { kind: "good", hint, offer: { text: "Open it", run: () => go(`/p/${made.id}`) } });
      this.#load();
    } catch (error) {
      sayError(error);
    }
    this.#ask.disabled = false;
  }
}
