/** Frames to scrub, with a lane per object. Emits "seek" with a position in the list of frames, "play", "pick-object" id. */

import { h, icon, LiveElement, renew } from "../dom.js";
import { runs } from "../lib/lanes.js";

/** @typedef {import("../api-types").FrameInfo} FrameInfo */
/** @typedef {{ id: number, number: number, colour: string, name: string, frames: Map<number, number>, prompts: Set<number>, current: boolean }} LaneView */

const THUMBS = 18;

export class FilmStrip extends LiveElement {
  /** @type {FrameInfo[]} */
  #frames = [];
  #position = 0;
  #thumbs = h("div", { class: "thumbs" });
  #lanes = h("div", { class: "lanes" });
  #slider = h("input", { type: "range", min: "0", max: "0", value: "0", "aria-label": "Frame" });
  #text = h("output", { class: "mono" });
  #play = h("button", { type: "button", class: "quiet", "aria-label": "Play or pause" }, icon("play"));

  connected() {
    const { signal } = this;
    this.#slider.addEventListener("input", () => this.emit("seek", Number(this.#slider.value)), { signal });
    this.#play.addEventListener("click", () => this.emit("play"), { signal });
    for (const type of ["pointerdown", "pointermove"])
      this.#thumbs.addEventListener(type, (event) => this.#scrub(/** @type {PointerEvent} */ (event), this.#thumbs), {
        signal,
      });
    this.replaceChildren(
      h("div", { class: "transport" }, this.#play, this.#slider, this.#text),
      this.#thumbs,
      this.#lanes,
    );
  }

  /**
   * @param {FrameInfo[]} frames
   * @param {(frame: FrameInfo) => string} thumbnail
   */
  setFrames(frames, thumbnail) {
    this.#frames = frames;
    this.#slider.max = String(Math.max(frames.length - 1, 0));
    const count = Math.min(THUMBS, frames.length);
    this.#thumbs.replaceChildren(
      ...Array.from({ length: count }, (_, k) => {
        const position = Math.round((k * (frames.length - 1)) / Math.max(count - 1, 1));
        const frame = frames[position];
        if (!frame) return "";
        const image = h("img", { src: thumbnail(frame), alt: "", loading: "lazy" });
        const button = h("button", { type: "button", "aria-label": `Frame ${frame.index}` }, image);
        button.dataset.position = String(position);
        button.addEventListener("click", () => this.emit("seek", position));
        return button;
      }),
    );
    this.setPosition(this.#position);
  }

  /** @param {number} position */
  setPosition(position) {
    this.#position = position;
    this.#slider.value = String(position);
    const frame = this.#frames[position];
    const text = frame ? `frame ${frame.index} · ${position + 1} of ${this.#frames.length}` : "";
    this.#text.textContent = text;
    this.#slider.setAttribute("aria-valuetext", text);
    const buttons = [...this.#thumbs.querySelectorAll("button")];
    const near = buttons.toSorted((a, b) => distance(a, position) - distance(b, position))[0];
    for (const button of buttons) button.setAttribute("aria-current", String(button === near));
    for (const canvas of this.#lanes.querySelectorAll("canvas")) canvas.dispatchEvent(new Event("redraw"));
  }

  /**
   * Show the frame under a pressed mouse or a finger.
   * @param {PointerEvent} event
   * @param {HTMLElement} over
   */
  #scrub(event, over) {
    if (event.buttons !== 1) return;
    const { left, width } = over.getBoundingClientRect();
    const share = Math.min(Math.max((event.clientX - left) / Math.max(width, 1), 0), 1);
    const position = Math.round(share * (this.#frames.length - 1));
    if (position !== this.#position) this.emit("seek", position);
  }

  /** @param {boolean} playing */
  setPlaying(playing) {
    this.#play.replaceChildren(icon(playing ? "pause" : "play"));
    this.#play.setAttribute("aria-pressed", String(playing));
  }

  /** @param {LaneView[]} lanes */
  setLanes(lanes) {
    renew(
      this.#lanes,
      ...lanes.map((lane) => {
        const label = `${lane.name}: seen in ${lane.frames.size} frames`;
        const canvas = h("canvas", { role: "img", "aria-label": label, title: label, width: 1200, height: 12 });
        const draw = () => this.#drawLane(canvas, lane);
        canvas.addEventListener("redraw", draw);
        for (const type of ["pointerdown", "pointermove"])
          canvas.addEventListener(type, (event) => this.#scrub(/** @type {PointerEvent} */ (event), canvas));
        draw();
        const name = h(
          "button",
          {
            type: "button",
            class: "quiet",
            "aria-pressed": String(lane.current),
            "aria-label": `Lane of ${lane.name}`,
          },
          lane.name,
        );
        name.dataset.at = `lane:${lane.id}`;
        name.addEventListener("click", () => this.emit("pick-object", lane.id));
        return h("div", { class: lane.current ? "lane current" : "lane" }, name, canvas);
      }),
    );
    const current = /** @type {HTMLElement | null} */ (this.#lanes.querySelector(".current"));
    if (current) this.#lanes.scrollTop = current.offsetTop - this.#lanes.offsetTop - this.#lanes.clientHeight / 2;
  }

  /**
   * A bar where the mask is present, hatched where it is doubtful, a diamond at each click.
   * @param {HTMLCanvasElement} canvas
   * @param {LaneView} lane
   */
  #drawLane(canvas, lane) {
    const context = canvas.getContext("2d");
    if (!context) return;
    const step = canvas.width / Math.max(this.#frames.length, 1);
    context.clearRect(0, 0, canvas.width, canvas.height);
    const hatched = hatch(context, lane.colour);
    context.globalAlpha = 0.18;
    context.fillStyle = lane.colour;
    context.fillRect(0, 5, canvas.width, 2);
    context.globalAlpha = lane.current ? 1 : 0.75;
    for (const { from, to, doubtful } of runs(this.#frames.map((frame) => lane.frames.get(frame.index)))) {
      context.fillStyle = doubtful ? hatched : lane.colour;
      context.fillRect(from * step, 2, Math.max((to - from) * step, 1), 8);
    }
    context.globalAlpha = 1;
    this.#frames.forEach((frame, k) => {
      if (!lane.prompts.has(frame.index)) return;
      const x = (k + 0.5) * step;
      context.beginPath();
      context.moveTo(x, 0);
      context.lineTo(x + 6, 6);
      context.lineTo(x, 12);
      context.lineTo(x - 6, 6);
      context.fillStyle = "#ffffff";
      context.fill();
      context.strokeStyle = "#10131a";
      context.stroke();
    });
    context.fillStyle = getComputedStyle(this).getPropertyValue("color");
    context.fillRect((this.#position + 0.5) * step - 1, 0, 2, canvas.height);
  }
}

/**
 * @param {HTMLElement} button
 * @param {number} position
 */
function distance(button, position) {
  return Math.abs(Number(button.dataset.position) - position);
}

/**
 * Slanted lines in a colour.
 * @param {CanvasRenderingContext2D} context
 * @param {string} colour
 */
function hatch(context, colour) {
  const tile = new OffscreenCanvas(6, 6);
  const drawn = tile.getContext("2d");
  if (!drawn) return colour;
  drawn.strokeStyle = colour;
  drawn.lineWidth = 2;
  for (const x of [-3, 3]) {
    drawn.beginPath();
    drawn.moveTo(x, 6);
    drawn.lineTo(x + 6, 0);
    drawn.stroke();
  }
  return context.createPattern(tile, "repeat") ?? colour;
}
