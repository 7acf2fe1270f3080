/** Members of a project: visible to everybody, or only to its owner and the listed people. Changes apply at once. */

import { getMembers, setMembers } from "../api.js";
import { h, icon, LiveElement, renew } from "../dom.js";
import { Answers } from "../lib/answers.js";
import { live } from "../live.js";
import { say, sayError } from "./toasts.js";

/** @typedef {import("../api-types").ProjectMembers} Members */

export class MemberList extends LiveElement {
  project = "";
  #answers = new Answers();
  #name = h("input");
  /** @type {Promise<void>} */
  #turn = Promise.resolve();

  connected() {
    live.addEventListener("project", () => this.#load(), { signal: this.signal });
    this.#load();
  }

  async #load() {
    try {
      await this.#answers.take(getMembers(this.project, this.signal), (now) => this.#draw(now));
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {Members} now */
  #draw(now) {
    this.hidden = alone(now);
    const body = now.may_change ? this.#choices(now) : [h("p", {}, `${seenBy(now)}.`)];
    const title = h("h2", {}, "Who sees this project");
    renew(this, h("section", { class: "card stack", "aria-label": title.textContent }, title, ...body));
  }

  /** @param {Members} now */
  #choices(now) {
    /** @param {boolean} members_only @param {string} text */
    const choice = (members_only, text) => {
      const radio = h("input", { type: "radio", name: "who-sees", "data-at": `who:${members_only}` });
      radio.checked = now.members_only === members_only;
      radio.addEventListener("change", () => this.#change((members) => ({ members_only, members })));
      return h("label", { class: "choice" }, radio, text);
    };
    const fields = h(
      "fieldset",
      { class: "choices" },
      h("legend", {}, now.owner ? `Its owner ${now.owner} and admins always do` : "Admins always do"),
      choice(false, "Everybody who may sign in"),
      choice(true, "Only these people"),
    );
    return now.members_only ? [fields, this.#list(now.members), this.#form(now)] : [fields];
  }

  /** @param {string[]} names */
  #list(names) {
    if (!names.length) return h("p", { class: "muted" }, "No members yet.");
    return h("ul", { class: "plain", "aria-label": "Members" }, ...names.map((name) => this.#member(name)));
  }

  /** @param {string} name */
  #member(name) {
    const remove = h("button", { type: "button", class: "quiet danger" }, icon("trash"), "Remove");
    remove.setAttribute("aria-label", `Remove ${name}`);
    remove.dataset.at = `member:${name}`;
    remove.addEventListener("click", () => this.#change((members) => kept(members.filter((other) => other !== name))));
    return h("li", {}, h("div", { class: "row" }, h("span", {}, name), remove));
  }

  /** @param {Members} now */
  #form({ accounts, members }) {
    const others = accounts.filter((name) => !members.includes(name));
    const { value } = this.#name; // keep what is being typed
    this.#name = h("input", { required: true, list: "others", autocomplete: "off", "data-at": "member:", value });
    const form = h(
      "form",
      { class: "row named" },
      h("label", {}, "Name", this.#name),
      h("datalist", { id: "others" }, ...others.map((other) => h("option", { value: other }))),
      h("button", { type: "submit" }, icon("plus"), "Add"),
    );
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      const name = this.#name.value.trim();
      this.#change((members) => kept([...members, name])).then((done) => done && (this.#name.value = ""));
    });
    return form;
  }

  /**
   * Apply changes one at a time, each to the server's current members; a refused change is reverted on screen.
   * @param {(members: string[]) => import("../api-types").MembersIn} edit
   * @returns {Promise<boolean>} whether it succeeded
   */
  #change(edit) {
    const done = this.#turn.then(async () => {
      const { members } = await getMembers(this.project);
      const now = await setMembers(this.project, edit(members));
      say(seenBy(now), { kind: "good" });
      this.#draw(now);
      return true;
    });
    const said = done.catch((error) => (sayError(error), this.#load(), false));
    this.#turn = said.then(() => {});
    return said;
  }
}

/** @param {string[]} members @returns {import("../api-types").MembersIn} */
const kept = (members) => ({ members_only: true, members });

/** Whether there is no owner or account, so that access cannot be restricted. @param {Members} now */
function alone({ may_change, members_only, owner, accounts }) {
  return may_change && !members_only && owner === null && !accounts.length;
}

/** @param {Members} now */
function seenBy({ members_only, owner, members }) {
  if (!members_only) return "Everybody who may sign in sees it";
  const names = [...(owner ? [owner] : []), ...members];
  return names.length ? `Only ${names.join(", ")} and admins see it` : "Only admins see it";
}
