/** Recognition of clicks, drags and two-finger gestures, in screen coordinates; `held` is the item under the press. */

/** @typedef {{ x: number, y: number }} At */
/**
 * @template T
 * @typedef {{ kind: "pan", by: At } | { kind: "pinch", before: At[], after: At[] } | { kind: "carry", held: T, at: At } | { kind: "box", from: At, to: At }} Motion
 */
/**
 * @template T
 * @typedef {{ kind: "click", at: At } | { kind: "pick", held: T } | { kind: "drop", held: T, at: At } | { kind: "box", from: At, to: At }} Gesture
 */

/** @template T */
export class Gestures {
  /** Fingers and pens that are down. @type {Map<number, At>} */
  #down = new Map();
  /** @type {{ from: At, at: At, held: T | null, pan: boolean, moved: boolean } | null} */
  #drag = null;

  /**
   * @param {number} pointer
   * @param {At} at
   * @param {{ pan: boolean, held: T | null }} how
   */
  press(pointer, at, { pan, held }) {
    this.#down.set(pointer, at);
    this.#drag = this.#down.size > 1 ? null : { from: at, at, held, pan, moved: false }; // two fingers zoom and pan
  }

  /**
   * @param {number} pointer
   * @param {At} at
   * @param {number} still distance up to which a press counts as a click
   * @returns {Motion<T> | null}
   */
  move(pointer, at, still) {
    if (this.#down.size > 1) return this.#pinch(pointer, at);
    const drag = this.#drag;
    if (!drag) return null;
    drag.moved ||= Math.hypot(at.x - drag.from.x, at.y - drag.from.y) > still;
    if (!drag.moved) return null;
    const by = { x: at.x - drag.at.x, y: at.y - drag.at.y };
    drag.at = at;
    if (drag.pan) return { kind: "pan", by };
    return drag.held ? { kind: "carry", held: drag.held, at } : { kind: "box", from: drag.from, to: at };
  }

  /**
   * @param {number} pointer
   * @param {At} at
   * @returns {Gesture<T> | null} the gesture; null at the end of a pan or a pinch
   */
  release(pointer, at) {
    const drag = this.#drag;
    this.forget(pointer);
    if (!drag || drag.pan) return null;
    const { held, moved, from } = drag;
    if (held) return moved ? { kind: "drop", held, at } : { kind: "pick", held };
    return moved ? { kind: "box", from, to: at } : { kind: "click", at };
  }

  /** Drop a pointer that left or was cancelled. @param {number} pointer */
  forget(pointer) {
    this.#down.delete(pointer);
    this.#drag = null;
  }

  /** The box being drawn. */
  get box() {
    const drag = this.#drag;
    return drag?.moved && !drag.pan && !drag.held ? { from: drag.from, to: drag.at } : null;
  }

  /**
   * @param {number} pointer that moved
   * @param {At} at
   * @returns {Motion<T>}
   */
  #pinch(pointer, at) {
    const before = [...this.#down.values()].slice(0, 2);
    this.#down.set(pointer, at);
    return { kind: "pinch", before, after: [...this.#down.values()].slice(0, 2) };
  }
}
