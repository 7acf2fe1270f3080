/** Mosaic of an object's masks on many frames, worst first. Emits "seek-frame" with a frame's index. */

import { getMasks } from "../api.js";
import { h, LiveElement } from "../dom.js";
import { counted } from "../lib/format.js";
import { worstFirst } from "../lib/lanes.js";
import { decodeBox, paintBox, rgbOf } from "../lib/masks.js";

/** @typedef {import("../api-types").FrameInfo} FrameInfo */
/** @typedef {import("../api-types").FrameMask} FrameMask */
/** @typedef {{ id: number, name: string, colour: string, lane: Map<number, number> }} Looked */

const TILES = 24;
const WIDTH = 320;

export class FrameMosaic extends LiveElement {
  project = "";
  #dialog = h("dialog", { class: "mosaic", "aria-label": "Masks on many frames" });

  connected() {
    this.replaceChildren(this.#dialog);
  }

  /**
   * @param {Looked} object
   * @param {FrameInfo[]} frames
   * @param {(frame: FrameInfo, width: number) => string} url
   */
  open(object, frames, url) {
    if (this.#dialog.open) return this.#dialog.close();
    const byIndex = new Map(frames.map((frame) => [frame.index, frame]));
    const shown = worstFirst(object.lane, TILES);
    const tiles = shown.flatMap(({ frame, confidence }) => {
      const info = byIndex.get(frame);
      return info ? [this.#tile(object, info, confidence, url(info, WIDTH))] : [];
    });
    const close = h("button", { type: "button", onClick: () => this.#dialog.close() }, "Close");
    this.#dialog.replaceChildren(
      h(
        "div",
        { class: "row" },
        h("h2", { class: "grow" }, `${object.name} on ${counted(object.lane.size, "frame")}, worst first`),
        close,
      ),
      tiles.length ? h("div", { class: "tiles" }, ...tiles) : h("p", { class: "muted" }, "No mask yet."),
    );
    this.#dialog.showModal();
  }

  /**
   * @param {Looked} object
   * @param {FrameInfo} frame
   * @param {number} confidence
   * @param {string} src
   */
  #tile(object, frame, confidence, src) {
    const percent = `${Math.round(100 * confidence)} %`;
    const canvas = h("canvas", { width: WIDTH, height: Math.round((WIDTH * frame.height) / frame.width) });
    const tile = h(
      "button",
      { type: "button", "aria-label": `Frame ${frame.index}, ${percent} sure` },
      canvas,
      h("span", { class: confidence < 0.5 ? "chip warn" : "chip" }, `${frame.index} · ${percent}`),
    );
    tile.addEventListener("click", () => {
      this.#dialog.close();
      this.emit("seek-frame", frame.index);
    });
    this.#paint(canvas, object, frame, src);
    return tile;
  }

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {Looked} object
   * @param {FrameInfo} frame
   * @param {string} src
   */
  async #paint(canvas, object, frame, src) {
    const image = new Image();
    image.src = src;
    const [masks] = await Promise.all([getMasks(this.project, frame.index, this.signal), image.decode()]).catch(() => [
      [],
    ]);
    const context = canvas.getContext("2d");
    if (!context || !image.naturalWidth) return;
    context.drawImage(image, 0, 0, canvas.width, canvas.height);
    const mask = masks.find((m) => m.object === object.id)?.mask;
    if (!mask?.box_width) return;
    const rgba = paintBox(await decodeBox(mask), mask.box_width, mask.box_height, rgbOf(object.colour), 0.5);
    const bitmap = await createImageBitmap(new ImageData(rgba, mask.box_width, mask.box_height));
    const step = canvas.width / mask.width;
    context.drawImage(bitmap, mask.left * step, mask.top * step, mask.box_width * step, mask.box_height * step);
    bitmap.close();
  }
}
