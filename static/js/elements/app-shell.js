/** Header, navigation, the current page, messages and help. */

import { getProject } from "../api.js";
import { h, icon, isTyping, LiveElement } from "../dom.js";
import { actionOf } from "../lib/keymap.js";
import { live } from "../live.js";
import { HelpOverlay } from "./help-overlay.js";
import { sayError, Toasts } from "./toasts.js";
import { WhoIsIn } from "./who.js";

/** @typedef {import("../router.js").Route} Route */
/** @typedef {HTMLElement & { project?: string, query?: URLSearchParams }} PageElement */

const TABS = [
  ["overview", "Overview"],
  ["annotate", "Annotate"],
  ["run", "Run"],
  ["review", "Review"],
  ["download", "Download"],
];

export class AppShell extends LiveElement {
  #where = h("span", { class: "where muted" });
  #tabs = h("nav", { class: "tabs", "aria-label": "Project" });
  #online = h("span", { class: "chip", hidden: true }, "reconnecting…");
  #main = h("main", { id: "main", tabIndex: -1 });
  #help = new HelpOverlay();
  /** @type {Route | null} */
  #route = null;

  connected() {
    const theme = h("button", { class: "quiet", type: "button", "aria-label": "Dark or light", onClick: switchTheme });
    theme.append(icon("theme"));
    const help = h("button", { class: "quiet", type: "button", "aria-label": "Keyboard and mouse help" });
    help.append(icon("help"));
    help.addEventListener("click", () => this.#help.toggle());
    const logo = h("img", { src: "/static/icons/logo.svg", alt: "" });
    this.replaceChildren(
      h(
        "header",
        { class: "topbar" },
        h("a", { class: "brand", href: "/" }, logo, "r2c2r"),
        this.#where,
        this.#tabs,
        h("span", { class: "spring" }),
        this.#online,
        new WhoIsIn(),
        help,
        theme,
      ),
      this.#main,
      new Toasts(),
      this.#help,
    );
    document.documentElement.dataset.theme = localStorage.getItem("theme") ?? "";
    live.addEventListener("offline", () => (this.#online.hidden = false), { signal: this.signal });
    live.addEventListener("online", () => (this.#online.hidden = true), { signal: this.signal });
    document.addEventListener("keydown", (event) => this.#onKey(event), { signal: this.signal });
  }

  /** @param {Route} route */
  show(route) {
    const same = this.#route?.page === route.page && this.#route.project === route.project;
    this.#route = route;
    live.watch(route.project);
    if (same) return;
    this.#drawTabs(route);
    const page = /** @type {PageElement} */ (document.createElement(`r2c2r-${route.page}`));
    if (route.project) page.project = route.project;
    page.query = route.query;
    this.#main.replaceChildren(page);
  }

  /** @param {Route} route */
  #drawTabs(route) {
    this.#tabs.hidden = route.project === null;
    this.#where.textContent = "";
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
    getProject(route.project, this.signal).then((project) => {
      if (this.#route?.project !== project.id) return;
      this.#where.textContent = project.name;
      document.title = `${project.name} · r2c2r`;
    }, sayError);
  }

  /** @param {KeyboardEvent} event */
  #onKey(event) {
    if (isTyping(event) || actionOf(event, "all") !== "help") return;
    event.preventDefault();
    this.#help.toggle();
  }
}

function switchTheme() {
  const root = document.documentElement;
  const dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  root.dataset.theme = dark ? "light" : "dark";
  localStorage.setItem("theme", root.dataset.theme);
}
