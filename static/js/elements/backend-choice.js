/** Choice of the backend for one stage, with licences and why others are unavailable. Emits "choose" {seam, name}. */

import { h, LiveElement } from "../dom.js";

/** @typedef {import("../api-types").Backend} Backend */

/** @typedef {"segmenter" | "generator" | "matcher" | "arm"} Seam */

/** @type {Record<Seam, [string, string]>} title and description */
const TITLES = {
  segmenter: ["Masks", "The method that segments the objects; the masks of both are kept when you switch"],
  generator: ["Candidates", "The method that generates the meshes; the next run uses it"],
  arm: ["Arm", "The arm that tries every joint of the bundle, and where it may stand; the next run uses it"],
  matcher: ["Alignment", "The method that finds where a mesh is in the photos; the next run uses it"],
};

export class BackendChoice extends LiveElement {
  /** @type {Seam} */
  seam = "segmenter";
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
        h("h2", {}, TITLES[this.seam][0]),
        h(
          "fieldset",
          { class: "choices" },
          h("legend", {}, TITLES[this.seam][1]),
          ...this.#backends.map((backend) => this.#choice(backend)),
        ),
      ),
    );
  }

  /** @param {Backend} backend */
  #choice(backend) {
    const radio = h("input", { type: "radio", name: this.seam, value: backend.name });
    radio.checked = backend.name === this.#chosen;
    radio.disabled = !backend.available;
    radio.addEventListener("change", () => this.emit("choose", { seam: this.seam, name: backend.name }));
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
        backend.licence ? h("span", { class: `chip ${tone}` }, backend.licence) : null,
        backend.available ? null : h("span", { class: "muted" }, ` ${backend.reason}`),
      ),
    );
  }
}
