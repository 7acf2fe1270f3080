/** Joint panel of the 3D view: a slider and the sources of each joint, a sweep, and open and close all. */

import { h } from "../dom.js";
import { counted, jointValue } from "../lib/format.js";
import { motionOf } from "../lib/joints.js";
import { sourceChip, sourceWord } from "../source-chip.js";

/** @typedef {import("../api-types").SceneItem} SceneItem */
/** @typedef {import("../api-types").ViewerJoint} ViewerJoint */

const SWEEP_MS = 2600;
const STEP_MS = 110;

export class JointPanel {
  element = h("div", { class: "joints", hidden: true });
  #move;
  /** @type {{ joint: ViewerJoint, object: string, set: (value: number) => void }[]} */
  #sliders = [];
  #timer = 0;

  /** @param {(values: Record<string, number>) => void} move */
  constructor(move) {
    this.#move = move;
  }

  /**
   * @param {ViewerJoint[]} joints
   * @param {SceneItem[]} items
   */
  show(joints, items) {
    clearInterval(this.#timer);
    this.element.hidden = joints.length === 0;
    const known = new Map(items.flatMap((item) => item.joints.map((joint) => [joint.name, { item, joint }])));
    const made = joints.map((joint) => this.#slider(joint, known.get(joint.name)));
    this.#sliders = made.map(({ joint, object, set }) => ({ joint, object, set }));
    const guessed = made.filter(({ check }) => check).length;
    this.element.replaceChildren(
      h(
        "div",
        { class: "row" },
        h("strong", {}, counted(joints.length, "joint")),
        guessed ? h("span", { class: "chip warn" }, `${guessed} with a default to check`) : "",
        h("button", { type: "button", onClick: () => this.#all(1) }, "Open all"),
        h("button", { type: "button", onClick: () => this.#all(0) }, "Close all"),
        h("button", { type: "button", onClick: () => this.sweep(null) }, "Sweep all"),
      ),
      ...made.map(({ element }) => element),
    );
  }

  /** Open and close the joints of one object, or all with null. @param {string | null} object */
  sweep(object) {
    clearInterval(this.#timer);
    if (matchMedia("(prefers-reduced-motion: reduce)").matches) return this.#place(1, object);
    const start = performance.now();
    this.#timer = window.setInterval(() => {
      const share = Math.min((performance.now() - start) / SWEEP_MS, 1);
      this.#place(1 - Math.abs(1 - 2 * share), object);
      if (share === 1) clearInterval(this.#timer);
    }, STEP_MS);
  }

  stop() {
    clearInterval(this.#timer);
  }

  /** @param {number} share */
  #all(share) {
    clearInterval(this.#timer);
    this.#place(share, null);
  }

  /**
   * @param {number} share fraction of the travel
   * @param {string | null} object
   */
  #place(share, object) {
    /** @type {Record<string, number>} */
    const values = {};
    for (const slider of this.#sliders.filter((s) => object === null || s.object === object)) {
      const value = slider.joint.lower + share * (slider.joint.upper - slider.joint.lower);
      slider.set(value);
      values[slider.joint.name] = value;
    }
    if (Object.keys(values).length) this.#move(values);
  }

  /**
   * @param {ViewerJoint} joint
   * @param {{ item: SceneItem, joint: SceneItem["joints"][number] } | undefined} known
   */
  #slider(joint, known) {
    const type = known?.joint.type ?? "revolute";
    const sources = Object.entries(known?.joint.sources ?? {});
    const check = sources.some(([, source]) => source === "default");
    const input = h("input", {
      type: "range",
      min: String(joint.lower),
      max: String(joint.upper),
      step: "any",
      value: String(joint.value),
      "aria-label": joint.name,
    });
    const value = h("output", { class: "mono" }, jointValue(type, joint.value));
    input.addEventListener("input", () => {
      value.textContent = jointValue(type, Number(input.value));
      this.#move({ [joint.name]: Number(input.value) });
    });
    /** @type {(at: number) => void} */
    const set = (at) => {
      input.value = String(at);
      value.textContent = jointValue(type, at);
    };
    const worst = check ? "default" : (sources.find(([, s]) => s === "inferred")?.[1] ?? sources[0]?.[1] ?? "");
    const old = known?.item.changed ?? false;
    const said = sources.map(([what, s]) => `${what} ${sourceWord(s)}`).join(", ");
    const badge = sourceChip(worst, { title: old ? `of the last run, before the last change: ${said}` : said });
    badge.classList.toggle("old", old);
    const alone = known?.item.joints.length === 1; // then the object's name is enough
    const title = known ? `${joint.name}: ${motionOf(known.joint).toLowerCase()}` : joint.name;
    const name = h("span", { class: "name", title }, alone ? known.item.name : joint.name);
    return { joint, object: known?.item.name ?? "", set, check, element: h("label", {}, name, badge, input, value) };
  }
}
