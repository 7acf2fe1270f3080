/** Which segmenter draws a project's masks, under which licence, and what is missing for the others. Emits "choose" name. */

import { h, LiveElement } from "../dom.js";

/** @typedef {import("../api-types").Backend} Backend */

export class SegmenterChoice extends LiveElement {
  /** @type {Backend[]} */
  #backends = [];
  #chosen = "";

  /** @param {Backend[]} backends */
  set backends(backends) {
    this.#backends = backends;
    this.#draw();
  }

  /** @param {string} name */
  set chosen(name) {
    this.#chosen = name;
    this.#draw();
  }

  connected() {
    this.#draw();
  }

  #draw() {
    this.replaceChildren(
      h(
        "section",
        { class: "card stack" },
        h("h2", {}, "Masks"),
        h(
          "fieldset",
          { class: "choices" },
          h("legend", {}, "Who draws them; both sets are kept when you change your mind"),
          ...this.#backends.map((backend) => this.#choice(backend)),
        ),
      ),
    );
  }

  /** @param {Backend} backend */
  #choice(backend) {
    const radio = h("input", { type: "radio", name: "segmenter", value: backend.name });
    radio.checked = backend.name === this.#chosen;
    radio.disabled = !backend.available;
    radio.addEventListener("change", () => this.emit("choose", backend.name));
    const tone = backend.licence_class === "open" ? "good" : "warn";
    return h(
      "label",
      { class: "choice" },
      radio,
      h(
        "span",
        {},
        h("strong", {}, backend.name),
        ` ${backend.summary} `,
        h("span", { class: `chip ${tone}` }, backend.licence),
        backend.available ? null : h("span", { class: "muted" }, ` ${backend.reason}`),
      ),
    );
  }
}
