/** Point cloud of an object, growing as its masks arrive. A drag or the arrow keys rotate it. */

import { getObjectPoints } from "../api.js";
import { h, LiveElement } from "../dom.js";
import { Answers } from "../lib/answers.js";
import { counted } from "../lib/format.js";
import { decodePoints, project } from "../lib/points.js";
import { sayError } from "./toasts.js";

const SOON_MS = 700;
const NONE = "Choose an object to see its points.";

export class ObjectCloud extends LiveElement {
  project = "";
  #answers = new Answers();
  #canvas = h("canvas", {
    width: 260,
    height: 180,
    tabIndex: 0,
    role: "img",
    "aria-label": "The object's points in 3D",
  });
  #text = h("p", { class: "muted", role: "status" }, NONE);
  /** @type {number | null} */
  #object = null;
  /** @type {import("../lib/points.js").Cloud | null} */
  #cloud = null;
  #turn = { yaw: -0.5, pitch: 0.35 };
  #timer = 0;

  connected() {
    this.replaceChildren(this.#canvas, this.#text);
    this.#canvas.hidden = true;
    const { signal } = this;
    this.#canvas.addEventListener("pointerdown", (event) => this.#canvas.setPointerCapture(event.pointerId), {
      signal,
    });
    this.#canvas.addEventListener(
      "pointermove",
      (event) => event.buttons & 1 && this.#rotate(event.movementX / 90, event.movementY / 90),
      { signal },
    );
    this.#canvas.addEventListener("keydown", (event) => this.#onKey(event), { signal });
    signal.addEventListener("abort", () => clearTimeout(this.#timer));
  }

  /** @param {number | null} object */
  show(object) {
    if (object === this.#object) return;
    this.#object = object;
    this.#cloud = null;
    this.#text.textContent = object === null ? NONE : "Looking…";
    this.#draw();
    this.refresh();
  }

  /** Reload the points after the masks changed, throttled. */
  refresh() {
    if (this.#timer || this.#object === null) return;
    this.#timer = window.setTimeout(() => {
      this.#timer = 0;
      this.#load();
    }, SOON_MS);
  }

  async #load() {
    const object = this.#object;
    if (object === null || this.signal.aborted) return;
    try {
      await this.#answers.take(getObjectPoints(this.project, object, this.signal), (found) => {
        if (object !== this.#object) return;
        this.#cloud = found.count ? decodePoints(found) : null;
        this.#text.textContent = found.count
          ? `${found.size_m.map((side) => (100 * side).toFixed(0)).join(" × ")} cm, from ${counted(found.frames, "frame")}`
          : "No points yet.";
        this.#draw();
      });
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {KeyboardEvent} event */
  #onKey(event) {
    /** @type {Record<string, [number, number]>} */
    const turns = { ArrowLeft: [-0.15, 0], ArrowRight: [0.15, 0], ArrowUp: [0, -0.15], ArrowDown: [0, 0.15] };
    const turn = turns[event.key];
    if (!turn) return;
    event.preventDefault();
    event.stopPropagation();
    this.#rotate(...turn);
  }

  /**
   * @param {number} yaw
   * @param {number} pitch
   */
  #rotate(yaw, pitch) {
    this.#turn.yaw += yaw;
    this.#turn.pitch = Math.min(Math.max(this.#turn.pitch + pitch, -1.5), 1.5);
    this.#draw();
  }

  #draw() {
    const context = this.#canvas.getContext("2d");
    if (!context) return;
    this.#canvas.hidden = this.#cloud === null;
    const { width, height } = this.#canvas;
    const picture = context.createImageData(width, height);
    if (this.#cloud) project(this.#cloud, this.#turn, picture);
    context.putImageData(picture, 0, 0);
  }
}
