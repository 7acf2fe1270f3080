/**
 * Interpretation of presses on the frame: a click or box for an object, or the position of a comment.
 * Emits "pinning" when placing a comment starts or ends, "pin" {frame, x, y} when its position is clicked.
 */

import { say } from "../elements/toasts.js";
import { clicksOfBox } from "../lib/box.js";

/** @typedef {import("../api-types").PointIn} PointIn */
/** @typedef {{ x: number, y: number }} Spot in pixels of the frame */

export class Presses extends EventTarget {
  #objects;
  #edits;
  #player;
  #next;
  #under;
  /** Whether the next click makes a new object wherever it falls. */
  #forced = false;
  #pinning = false;
  #batching = false;

  /**
   * @param {import("./scene-objects.js").SceneObjects} objects
   * @param {import("./edits.js").Edits} edits
   * @param {import("./player.js").Player} player
   * @param {(points: PointIn[]) => { category: string, name?: string }} next category and name of the object that clicks create
   * @param {(spot: Spot) => number[]} under ids of the objects whose masks cover a spot, topmost first
   */
  constructor(objects, edits, player, next, under) {
    super();
    this.#objects = objects;
    this.#edits = edits;
    this.#player = player;
    this.#next = next;
    this.#under = under;
  }

  /** Let the next click start a new object, even on another object's mask. */
  startNew() {
    this.#objects.choose(null);
    this.#forced = true;
  }

  /** Whether the next click places a comment. */
  get pinning() {
    return this.#pinning;
  }

  set pinning(on) {
    this.#pinning = on;
    this.dispatchEvent(new Event("pinning"));
  }

  /** @param {Spot & { label: 0 | 1, hold: boolean }} point */
  click({ x, y, label, hold }) {
    const frame = this.#player.frame?.index;
    if (frame === undefined) return;
    if (this.#pinning) return this.#pin({ frame, x, y });
    if (this.#objects.current === null && label === 0)
      return say("Left-click the object first: a right click removes from the chosen object.");
    const other = label === 1 && !hold ? this.#otherAt({ x, y }) : null;
    if (other) return this.#choose(other);
    this.#place([{ frame, x, y, label }], hold);
  }

  /** Topmost object under a click, unless the click is on the chosen object's mask or starts a new one. @param {Spot} spot */
  #otherAt(spot) {
    const under = this.#forced && this.#objects.current === null ? [] : this.#under(spot);
    const [first] = under;
    return first === undefined || under.includes(this.#objects.current ?? -1) ? null : this.#objects.get(first);
  }

  /** @param {import("./scene-objects.js").SceneObject} object */
  #choose({ id, name }) {
    const { chosen } = this.#objects;
    this.#objects.choose(id);
    say(`${name} is chosen: this spot already belongs to it`, {
      hint: chosen
        ? `Ctrl-click adds the spot to ${chosen.name}`
        : "Ctrl-click or New object makes another object there",
    });
  }

  /** @param {{ from: Spot, to: Spot, hold: boolean }} box */
  box({ from, to, hold }) {
    const { frame } = this.#player;
    const points = frame && clicksOfBox(from, to, frame);
    if (points) this.#place(points, hold);
  }

  /** Handle the release of the key that defers segmentation. */
  release() {
    if (!this.#batching) return;
    this.#batching = false;
    this.#edits.segment();
  }

  /**
   * Add clicks to the current object, or to a new one.
   * @param {PointIn[]} points
   * @param {boolean} hold whether segmentation waits for further clicks
   */
  #place(points, hold) {
    this.#batching = hold;
    this.#forced = false;
    this.#edits.place(points, { ...this.#next(points), infer: !hold });
  }

  /** @param {Spot & { frame: number }} pin */
  #pin(pin) {
    this.pinning = false;
    this.dispatchEvent(new CustomEvent("pin", { detail: pin }));
  }
}
