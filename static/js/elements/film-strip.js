/**
 * Timeline of the frames, with a lane per object and, above it, a lane for each of its fronts filmed open.
 * Emits "seek" with a position in the list of frames, "play", "pick-object" id.
 */

import { h, icon, LiveElement, renew } from "../dom.js";
import { counted, jointValue } from "../lib/format.js";
import { drawLane } from "../lib/lane-view.js";
import { drawOpening } from "../lib/opening-view.js";
import { stateSaid } from "../lib/openings.js";
import { sourceChip, sourceWord } from "../source-chip.js";

/** @typedef {import("../api-types").FrameInfo} FrameInfo */
/** @typedef {import("../lib/lane-view.js").LaneView & { id: number, name: string, openings: Opening[] }} LaneView */
/** @typedef {import("../api-types").Opening} Opening */
/** @typedef {{ opening: Opening, colour: string, state: HTMLElement }} OpeningView */

const THUMBS = 18;
const NO_LANES = "Each object gets a lane here: the frames that show it, and its clicks.";

export class FilmStrip extends LiveElement {
  /** @type {FrameInfo[]} */
  #frames = [];
  #position = 0;
  /** @type {Map<HTMLCanvasElement, LaneView>} */
  #drawn = new Map();
  /** @type {Map<HTMLCanvasElement, OpeningView>} */
  #opened = new Map();
  #size = { width: 0, height: 0 };
  #openedSize = { width: 0, height: 0 };
  #thumbs = h("div", { class: "thumbs" });
  #lanes = h("div", { class: "lanes" });
  #slider = h("input", { type: "range", min: "0", max: "0", value: "0", "aria-label": "Frame" });
  #text = h("output", { class: "mono" });
  /** Slot for a status, of its own width, beside the frame number. */
  status = h("div");
  #play = h("button", { type: "button", class: "quiet", "aria-label": "Play or pause" }, icon("play"));

  connected() {
    const { signal } = this;
    this.#slider.addEventListener("input", () => this.emit("seek", Number(this.#slider.value)), { signal });
    this.#play.addEventListener("click", () => this.emit("play"), { signal });
    for (const type of ["pointerdown", "pointermove"])
      this.#thumbs.addEventListener(type, (event) => this.#scrub(/** @type {PointerEvent} */ (event), this.#thumbs), {
        signal,
      });
    const page = document.documentElement.style;
    const observer = new ResizeObserver(() => {
      page.setProperty("--strip-height", `${this.offsetHeight}px`); // toasts are placed above it
      this.#measure();
    });
    observer.observe(this);
    signal.addEventListener("abort", () => (observer.disconnect(), page.removeProperty("--strip-height")));
    this.replaceChildren(
      h("div", { class: "transport" }, this.#play, this.#slider, this.status, this.#text),
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
    this.#drawLanes();
  }

  /**
   * Seek to the frame under a pressed pointer.
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

  /** Measure the first lane of each kind; the others have the same size. */
  #measure() {
    const { clientWidth: width = 0, clientHeight: height = 0 } = this.#drawn.keys().next().value ?? {};
    this.#size = { width, height };
    const opened = this.#opened.keys().next().value;
    this.#openedSize = { width: opened?.clientWidth ?? 0, height: opened?.clientHeight ?? 0 };
    this.#drawLanes();
  }

  #drawLanes() {
    const indices = this.#frames.map((frame) => frame.index);
    const ink = getComputedStyle(this).color;
    for (const [canvas, lane] of this.#drawn) drawLane(canvas, this.#size, lane, indices, this.#position, ink);
    const frame = indices[this.#position] ?? -1;
    for (const [canvas, lane] of this.#opened) {
      drawOpening(canvas, this.#openedSize, lane, indices, this.#position, ink);
      lane.state.textContent = stateSaid(lane.opening, frame);
    }
  }

  /**
   * @param {Opening} opening
   * @param {LaneView} lane of its object
   * @param {Map<HTMLCanvasElement, OpeningView>} opened
   */
  #openingLane(opening, { name, colour }, opened) {
    const what = opening.part ? `${name}, ${opening.part}` : name;
    const widest = jointValue(opening.kind, opening.largest);
    const label = `Opening of ${what}: seen up to ${widest}, ${sourceWord("at_least")}`;
    const canvas = h("canvas", { role: "img", "aria-label": label, title: label });
    for (const type of ["pointerdown", "pointermove"])
      canvas.addEventListener(type, (event) => this.#scrub(/** @type {PointerEvent} */ (event), canvas));
    const state = h("output", { class: "state" });
    opened.set(canvas, { opening, colour, state });
    const limit = sourceChip("at_least", { of: widest });
    return h("div", { class: "lane opening" }, h("span", { class: "muted" }, state, limit), canvas);
  }

  /** @param {LaneView[]} lanes */
  setLanes(lanes) {
    /** @type {Map<HTMLCanvasElement, LaneView>} */
    const drawn = new Map();
    /** @type {Map<HTMLCanvasElement, OpeningView>} */
    const opened = new Map();
    renew(
      this.#lanes,
      ...(lanes.length ? [] : [h("p", { class: "muted" }, NO_LANES)]),
      ...lanes.map((lane) => {
        const label = `${lane.name}: seen in ${counted(lane.frames.size, "frame")}`;
        const canvas = h("canvas", { role: "img", "aria-label": label, title: label });
        drawn.set(canvas, lane);
        for (const type of ["pointerdown", "pointermove"])
          canvas.addEventListener(type, (event) => this.#scrub(/** @type {PointerEvent} */ (event), canvas));
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
        const above = lane.openings.map((opening) => this.#openingLane(opening, lane, opened));
        return h(
          "div",
          { class: lane.current ? "lane-group current" : "lane-group" },
          ...above,
          h("div", { class: "lane" }, name, canvas),
        );
      }),
    );
    this.#drawn = drawn;
    this.#opened = opened;
    this.#measure();
    const current = /** @type {HTMLElement | null} */ (this.#lanes.querySelector(".current"));
    if (!current) return;
    const above = (this.#lanes.clientHeight - current.offsetHeight) / 2;
    this.#lanes.scrollTop = current.offsetTop - this.#lanes.offsetTop - above;
  }
}

/**
 * @param {HTMLElement} button
 * @param {number} position
 */
function distance(button, position) {
  return Math.abs(Number(button.dataset.position) - position);
}
