/**
 * Lengths measured in the room, compared with the scan; the recording can be rescaled to match them.
 * Emits "rescaled" with the project being read again.
 */

import { addLength, getScene, listLengths, readAgain, removeLength } from "../api.js";
import { h, LiveElement, renew } from "../dom.js";
import { Answers } from "../lib/answers.js";
import { offBy, parseLength, rescaleNotes } from "../lib/lengths.js";
import { live } from "../live.js";
import { say, sayError } from "./toasts.js";

/** @typedef {import("../api-types").TrueLength} TrueLength */
/** @typedef {import("../api-types").TrueLengths} TrueLengths */
/** @typedef {import("../api-types").SceneItem} SceneItem */

const SIDES = /** @type {const} */ (["width", "depth", "height"]);
const ALIKE = 0.0005; // relative; smaller rescales are ignored

export class TrueLengthList extends LiveElement {
  project = "";
  #answers = new Answers();
  /** @type {TrueLengths | null} */
  #all = null;
  /** @type {SceneItem[]} */
  #items = [];
  /** @type {TrueLength | null} the length removed last */
  #removed = null;
  #list = h("div");
  #object = h("select", { "aria-label": "Object" });
  #side = h("select", { "aria-label": "Side" }, ...SIDES.map((side) => h("option", { value: side }, side)));
  #typed = h("input", { "aria-label": "True length, in mm", placeholder: "596 mm", required: true, size: 12 });
  #form = h(
    "form",
    { class: "row" },
    h("span", {}, "The"),
    this.#side,
    h("span", {}, "of"),
    this.#object,
    h("span", {}, "is really"),
    this.#typed,
    h("button", { type: "submit" }, "Add"),
  );

  connected() {
    const { signal } = this;
    this.#form.addEventListener("submit", (event) => (event.preventDefault(), this.#add()), { signal });
    this.#typed.addEventListener("input", () => this.#typed.setCustomValidity(""), { signal });
    live.addEventListener("project", () => this.#load(), { signal });
    live.addEventListener("job", () => this.#load(), { signal });
    this.replaceChildren(h("section", { class: "card stack" }, h("h2", {}, "True lengths"), this.#list, this.#form));
    this.#load();
  }

  async #load() {
    try {
      const asked = Promise.all([listLengths(this.project), getScene(this.project).catch(() => null)]);
      await this.#answers.take(asked, ([all, scene]) => {
        this.#items = (scene?.items ?? []).filter(({ object }) => object !== null);
        this.#offer();
        this.#show(all);
      });
    } catch (error) {
      sayError(error);
    }
  }

  #offer() {
    const chosen = this.#object.value;
    const options = this.#items.map(({ object, name }) => h("option", { value: String(object) }, name));
    this.#object.replaceChildren(...options);
    if (options.some(({ value }) => value === chosen)) this.#object.value = chosen;
    this.#form.hidden = !options.length;
  }

  /** @param {TrueLengths} all */
  #show(all) {
    this.#all = all;
    const { lengths, scale } = all;
    const head = ["What", "True", "In the scan", "Off by", ""].map((text) => h("th", { scope: "col" }, text));
    const table = h(
      "table",
      {},
      h("thead", {}, h("tr", {}, ...head)),
      h("tbody", {}, ...lengths.map((length) => this.#row(length))),
    );
    renew(
      this.#list,
      lengths.length ? table : this.#none(),
      scale === 1 ? "" : this.#scaled(scale),
      this.#wanted(all),
      this.#removed ? this.#putBack(this.#removed) : "",
    );
  }

  #none() {
    const how = this.#items.length
      ? "Measure one or two edges in the room with a tape: the scan is compared with them, and can be rescaled by them."
      : "After the first run you can compare edges measured in the room with the scan here.";
    return h("p", { class: "muted" }, `${how} The tape of the review (T) keeps a length between any two points, too.`);
  }

  /** @param {TrueLength} length */
  #row(length) {
    const { id, text, metres, measured_m: measured, error_m: error } = length;
    const off = error !== null && Math.abs(error / metres) > 0.01;
    const remove = h("button", { type: "button", class: "quiet", "aria-label": `Remove ${text}` }, "Remove");
    remove.dataset.at = `remove:${id}`;
    remove.addEventListener("click", () => this.#remove(length));
    return h(
      "tr",
      {},
      h("td", {}, text),
      h("td", {}, `${mm(metres)} mm`),
      h("td", {}, measured === null ? "" : `${mm(measured)} mm`),
      h("td", {}, h("span", { class: off ? "chip warn" : "" }, offBy(length))),
      h("td", {}, remove),
    );
  }

  /** @param {number} scale */
  #scaled(scale) {
    const back = h("button", { type: "button" }, "Read lengths as recorded");
    back.dataset.at = "back:";
    back.addEventListener("click", () => this.#rescale(1));
    return h(
      "div",
      { class: "row", role: "note" },
      h("span", {}, `Every length is multiplied by ${scale.toFixed(4)}.`),
      back,
    );
  }

  /** @param {TrueLengths} all */
  #wanted({ scale, scale_wanted: wanted }) {
    if (wanted === null || Math.abs(wanted / scale - 1) < ALIKE) return "";
    const percent = 100 * (wanted / scale - 1);
    const said = `The scan is ${percent > 0 ? "too small" : "too large"} by ${Math.abs(percent).toFixed(1)} %.`;
    const button = h("button", { type: "button" }, "Rescale the recording…");
    button.dataset.at = "rescale:";
    button.addEventListener("click", () => this.#ask(wanted));
    return h("div", { class: "row", role: "note" }, h("span", {}, said), button);
  }

  /** @param {TrueLength} length */
  #putBack(length) {
    const back = h("button", { type: "button" }, "Put it back");
    back.dataset.at = "putback:";
    back.addEventListener("click", () => this.#send(addLength(this.project, given(length)), null));
    return h(
      "div",
      { class: "row" },
      h("span", { class: "muted" }, `Removed: ${length.text}, ${mm(length.metres)} mm.`),
      back,
    );
  }

  #add() {
    const found = parseLength(this.#typed.value);
    if (!found) {
      this.#typed.setCustomValidity("A length such as 596, 596 mm, 59.6 cm or 0.596 m");
      return void this.#typed.reportValidity();
    }
    const side = /** @type {typeof SIDES[number]} */ (this.#side.value);
    this.#typed.value = "";
    const length = { metres: found.metres, object: Number(this.#object.value), side, text: found.text };
    this.#send(addLength(this.project, length), this.#removed);
  }

  /** @param {TrueLength} length */
  #remove(length) {
    this.#send(removeLength(this.project, length.id), length);
  }

  /** @param {Promise<TrueLengths>} answer @param {TrueLength | null} removed */
  async #send(answer, removed) {
    try {
      const all = await answer;
      this.#removed = removed;
      this.#show(all);
    } catch (error) {
      sayError(error);
    }
  }

  /** Confirm a rescale, listing its effects. @param {number} wanted */
  #ask(wanted) {
    if (!this.#all) return;
    const notes = rescaleNotes(this.#all, this.#items).map((note) => h("li", {}, note));
    const dialog = h(
      "dialog",
      { "aria-label": "Rescale the recording", class: "ask" },
      h("h2", {}, "Rescale the recording"),
      h("ul", {}, ...notes),
      h(
        "form",
        { method: "dialog", class: "row" },
        h("button", { type: "submit", class: "primary", value: "ok" }, `Multiply every length by ${wanted.toFixed(4)}`),
        h("button", { type: "submit", value: "" }, "Cancel"),
      ),
    );
    dialog.addEventListener("close", () => {
      dialog.remove();
      if (dialog.returnValue === "ok") this.#rescale(wanted);
    });
    document.body.append(dialog);
    dialog.showModal();
  }

  /** @param {number} scale */
  async #rescale(scale) {
    try {
      this.emit("rescaled", await readAgain(this.project, { scale }));
      say("The recording is read again", { kind: "good", hint: "then run the project again" });
    } catch (error) {
      sayError(error);
    }
  }
}

/** @param {TrueLength} length @returns {import("../api-types").TrueLengthIn} */
function given({ metres, object, side, points_world, text }) {
  const points = /** @type {[number[], number[]] | null} */ (points_world);
  return side === null ? { metres, points_world: points, text } : { metres, object, side, text };
}

/** @param {number} metres */
function mm(metres) {
  return Math.round(1000 * metres);
}
