/**
 * People page: accounts, which an admin adds, changes and removes; the user's own password; and the seats that run jobs. For
 * others it is the page of their own account.
 */

import { addAccount, changeAccount, changePassword, getSystem, listAccounts, removeAccount } from "../api.js";
import { h, icon, LiveElement } from "../dom.js";
import { AuditRecord } from "../elements/audit-record.js";
import { HoneypotList } from "../elements/honeypot-list.js";
import { SeatList } from "../elements/seat-list.js";
import { say, sayError } from "../elements/toasts.js";
import { Answers } from "../lib/answers.js";
import { ago } from "../lib/format.js";

/** @typedef {import("../api-types").AccountInfo} AccountInfo */
/** @typedef {import("../api-types").SystemInfo} SystemInfo */

const ROLES = /** @type {const} */ ([
  ["annotator", "clicks and names objects, starts runs, comments"],
  ["reviewer", "does that too; accepts, rejects and corrects results, approves a project"],
  ["admin", "does that too; imports from this machine, deletes projects, manages accounts"],
]);
const SHORTEST = 10;

export class PeoplePage extends LiveElement {
  #answers = new Answers();
  #title = h("h1");
  #own = h("section", { class: "card stack", hidden: true });
  #all = h("section", { class: "card stack", hidden: true });
  #record = h("section", { class: "card stack", hidden: true });
  #honeypots = h("section", { class: "card stack", hidden: true });
  #seats = h("section", { class: "card stack", hidden: true });

  connected() {
    this.replaceChildren(
      h(
        "div",
        { class: "page people" },
        h("header", {}, this.#title, h("a", { class: "button quiet", href: "/webhooks" }, "Webhooks")),
        this.#all,
        this.#own,
        this.#honeypots,
        this.#seats,
        this.#record,
      ),
    );
    getSystem().then((system) => this.#draw(system), sayError);
  }

  /** @param {SystemInfo} system */
  #draw({ account, role }) {
    this.#title.textContent = role === "admin" ? "People" : "Your account";
    this.#own.hidden = !account;
    this.#own.replaceChildren(h("h2", {}, "Your own password"), this.#passwordForm());
    this.#all.hidden = role !== "admin";
    this.#record.hidden = role !== "admin";
    this.#record.replaceChildren(...(role === "admin" ? [new AuditRecord()] : []));
    this.#honeypots.hidden = role !== "admin";
    this.#honeypots.replaceChildren(...(role === "admin" ? [new HoneypotList()] : []));
    this.#seats.hidden = role !== "admin";
    this.#seats.replaceChildren(...(role === "admin" ? [new SeatList()] : []));
    if (role === "admin") this.#load(account);
  }

  /** @param {boolean} account whether the user has an account */
  async #load(account) {
    try {
      await this.#answers.take(listAccounts(), (accounts) =>
        this.#all.replaceChildren(
          h("h2", {}, "Accounts"),
          account ? "" : h("p", { class: "muted" }, ALONE),
          accounts.length ? this.#table(accounts) : h("p", {}, "Nobody has an account yet."),
          h("h3", {}, "Add somebody"),
          h("dl", { class: "facts" }, ...ROLES.flatMap(([name, may]) => [h("dt", {}, name), h("dd", {}, may)])),
          this.#addForm(() => this.#load(account)),
        ),
      );
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {AccountInfo[]} accounts */
  #table(accounts) {
    const titles = ["Name", "Role", "Last seen", ""].map((text) => h("th", { scope: "col" }, text));
    const rows = accounts.map((account) => this.#row(account));
    return h("table", {}, h("thead", {}, h("tr", {}, ...titles)), h("tbody", {}, ...rows));
  }

  /** @param {AccountInfo} account */
  #row(account) {
    const { name, role, used, you } = account;
    const select = roleSelect(`Role of ${name}`, role);
    select.addEventListener("change", () =>
      this.#change(changeAccount(name, { role: roleOf(select) }), `${name} is ${select.value} now`),
    );
    const reset = h("button", { type: "button", class: "quiet" }, "New password…");
    reset.addEventListener("click", () => this.#reset(name));
    const remove = h("button", { type: "button", class: "quiet danger" }, icon("trash"), "Remove");
    remove.setAttribute("aria-label", `Remove ${name}`);
    remove.addEventListener("click", () => this.#remove(name));
    return h(
      "tr",
      {},
      h("th", { scope: "row" }, name, you ? h("span", { class: "muted" }, " (you)") : ""),
      h("td", {}, select),
      h("td", { class: "muted" }, used === null ? "not signed in" : ago(used, Date.now() / 1000)),
      h("td", {}, h("div", { class: "row" }, reset, remove)),
    );
  }

  /** @param {() => void} done */
  #addForm(done) {
    const name = h("input", {
      required: true,
      maxLength: 40,
      autocomplete: "off",
      pattern: "[A-Za-z0-9][A-Za-z0-9._\\-]*",
    });
    const role = roleSelect("", "annotator");
    const password = passwordInput("new-password");
    const form = h(
      "form",
      { class: "row form" },
      h("label", {}, "Name", name),
      h("label", {}, "Role", role),
      h("label", {}, `Password, at least ${SHORTEST} characters`, password),
      h("button", { type: "submit", class: "primary" }, icon("plus"), "Add"),
    );
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      const account = { name: name.value, role: roleOf(role), password: password.value };
      addAccount(account).then(() => (say(`${name.value} may sign in now`, { kind: "good" }), done()), sayError);
    });
    return form;
  }

  #passwordForm() {
    const [old, fresh] = [passwordInput("current-password"), passwordInput("new-password")];
    old.minLength = 1;
    const form = h(
      "form",
      { class: "row form" },
      h("label", {}, "Old password", old),
      h("label", {}, `New password, at least ${SHORTEST} characters`, fresh),
      h("button", { type: "submit" }, "Change it"),
    );
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      changePassword(old.value, fresh.value).then(
        () => (form.reset(), say("Your password is changed; other sessions of yours have ended", { kind: "good" })),
        sayError,
      );
    });
    return form;
  }

  /** @param {string} name */
  async #reset(name) {
    const password = await askForPassword(name);
    if (password)
      this.#change(changeAccount(name, { password }), `${name} has a new password; sessions of theirs have ended`);
  }

  /** @param {string} name */
  #remove(name) {
    if (!confirm(`Remove the account ${name}? What ${name} did stays in the history.`)) return;
    this.#change(removeAccount(name), `${name} is removed`);
  }

  /**
   * @param {Promise<unknown>} change
   * @param {string} done
   */
  async #change(change, done) {
    await change.then(() => say(done, { kind: "good" }), sayError);
    getSystem().then((system) => this.#draw(system), sayError);
  }
}

const ALONE =
  "Alone on this machine nobody needs an account: the printed address signs you in. Accounts are for others, once the server " +
  "is started with --host or --name.";

/**
 * @param {string} label
 * @param {string} chosen
 */
function roleSelect(label, chosen) {
  const options = ROLES.map(([value, text]) => h("option", { value, selected: value === chosen, title: text }, value));
  const select = h("select", {}, ...options);
  if (label) select.setAttribute("aria-label", label);
  return select;
}

/** @param {HTMLSelectElement} select */
function roleOf(select) {
  return /** @type {AccountInfo["role"]} */ (select.value);
}

/** @param {"current-password" | "new-password"} kind */
function passwordInput(kind) {
  return h("input", { type: "password", required: true, minLength: SHORTEST, maxLength: 1000, autocomplete: kind });
}

/**
 * @param {string} name
 * @returns {Promise<string | null>}
 */
function askForPassword(name) {
  return new Promise((resolve) => {
    const field = passwordInput("new-password");
    const dialog = h(
      "dialog",
      { class: "ask", "aria-label": `New password of ${name}` },
      h("h2", {}, `New password of ${name}`),
      h(
        "form",
        { method: "dialog", class: "stack" },
        h("label", {}, `At least ${SHORTEST} characters; give it to ${name} yourself`, field),
        h(
          "div",
          { class: "row" },
          h("button", { type: "submit", class: "primary", value: "ok" }, "Set it"),
          h("button", { type: "submit", value: "", formNoValidate: true }, "Cancel"),
        ),
      ),
    );
    dialog.addEventListener("close", () => {
      dialog.remove();
      resolve(dialog.returnValue === "ok" ? field.value : null);
    });
    document.body.append(dialog);
    dialog.showModal();
  });
}
