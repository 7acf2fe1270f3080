/** Command palette (Ctrl+K): search over all actions and pages. */

import { h } from "../dom.js";
import { ranked } from "../lib/commands.js";
import { printed } from "../lib/keymap.js";

/** @typedef {import("../lib/commands.js").Command} Command */

const SHOWN = 12;

export class CommandPalette extends HTMLElement {
  #dialog = h("dialog", { "aria-label": "Commands", class: "palette" });
  #input = h("input", {
    type: "text",
    role: "combobox",
    placeholder: "Type a command, an object or a frame number",
    "aria-label": "Command",
    "aria-expanded": "true",
    "aria-controls": "palette-list",
    autocomplete: "off",
  });
  #list = h("ul", { role: "listbox", id: "palette-list", "aria-label": "Commands" });
  /** @type {(text: string) => Command[]} */
  #commands = () => [];
  /** @type {Command[]} */
  #shown = [];
  #at = 0;

  connectedCallback() {
    this.#dialog.replaceChildren(this.#input, this.#list);
    this.append(this.#dialog);
    this.#input.addEventListener("input", () => this.#find());
    this.#dialog.addEventListener("keydown", (event) => this.#onKey(event));
  }

  /** @param {(text: string) => Command[]} commands */
  open(commands) {
    if (this.#dialog.open) return this.#dialog.close();
    this.#commands = commands;
    this.#input.value = "";
    this.#find();
    this.#dialog.showModal();
    this.#input.focus();
  }

  #find() {
    const text = this.#input.value;
    this.#shown = ranked(this.#commands(text), text).slice(0, SHOWN);
    this.#at = 0;
    this.#draw();
  }

  #draw() {
    const options = this.#shown.map((command, k) => {
      const option = h(
        "li",
        { role: "option", id: `palette-${k}`, "aria-selected": String(k === this.#at) },
        h("span", {}, command.text),
        command.keys ? h("kbd", {}, ...printed([command.keys])) : null,
      );
      option.addEventListener("click", () => this.#run(command));
      return option;
    });
    this.#list.replaceChildren(...(options.length ? options : [h("li", { class: "muted" }, "No matches.")]));
    this.#input.setAttribute("aria-activedescendant", options.length ? `palette-${this.#at}` : "");
    options[this.#at]?.scrollIntoView({ block: "nearest" });
  }

  /** @param {KeyboardEvent} event */
  #onKey(event) {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    const chosen = this.#shown[this.#at];
    if (step) this.#at = (this.#at + step + this.#shown.length) % Math.max(this.#shown.length, 1);
    else if (event.key === "Enter" && chosen) this.#run(chosen);
    else return;
    event.preventDefault();
    event.stopPropagation();
    this.#draw();
  }

  /** @param {Command} command */
  #run(command) {
    this.#dialog.close();
    command.run();
  }
}
