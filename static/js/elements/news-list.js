/** List of other people's changes since the last visit, kept until marked as read. */

import { getNews, markSeen } from "../api.js";
import { h, LiveElement, renew } from "../dom.js";
import { Answers } from "../lib/answers.js";
import { ago, counted } from "../lib/format.js";
import { live } from "../live.js";
import { sayError } from "./toasts.js";

/** @typedef {import("../api-types").News} News */

export class NewsList extends LiveElement {
  project = "";
  #answers = new Answers();

  connected() {
    this.hidden = true;
    for (const type of ["project", "comments", "job"])
      live.addEventListener(type, () => this.#load(), { signal: this.signal });
    this.#load();
  }

  async #load() {
    try {
      await this.#answers.take(getNews(this.project, this.signal), (news) => this.#show(news));
    } catch (error) {
      sayError(error);
    }
  }

  /** Draw the news; on a first visit, everything so far is marked as read. @param {News} news */
  #show(news) {
    this.hidden = !news.entries.length;
    if (news.since === null) markSeen(this.project, news.last).catch(sayError);
    const now = Date.now() / 1000;
    const title = h("h2", {}, "Since you were last here");
    const read = h("button", { type: "button", "data-at": "read" }, "Mark as read");
    read.addEventListener("click", () => this.#read(news.last));
    const all = news.people.reduce((sum, { changes }) => sum + changes, 0);
    const people = news.people.map(({ who, changes }) => `${who} ${counted(changes, "change")}`).join(", ");
    const more = all - news.entries.length;
    renew(
      this,
      h(
        "section",
        { class: "card stack", "aria-label": title.textContent },
        h("div", { class: "row" }, title, h("span", { class: "muted" }, ago(news.since ?? now, now)), read),
        h("p", {}, `${people}.`),
        h(
          "details",
          { open: news.entries.length <= 10 },
          h("summary", {}, counted(all, "change")),
          h("table", {}, h("tbody", {}, ...news.entries.map((entry) => historyRow(entry, now)))),
          more > 0 ? h("p", { class: "muted" }, `and ${more} before`) : "",
        ),
      ),
    );
  }

  /** @param {number} last */
  async #read(last) {
    try {
      await this.#answers.take(markSeen(this.project, last), (news) => this.#show(news));
    } catch (error) {
      sayError(error);
    }
  }
}

/**
 * Row of a project's history.
 * @param {import("../api-types").HistoryEntry} entry
 * @param {number} now
 */
export function historyRow(entry, now) {
  return h(
    "tr",
    {},
    h("td", {}, entry.undone ? h("s", {}, entry.text) : entry.text),
    h("td", { class: "muted" }, entry.who),
    h("td", { class: "muted" }, ago(entry.at, now)),
  );
}
