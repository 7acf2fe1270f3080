/** Webhooks page: addresses notified of runs and review states, with their responses; admins see all, others their own. */

import {
  addWebhook,
  getSystem,
  listDeliveries,
  listProjects,
  listWebhooks,
  removeWebhook,
  testWebhook,
} from "../api.js";
import { h, icon, LiveElement, renew } from "../dom.js";
import { say, sayError } from "../elements/toasts.js";
import { Answers } from "../lib/answers.js";
import { ago, counted } from "../lib/format.js";

/** @typedef {import("../api-types").Webhook} Webhook */
/** @typedef {import("../api-types").Delivery} Delivery */

const LOOK_MS = 2000; // polling: no event is sent for a delivery

export class WebhooksPage extends LiveElement {
  #answers = new Answers();
  #details = new Answers();
  #count = h("p", { role: "status" });
  #rows = h("tbody", {});
  #table = tableOf(["Address", "Told of", "Owner", "Last answer", ""], this.#rows);
  #secret = h("section", { class: "card stack", hidden: true, "aria-label": "The secret" });
  #deliveries = h("section", { class: "card stack", hidden: true, "aria-label": "Answers" });
  #add = h("section", { class: "card stack" });
  /** @type {Webhook | null} webhook whose responses are shown */
  #shown = null;

  connected() {
    this.replaceChildren(
      h(
        "div",
        { class: "page people" },
        h("header", {}, h("h1", {}, "Webhooks"), h("a", { class: "button quiet", href: "/people" }, "People")),
        this.#secret,
        h("section", { class: "card stack" }, h("p", {}, WHAT), this.#count, this.#table),
        this.#deliveries,
        this.#add,
      ),
    );
    const timer = setInterval(() => this.#load(), LOOK_MS);
    this.signal.addEventListener("abort", () => clearInterval(timer));
    this.#load();
    this.#drawForm().catch(sayError);
  }

  async #load() {
    try {
      await this.#answers.take(listWebhooks(this.signal), (webhooks) => this.#show(webhooks));
      if (this.#shown)
        await this.#details.take(listDeliveries(this.#shown.id, this.signal), (found) => this.#showAnswers(found));
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {Webhook[]} webhooks */
  #show(webhooks) {
    const text = webhooks.length ? counted(webhooks.length, "webhook") : "None yet.";
    if (this.#count.textContent !== text) this.#count.textContent = text;
    this.#table.hidden = !webhooks.length;
    this.#shown = webhooks.find(({ id }) => id === this.#shown?.id) ?? null;
    this.#deliveries.hidden = !this.#shown;
    renew(this.#rows, ...webhooks.map((webhook) => this.#row(webhook)));
  }

  /** @param {Webhook} webhook */
  #row(webhook) {
    const { id, url, project, project_name, owner, answer, delivered } = webhook;
    const open = this.#shown?.id === id;
    const answers = action("Answers", `Answers of ${url}`, `answers:${id}`, () => this.#open(open ? null : webhook));
    answers.setAttribute("aria-expanded", String(open));
    const test = action("Send a test", `Send a test to ${url}`, `test:${id}`, () => this.#test(webhook));
    const remove = action("Remove", `Remove ${url}`, `remove:${id}`, () => this.#remove(webhook));
    remove.classList.add("danger");
    remove.prepend(icon("trash"));
    const last = delivered === null ? "" : `, delivered ${ago(delivered, Date.now() / 1000)}`;
    return h(
      "tr",
      {},
      h("th", { scope: "row" }, url),
      h("td", {}, project ? h("a", { href: `/p/${project}` }, project_name) : "every project"),
      h("td", { class: "muted" }, owner || "who started the server"),
      h("td", { class: "muted" }, answer ? answer + last : "nothing posted yet"),
      h("td", {}, h("div", { class: "row" }, answers, test, remove)),
    );
  }

  /** @param {Webhook | null} webhook */
  #open(webhook) {
    this.#shown = webhook;
    this.#deliveries.hidden = true;
    this.#load();
  }

  /** @param {Delivery[]} found */
  #showAnswers(found) {
    if (!this.#shown) return;
    const rows = found.map(({ event, created, attempts, due, delivered, answer }) =>
      h(
        "tr",
        {},
        h("td", { class: "muted" }, ago(created, Date.now() / 1000)),
        h("td", {}, event),
        h("td", {}, attempts ? answer || "on its way" : "waits"),
        h("td", { class: "muted" }, delivered !== null ? "delivered" : next(due, attempts)),
      ),
    );
    this.#deliveries.hidden = false;
    this.#deliveries.replaceChildren(
      h("h2", {}, `Answers of ${this.#shown.url}`),
      rows.length
        ? tableOf(["When", "What", "Answer", ""], h("tbody", {}, ...rows))
        : h("p", {}, "Nothing posted yet."),
    );
  }

  /** @param {Webhook} webhook */
  async #test(webhook) {
    try {
      await testWebhook(webhook.id);
      say(`A test is on its way to ${webhook.url}`, { kind: "good" });
      this.#open(webhook);
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {Webhook} webhook */
  #remove({ id, url }) {
    if (!confirm(`Remove ${url}? Pending messages are not sent.`)) return;
    this.#secret.hidden = true;
    removeWebhook(id).then(() => (say(`${url} is removed`, { kind: "good" }), this.#load()), sayError);
  }

  async #drawForm() {
    const [{ role }, projects] = await Promise.all([getSystem(), listProjects(this.signal)]);
    const url = h("input", { type: "url", required: true, maxLength: 500, placeholder: "https://lab.example/r2c2r" });
    const all = role === "admin" ? [h("option", { value: "" }, "every project")] : [];
    const of = h("select", {}, ...all, ...projects.map(({ id, name }) => h("option", { value: id }, name)));
    const form = h(
      "form",
      { class: "row form" },
      h("label", {}, "Address", url),
      h("label", {}, "Told of", of),
      h("button", { type: "submit", class: "primary" }, icon("plus"), "Add"),
    );
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      addWebhook({ url: url.value, project: of.value || null }).then((made) => {
        form.reset();
        this.#tell(made.url, made.secret);
        this.#load();
      }, sayError);
    });
    this.#add.replaceChildren(h("h2", {}, "Add an address"), form);
  }

  /** @param {string} url @param {string} secret */
  #tell(url, secret) {
    const field = h("input", { readOnly: true, value: secret, size: 48 });
    const copy = h("button", { type: "button" }, "Copy");
    copy.addEventListener("click", () =>
      navigator.clipboard.writeText(secret).then(() => say("Copied", { kind: "good" }), sayError),
    );
    const seen = h("button", { type: "button", class: "quiet" }, "I have it");
    seen.addEventListener("click", () => (this.#secret.hidden = true));
    this.#secret.hidden = false;
    this.#secret.replaceChildren(
      h("h2", {}, `Secret of ${url}`),
      h("p", {}, "It signs every message to this address, and is shown only once."),
      h("div", { class: "row form" }, h("label", {}, "Secret", field), copy, seen),
    );
    field.focus();
    field.select();
  }
}

const WHAT =
  "r2c2r posts to these addresses when a run ends and when a project's review state changes, signed with the secret of each. It retries " +
  "for two days until the address answers with a 2xx.";

/**
 * @param {string[]} titles
 * @param {HTMLElement} rows
 */
function tableOf(titles, rows) {
  return h("table", {}, h("thead", {}, h("tr", {}, ...titles.map((text) => h("th", { scope: "col" }, text)))), rows);
}

/**
 * @param {string} text
 * @param {string} label
 * @param {string} at
 * @param {() => void} act
 */
function action(text, label, at, act) {
  const button = h("button", { type: "button", class: "quiet" }, text);
  button.setAttribute("aria-label", label);
  button.dataset.at = at;
  button.addEventListener("click", act);
  return button;
}

/**
 * Text for the time of the next attempt.
 * @param {number | null} due
 * @param {number} attempts
 */
function next(due, attempts) {
  if (due === null) return "given up";
  const minutes = Math.ceil((due - Date.now() / 1000) / 60);
  return attempts && minutes > 0 ? `again in ${minutes} min` : "";
}
