/** Inbox page of the user: projects sent back, projects assigned by state, objects assigned, and comments with mentions. */

import { assignObject, getInbox, resolveComment } from "../api.js";
import { h, LiveElement, renew } from "../dom.js";
import { stateChip } from "../state-chip.js";
import { sayError } from "../elements/toasts.js";
import { Answers } from "../lib/answers.js";
import { ago } from "../lib/format.js";
import { live } from "../live.js";

/** @typedef {import("../api-types").Inbox} Inbox */
/** @typedef {import("../api-types").InboxProject} InboxProject */
/** @typedef {import("../api-types").InboxObject} InboxObject */
/** @typedef {import("../api-types").InboxMention} InboxMention */

const STATES = /** @type {const} */ (["in review", "ready", "draft", "changes requested"]);

/** @type {string[]} */
const REVIEWED = ["ready", "in review"]; // states in which objects open on the review page

export class InboxPage extends LiveElement {
  #answers = new Answers();
  #body = h("div", { class: "page stack" });

  connected() {
    this.replaceChildren(this.#body);
    live.addEventListener("projects", () => this.#load(), { signal: this.signal });
    document.title = "Inbox · r2c2r";
    this.#load();
  }

  async #load() {
    try {
      await this.#answers.take(getInbox(this.signal), (inbox) => this.#draw(inbox));
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {Inbox} inbox */
  #draw({ returned, assigned, objects, mentions }) {
    const states = STATES.map((state) => assigned.filter((one) => one.review_state === state));
    const groups = [
      group("Sent back to you", returned.map(projectLine)),
      group(
        "Comments that mention you",
        mentions.map((one) => this.#mention(one)),
      ),
      ...projectsOf(objects).map((some) =>
        group(
          `Objects assigned to you: ${some[0]?.project_name}`,
          some.map((one) => this.#object(one)),
        ),
      ),
      ...states.map((some, k) => group(`Assigned to you: ${STATES[k]}`, some.map(projectLine))),
    ].filter((one) => one !== null);
    const none = h("p", { class: "muted" }, "Your inbox is empty.");
    const how =
      "Projects are assigned on their overview, objects in Annotate; @ and a name in a comment puts it into that person's inbox.";
    renew(this.#body, h("h1", {}, "Inbox"), ...(groups.length ? groups : [none]), h("p", { class: "muted" }, how));
  }

  /** @param {InboxObject} object */
  #object({ project, object, name, category, review_state, at }) {
    const done = h("button", { type: "button", class: "quiet", "data-at": `done:${object}` }, "Done");
    done.setAttribute("aria-label", `Done: ${name}`);
    done.title = "Removes it from your inbox: it is then assigned to nobody";
    done.addEventListener("click", () => assignObject(project, object, null).then(() => this.#load(), sayError));
    const page = REVIEWED.includes(review_state) ? "review" : "annotate";
    return h(
      "li",
      { class: "row" },
      h(
        "div",
        { class: "grow" },
        h("a", { href: `/p/${project}/${page}?object=${object}`, "data-at": `object:${object}` }, name),
        h("div", { class: "muted" }, `${category} · changed ${ago(at, Date.now() / 1000)}`),
      ),
      done,
    );
  }

  /** @param {InboxMention} mention */
  #mention({ project, project_name, comment }) {
    const resolve = h("button", { type: "button", class: "quiet", "data-at": `resolve:${comment.id}` }, "Resolve");
    resolve.setAttribute("aria-label", `Resolve: ${comment.text}`);
    resolve.addEventListener("click", () =>
      resolveComment(project, comment.id, true).then(() => this.#load(), sayError),
    );
    const about = `${project_name} · ${comment.who} · ${ago(comment.at, Date.now() / 1000)}`;
    return h(
      "li",
      { class: "row" },
      h(
        "div",
        { class: "grow" },
        h("a", { href: placeOf(project, comment), "data-at": `comment:${comment.id}` }, comment.text),
        h("div", { class: "muted" }, about),
      ),
      resolve,
    );
  }
}

/**
 * @param {string} title
 * @param {HTMLElement[]} lines
 */
function group(title, lines) {
  if (!lines.length) return null;
  return h(
    "section",
    { class: "card stack", "aria-label": title },
    h("h2", {}, title),
    h("ul", { class: "plain stack" }, ...lines),
  );
}

/** Objects grouped by project, in their order. @param {InboxObject[]} objects */
function projectsOf(objects) {
  const projects = [...new Set(objects.map(({ project }) => project))];
  return projects.map((project) => objects.filter((one) => one.project === project));
}

/** @param {InboxProject} project */
function projectLine({ id, name, review_state, who, at, reason }) {
  const when = ago(at, Date.now() / 1000);
  return h(
    "li",
    {},
    h("div", { class: "row" }, h("a", { href: `/p/${id}`, "data-at": `project:${id}` }, name), stateChip(review_state)),
    reason ? h("p", { class: "said" }, reason) : "",
    h("div", { class: "muted" }, who ? `${who} · ${when}` : `changed ${when}`),
  );
}

/**
 * Address of the page that shows a comment in its context.
 * @param {string} project
 * @param {InboxMention["comment"]} comment
 */
function placeOf(project, { object, frame }) {
  const chosen = object === null ? "" : `object=${object}`;
  return frame === null ? `/p/${project}/review?${chosen}` : `/p/${project}/annotate?frame=${frame}&${chosen}`;
}
