/** Audit log of sign-ins, refusals and account changes: newest entries first, older ones on demand. */

import { listAudit } from "../api.js";
import { h, LiveElement } from "../dom.js";
import { ago, counted } from "../lib/format.js";
import { sayError } from "./toasts.js";

/** @typedef {import("../api-types").AuditEntry} AuditEntry */

export class AuditRecord extends LiveElement {
  #rows = h("tbody", {});
  #older = h("button", { type: "button", onClick: () => this.#load() }, "Show older ones");
  #count = h("p", { class: "muted", role: "status" });
  /** @type {number | null} id of the last entry shown */
  #last = null;

  connected() {
    const titles = ["When", "What", "Account", "By", "From"].map((text) => h("th", { scope: "col" }, text));
    this.replaceChildren(
      h("h2", {}, "Sign-ins and changes"),
      h("table", {}, h("thead", {}, h("tr", {}, ...titles)), this.#rows),
      h("div", { class: "row" }, this.#count, this.#older),
    );
    this.#load();
  }

  async #load() {
    try {
      const { entries, total } = await listAudit(this.#last);
      this.#rows.append(...entries.map(row));
      this.#last = entries.at(-1)?.id ?? this.#last;
      const shown = this.#rows.childElementCount;
      this.#count.textContent = shown < total ? `${shown} of ${total}` : counted(shown, "line");
      this.#older.hidden = !entries.length || shown >= total;
    } catch (error) {
      sayError(error);
    }
  }
}

/** @param {AuditEntry} entry */
function row({ at, action, detail, account, who, client }) {
  const when = h("time", { title: new Date(at * 1000).toLocaleString() }, ago(at, Date.now() / 1000));
  return h(
    "tr",
    {},
    h("td", { class: "muted" }, when),
    h("td", {}, action, detail && h("span", { class: "muted" }, ` ${detail}`)),
    h("td", {}, account || (action === "refused" ? "unknown" : "who started the server")),
    h("td", {}, who),
    h("td", { class: "muted" }, client),
  );
}
