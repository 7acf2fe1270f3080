/** The 3D view: viser in an iframe of our own origin; the bundle's own 3D page, or a picture, and a retry when it is down. */

import { ApiError, openViewer, showInViewer } from "../api.js";
import { h, LiveElement } from "../dom.js";
import { sayError } from "./toasts.js";

/** @typedef {import("../api-types").ViewerShow} ViewerShow */
/** @typedef {import("../api-types").ViewerShown} ViewerShown */

export class ViewerFrame extends LiveElement {
  #project = "";
  /** @type {Partial<ViewerShow>} */
  #wanted = {};
  #opened = false;
  /** @type {Promise<void>} one request after the other, so that the last wish wins */
  #queue = Promise.resolve();

  /**
   * @param {string} project
   * @param {Partial<ViewerShow>} what
   */
  async open(project, what) {
    this.#project = project;
    this.#wanted = what;
    this.replaceChildren(h("div", { class: "fallback muted" }, "Opening the 3D view…"));
    try {
      const session = await openViewer(project);
      if (session.state === "down" || !session.url) return this.#down(session.message, session);
      const dark = getComputedStyle(document.documentElement).colorScheme === "dark" || isDark() ? "?darkMode" : "";
      this.replaceChildren(h("iframe", { src: session.url + dark, title: "3D view of the project" }));
      this.#opened = true;
      this.show(this.#wanted); // it may have changed while the view opened
    } catch (error) {
      this.#down(error instanceof Error ? error.message : String(error), null);
    }
  }

  /** @param {Partial<ViewerShow>} what */
  show(what) {
    this.#wanted = what;
    if (!this.#opened) return;
    this.#queue = this.#queue.then(async () => {
      if (this.#wanted !== what) return;
      try {
        this.emit("shown", await showInViewer(this.#project, what));
      } catch (error) {
        if (error instanceof ApiError && error.status === 503) this.#down(error.message, null);
        else if (error instanceof ApiError && error.kind === "not-ready") this.emit("not-ready", error.message);
        else sayError(error);
      }
    });
  }

  /**
   * @param {string} message
   * @param {{ fallback_page: string | null, fallback_image: string | null } | null} instead
   */
  #down(message, instead) {
    this.#opened = false;
    const retry = h("button", { type: "button", onClick: () => this.open(this.#project, this.#wanted) }, "Try again");
    const said = h("p", {}, `The 3D view is not there: ${message}`);
    if (instead?.fallback_page) {
      const page = h("iframe", {
        src: instead.fallback_page,
        title: "The newest bundle's scene",
        sandbox: "allow-scripts",
      });
      this.replaceChildren(h("div", { class: "fallback-bar" }, said, retry), page);
      return;
    }
    const image = instead?.fallback_image;
    const picture = image ? h("img", { src: image, alt: "The scene, closed and open" }) : null;
    this.replaceChildren(h("div", { class: "fallback" }, picture, said, retry));
  }
}

function isDark() {
  const theme = document.documentElement.dataset.theme;
  return theme ? theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
}
