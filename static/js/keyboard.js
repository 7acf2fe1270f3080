/** Keyboard shortcuts: commands of a page, and tests whether a key press belongs to it. */

import { actionOf } from "./lib/keymap.js";

/** Actions of a page by their names in the keymap. @typedef {Record<string, (key: string, fine: boolean) => void>} Actions */

/** Commands of a page, run by a key or from the palette. */
export class Commands {
  #page;
  #actions;
  #once;

  /**
   * @param {string} page
   * @param {Actions} actions
   * @param {string[]} [once] actions that do not repeat while their key is held down
   */
  constructor(page, actions, once = []) {
    this.#page = page;
    this.#actions = actions;
    this.#once = new Set(once);
  }

  /**
   * @param {string} action
   * @param {string} [key]
   * @param {boolean} [fine] with Shift held
   */
  act(action, key = "", fine = false) {
    this.#actions[action]?.(key, fine);
  }

  /** Run the action of a key on this page, if it has one. @param {KeyboardEvent} event */
  press(event) {
    const action = actionOf(event, this.#page, plainKeys());
    if (!action || !this.#actions[action]) return;
    event.preventDefault();
    if (!(event.repeat && this.#once.has(action))) this.act(action, event.key, event.shiftKey);
  }
}

/** Whether a key press is for the page: not for a text field, a focused control or a dialog. @param {KeyboardEvent} event */
export function isForPage(event) {
  return !isTyping(event) && !isOperating(event) && !document.querySelector("dialog[open]");
}

/** Whether a key press belongs to a text field. @param {KeyboardEvent} event */
export function isTyping(event) {
  const target = event.composedPath()[0];
  if (!(target instanceof HTMLElement)) return false;
  if (target instanceof HTMLInputElement)
    return !["range", "checkbox", "radio", "button", "file"].includes(target.type);
  return target instanceof HTMLTextAreaElement || target instanceof HTMLSelectElement || target.isContentEditable;
}

const SLIDER_KEYS = ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End"];

/**
 * Whether a key press is for a control focused by keyboard: Enter on a button, an arrow on a slider.
 * @param {KeyboardEvent} event
 */
function isOperating(event) {
  const target = event.composedPath()[0];
  if (!(target instanceof Element) || !target.matches(":focus-visible")) return false;
  if (target.matches("input[type=range]")) return SLIDER_KEYS.includes(event.key);
  return target.matches("button, a[href], summary, input") && ["Enter", " "].includes(event.key);
}

const PLAIN_KEYS = "plain-keys";

/** Whether single letters are commands (WCAG 2.1.4 requires a way to turn that off). */
export function plainKeys() {
  return localStorage.getItem(PLAIN_KEYS) !== "off";
}

/** @param {boolean} on */
export function setPlainKeys(on) {
  localStorage.setItem(PLAIN_KEYS, on ? "on" : "off");
}
