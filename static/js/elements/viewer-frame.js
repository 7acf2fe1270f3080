/**
 * 3D view: viser in a same-origin iframe, under a veil that says what is waited for or not there yet; when viser is down, the
 * bundle's own 3D page or a picture, and a retry button. Emits "shown" ViewerShown, "dragging" during a drag, "clicked".
 */

import { ApiError, openViewer, showInViewer } from "../api.js";
import { detailOf, h, LiveElement, spinner } from "../dom.js";
import { live } from "../live.js";
import { sayError } from "./toasts.js";

/** @typedef {import("../api-types").ViewerSession} ViewerSession */
/** @typedef {import("../api-types").ViewerShow} ViewerShow */
/** @typedef {import("../api-types").ViewerShown} ViewerShown */

const CAMERA_KEYS = new Set(["w", "a", "s", "d", "q", "e", "arrowleft", "arrowright", "arrowup", "arrowdown", "tab"]);
const CLICK_PX = 4; // a press that moved further was a drag
const LAST_MS = 250; // the end of a drag is emitted after this delay

export class ViewerFrame extends LiveElement {
  #project = "";
  /** @type {Partial<ViewerShow>} */
  #wanted = {};
  #url = "";
  #early = false; // opened before the recording was read, or while the server was away
  #veil = h("div", { class: "veil" });
  #hint = h("p", { class: "muted" });
  #running = false;
  #drawing = false; // whether viser's canvas is there
  #answered = false; // whether the server has shown what was requested last
  /** @type {Promise<void>} serialises requests, so that the last one wins */
  #queue = Promise.resolve();

  connected() {
    const again = (/** @type {Event} */ event) =>
      ((detailOf(event).reset && this.#url) || this.#early) && this.open(this.#project, this.#wanted);
    live.addEventListener("hello", again, { signal: this.signal }); // the server restarted and lost our view
    const ready = () => this.#early && this.open(this.#project, this.#wanted);
    live.addEventListener("project", ready, { signal: this.signal });
    if (!this.#url) this.#wait();
    if (!this.childElementCount) this.replaceChildren(this.#veil);
  }

  /** Show a spinner until the view has what was requested. */
  #wait() {
    this.#answered = false;
    this.#veil.replaceChildren(spinner("Loading the 3D view…"));
    this.#veil.hidden = false;
  }

  /** Take the veil off once the server has answered and viser draws. */
  #lift() {
    this.#answered = true;
    this.#veil.hidden = this.#drawing;
  }

  /**
   * @param {string} project
   * @param {Partial<ViewerShow>} what
   */
  async open(project, what) {
    this.#project = project;
    this.#want(what);
    this.#early = false;
    if (!this.#url) {
      this.#wait();
      this.replaceChildren(this.#veil);
    }
    try {
      const session = await openViewer(project);
      if (!this.isConnected) return; // the user left the page
      if (session.state === "down" || !session.url) return this.#down(session.message, session);
      if (session.url !== this.#url) this.#embed(session.url);
      this.show(this.#wanted); // the request may have changed while the view opened
    } catch (error) {
      if (!this.isConnected) return;
      this.#early = error instanceof ApiError && (error.unreachable || error.kind === "not-ready");
      if (error instanceof ApiError && error.kind === "not-ready") this.#say(error);
      else this.#down(error instanceof Error ? error.message : String(error), null);
    }
  }

  /** Say over the view what is not there yet. @param {ApiError} error */
  #say({ message, hint }) {
    this.#answered = false;
    this.#hint.textContent = this.#running ? "The run is at work on it." : hint;
    this.#veil.replaceChildren(h("p", {}, message), this.#hint);
    this.#veil.hidden = false;
  }

  /** Whether a run is at work on what is not there yet. @param {boolean} running */
  set running(running) {
    this.#running = running;
  }

  /**
   * Request a view. The last request wins, but one with `look` or `camera` is never skipped.
   * @param {Partial<ViewerShow>} what
   */
  show(what) {
    this.#want(what);
    if (!this.#url) return;
    this.#queue = this.#queue.then(() =>
      this.#wanted === what || what.look || what.camera ? this.#ask(what, true) : undefined,
    );
  }

  /** Merge a request made while the view opens into the pending one. @param {Partial<ViewerShow>} what */
  #want(what) {
    this.#wanted = this.#url || what.mode !== this.#wanted.mode ? what : { ...this.#wanted, ...what };
  }

  /**
   * @param {Partial<ViewerShow>} what
   * @param {boolean} again whether to retry once with a restarted view
   * @returns {Promise<void>}
   */
  async #ask(what, again) {
    if (!this.isConnected) return;
    try {
      const shown = await showInViewer(this.#project, what);
      this.#lift();
      this.emit("shown", shown);
    } catch (error) {
      if (!this.isConnected) return;
      if (!(error instanceof ApiError)) return sayError(error);
      if (error.kind === "not-ready") this.#say(error);
      else if (error.status !== 503) (this.#lift(), sayError(error));
      else if (again) return this.#ask(what, false);
      else this.#down(error.message, await openViewer(this.#project).catch(() => null));
    }
  }

  /** @param {string} url */
  #embed(url) {
    this.#url = url;
    this.#drawing = false;
    this.#wait();
    const frame = h("iframe", { src: url + (isDark() ? "?darkMode" : ""), title: "3D view of the project" });
    frame.addEventListener("load", () => this.#listen(frame));
    this.replaceChildren(frame, this.#veil);
  }

  /** Lift the veil once viser has its canvas. @param {Document | null} inside */
  #seen(inside) {
    if (!inside) return;
    const look = () => {
      if (!inside.querySelector("canvas")) return;
      looking.disconnect();
      this.#drawing = true;
      if (this.#answered) this.#lift();
    };
    const looking = new MutationObserver(look);
    looking.observe(inside, { childList: true, subtree: true });
    look();
  }

  /** Listen to drags, clicks and keys inside the same-origin frame. @param {HTMLIFrameElement} frame */
  #listen(frame) {
    const inside = frame.contentWindow;
    this.#seen(frame.contentDocument);
    const dragging = (/** @type {PointerEvent} */ event) => event.buttons && this.emit("dragging");
    inside?.addEventListener("pointermove", dragging, { signal: this.signal });
    const ended = () => setTimeout(() => this.emit("dragging"), LAST_MS);
    inside?.addEventListener("pointerup", ended, { signal: this.signal, capture: true });
    let from = [0, 0];
    const pressed = (/** @type {PointerEvent} */ { clientX, clientY }) => (from = [clientX, clientY]);
    inside?.addEventListener("pointerdown", pressed, { signal: this.signal, capture: true });
    const released = (/** @type {PointerEvent} */ { clientX, clientY, button }) => {
      const moved = Math.hypot(clientX - (from[0] ?? 0), clientY - (from[1] ?? 0));
      if (button === 0 && moved < CLICK_PX) this.emit("clicked");
    };
    inside?.addEventListener("pointerup", released, { signal: this.signal, capture: true });
    for (const type of /** @type {const} */ (["keydown", "keyup"]))
      inside?.addEventListener(type, passOn, { signal: this.signal, capture: true });
  }

  /**
   * @param {string} message
   * @param {Pick<ViewerSession, "fallback_page" | "fallback_image"> | null} instead
   */
  #down(message, instead) {
    this.#url = "";
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

/** Forward keys pressed in the frame to the page, except those that move viser's camera. @param {KeyboardEvent} event */
function passOn(event) {
  if (CAMERA_KEYS.has(event.key.toLowerCase()) && !event.ctrlKey && !event.metaKey) return;
  event.stopPropagation(); // viser has its own palette
  event.preventDefault();
  document.body.dispatchEvent(new KeyboardEvent(event.type, { ...keyOf(event), bubbles: true, cancelable: true }));
}

/** @param {KeyboardEvent} event */
function keyOf({ key, code, ctrlKey, metaKey, shiftKey, altKey, repeat }) {
  return { key, code, ctrlKey, metaKey, shiftKey, altKey, repeat };
}

function isDark() {
  const theme = document.documentElement.dataset.theme;
  return theme ? theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
}
