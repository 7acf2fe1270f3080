/**
 * Masks of a project, loaded per frame on request and received live while an object is being segmented.
 * Emits "masks" {frame} when the masks of a frame changed (null: of many frames), "grown" {object} when the frames on which an
 * object is visible changed, "openings" when the filmed movements of fronts changed.
 */

import { getLanes, getMasks, getOpenings } from "../api.js";
import { detailOf } from "../dom.js";
import { say, sayError } from "../elements/toasts.js";
import { Meanwhile } from "../lib/meanwhile.js";
import { live } from "../live.js";
import { Masks } from "./masks.js";

/** @typedef {import("../api-types").FrameMask} FrameMask */
/**
 * Message about an object being segmented.
 * @typedef {{ object: number, restart: boolean, state: string, error: { message: string, hint: string } | null }} Told
 */

export class LiveMasks extends EventTarget {
  project = "";
  stored = new Masks();
  /** @type {import("../api-types").Opening[]} movements of fronts in the recording */
  openings = [];
  #meanwhile = new Meanwhile();

  /** @param {AbortSignal} signal */
  listen(signal) {
    live.addEventListener("mask", (event) => this.#receive(detailOf(event)), { signal });
    live.addEventListener("segment", (event) => this.#told(detailOf(event)), { signal });
  }

  /** Load the openings and the frames on which each object is visible; masks are loaded per frame by `fetch`. */
  async load() {
    const both = Promise.all([getLanes(this.project), getOpenings(this.project)]);
    await this.#meanwhile.during(both, ([lanes, openings]) => {
      this.stored.fill(lanes);
      this.#open(openings);
    });
  }

  /**
   * Load the stored masks of a frame.
   * @param {number} frame
   * @param {AbortSignal} signal
   */
  async fetch(frame, signal) {
    try {
      for (const mask of await getMasks(this.project, frame, signal)) this.stored.keep(mask);
      this.#say("masks", { frame });
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {number} object */
  forget(object) {
    this.stored.forget(object);
  }

  /** @param {FrameMask} mask */
  #receive(mask) {
    this.#meanwhile.take(() => this.stored.receive(mask));
    this.#say("masks", { frame: mask.frame });
    this.#say("grown", { object: mask.object });
  }

  /** @param {import("../api-types").Opening[]} openings */
  #open(openings) {
    if (!openings.length && !this.openings.length) return;
    this.openings = openings;
    this.#say("openings");
  }

  /** @param {Told} told */
  #told({ object, restart, state, error }) {
    if (state === "done") getOpenings(this.project).then((openings) => this.#open(openings), sayError);
    if (restart) {
      this.#meanwhile.take(() => this.stored.restart(object));
      this.#say("masks", { frame: null });
    }
    if (error) say(error.message, { kind: "bad", hint: error.hint });
    this.#say("grown", { object });
  }

  /**
   * @param {string} type
   * @param {object} [detail]
   */
  #say(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}
