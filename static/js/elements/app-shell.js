/** Header, navigation, the current page, messages and help. */

import { getProject } from "../api.js";
import { detailOf, h, icon, LiveElement } from "../dom.js";
import { isTyping, plainKeys } from "../keyboard.js";
import { fetched } from "../later.js";
import { actionOf, KEYMAP } from "../lib/keymap.js";
import { counted } from "../lib/format.js";
import { live } from "../live.js";
import { outbox } from "../outbox.js";
import { Presence } from "../presence.js";
import { go } from "../router.js";
import { CommandPalette } from "./command-palette.js";
import { HelpOverlay } from "./help-overlay.js";
import { stateChip } from "../state-chip.js";
import { say, sayError, sayWaiting, Toasts } from "./toasts.js";
import { WhoIsIn } from "./who.js";

/** @typedef {import("../router.js").Route} Route */
/** @typedef {import("../lib/commands.js").Command} Command */
/**
 * @typedef {HTMLElement & {
 *   project?: string, query?: URLSearchParams, act?: (action: string) => void, commands?: (typed: string) => Command[],
 * }} PageElement
 */

const TABS = [
  ["overview", "Overview"],
  ["annotate", "Annotate"],
  ["elevation", "Elevation"],
  ["run", "Run"],
  ["review", "Review"],
  ["download", "Download"],
];

export class AppShell extends LiveElement {
  #where = h("span", { class: "where muted" });
  #tabs = h("nav", { class: "tabs", "aria-label": "Project" });
  #state = h("span", { class: "state", hidden: true });
  #online = h("div", { class: "banner", role: "status", hidden: true });
  #main = h("main", { id: "main", tabIndex: -1 });
  #help = new HelpOverlay();
  #commands = new CommandPalette();
  /** @type {Route | null} */
  #route = null;

  connected() {
    const theme = h("button", { class: "quiet", type: "button", "aria-label": "Dark or light", onClick: switchTheme });
    theme.append(icon("theme"));
    const help = h("button", { class: "quiet", type: "button", "aria-label": "Keyboard and mouse help" });
    help.append(icon("help"));
    help.addEventListener("click", () => this.#help.toggle());
    const palette = h(
      "button",
      { class: "quiet palette-button", type: "button", "aria-label": "Commands Ctrl K" },
      h("span", {}, "Commands "),
      h("kbd", {}, "Ctrl K"),
    );
    palette.addEventListener("click", () => this.#openPalette());
    const logo = h("img", { src: "/static/icons/logo.svg", alt: "" });
    this.replaceChildren(
      h(
        "header",
        { class: "topbar" },
        h("a", { class: "brand", href: "/" }, logo, "r2c2r"),
        this.#where,
        this.#state,
        this.#tabs,
        h("span", { class: "spring" }),
        new Presence(),
        new WhoIsIn(),
        palette,
        help,
        theme,
      ),
      this.#online,
      this.#main,
      new Toasts(),
      this.#help,
      this.#commands,
    );
    document.documentElement.dataset.theme = localStorage.getItem("theme") ?? "";
    const { signal } = this;
    for (const type of ["offline", "online"]) live.addEventListener(type, () => this.#drawOnline(), { signal });
    outbox.addEventListener("change", () => this.#drawOnline(), { signal });
    outbox.addEventListener("refused", (event) => sayError(detailOf(event)), { signal });
    window.addEventListener("r2c2r-waits", (event) => sayWaiting(detailOf(event)), { signal });
    live.addEventListener("project", () => this.#route && this.#drawProject(this.#route), { signal });
    live.addEventListener("gone", (event) => this.#leave(detailOf(event)), { signal });
    document.addEventListener("keydown", (event) => this.#onKey(event), { signal });
  }

  /** @param {Route} route */
  show(route) {
    const same = this.#route?.page === route.page && this.#route.project === route.project;
    this.#route = route;
    live.watch(route.project);
    if (same) return;
    this.#drawTabs(route);
    const waiting = fetched(route.page);
    if (!waiting) return this.#enter(route);
    waiting.then(() => this.#route === route && this.#enter(route), sayError);
  }

  /** @param {Route} route */
  #enter(route) {
    const page = /** @type {PageElement} */ (document.createElement(`r2c2r-${route.page}`));
    if (route.project) page.project = route.project;
    page.query = route.query;
    this.#main.replaceChildren(page);
  }

  /** @param {Route} route */
  #drawTabs(route) {
    this.#tabs.hidden = route.project === null;
    this.#where.textContent = "";
    this.#state.hidden = true;
    document.title = "r2c2r";
    if (route.project === null) return;
    const base = `/p/${route.project}`;
    this.#tabs.replaceChildren(
      ...TABS.map(([page, text]) => {
        const link = h("a", { href: page === "overview" ? base : `${base}/${page}` }, text ?? "");
        if (page === route.page) link.setAttribute("aria-current", "page");
        return link;
      }),
    );
    const here = this.#tabs.querySelector("[aria-current]");
    if (here instanceof HTMLElement) this.#tabs.scrollLeft = here.offsetLeft - this.#tabs.offsetLeft; // on a phone, where the tabs scroll
    this.#drawProject(route);
  }

  /** @param {Route} route */
  #drawProject(route) {
    if (route.project === null) return;
    getProject(route.project, this.signal).then((project) => {
      if (this.#route?.project !== project.id) return;
      this.#where.textContent = project.name;
      this.#state.replaceChildren(stateChip(project.review_state));
      this.#state.hidden = false;
      document.title = `${project.name} · r2c2r`;
    }, sayError);
  }

  /**
   * Leave a project that was deleted or is no longer visible to the user: go to the list and show why.
   * @param {{ project: string, why: string }} gone
   */
  #leave({ project, why }) {
    if (this.#route?.project !== project) return;
    const name = this.#where.textContent || "This project";
    go("/");
    say(`${name} ${why}.`, { kind: "bad" });
  }

  /** Draw the banner of a lost connection, with the number of unsent changes; the outbox sends them once the server answers. */
  #drawOnline() {
    const waiting = outbox.stuck
      ? ` ${counted(outbox.waiting, "change")} not stored yet: kept in this browser and sent by ${outbox.waiting === 1 ? "itself" : "themselves"}${outbox.safe ? "" : ", as long as this page stays open"}.`
      : "";
    this.#online.hidden = live.connected && !outbox.stuck;
    this.#online.textContent = live.refusal
      ? `Live updates are off: ${live.refusal}.${waiting}`
      : `The server does not answer; trying again.${waiting}`;
  }

  /** @param {KeyboardEvent} event */
  #onKey(event) {
    const action = actionOf(event, "all", plainKeys());
    if (action === "palette") this.#openPalette();
    else if (action === "help" && !isTyping(event)) this.#help.toggle();
    else return;
    event.preventDefault();
  }

  /** Open the command palette with the page's own commands, its key bindings, the tabs and the global pages. */
  #openPalette() {
    const page = /** @type {PageElement | null} */ (this.#main.firstElementChild);
    const route = this.#route;
    const base = route?.project ? `/p/${route.project}` : "";
    const tabs = base
      ? TABS.map(([name, text]) => ({
          text: `Go to ${text}`,
          run: () => go(name === "overview" ? base : `${base}/${name}`),
        }))
      : [];
    const keys = KEYMAP.filter((binding) => binding.page === route?.page && page?.act).map((binding) => ({
      text: binding.text,
      keys: binding.keys[0],
      run: () => page?.act?.(binding.action),
    }));
    const everywhere = [
      { text: "Go to Projects", run: () => go("/") },
      { text: "Go to Inbox", run: () => go("/inbox") },
      { text: "Go to People", run: () => go("/people") },
      { text: "Go to Templates", run: () => go("/templates") },
      { text: "Go to Webhooks", run: () => go("/webhooks") },
      { text: "Dark or light", run: switchTheme },
      { text: "Keyboard and mouse help", keys: "?", run: () => this.#help.toggle() },
    ];
    this.#commands.open((typed) => [...(page?.commands?.(typed) ?? []), ...keys, ...tabs, ...everywhere]);
  }
}

function switchTheme() {
  const root = document.documentElement;
  const dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  root.dataset.theme = dark ? "light" : "dark";
  localStorage.setItem("theme", root.dataset.theme);
}
