/**
 * The masks of a project as they come: a frame's when it is asked for, an object's while it is being found.
 * Says "masks" {frame} when those of a frame changed (null: of many), "grown" {object} when one is seen on other frames than before,
 * "openings" when fronts were filmed to move otherwise than was known.
 */

import { getLanes, getMasks, getOpenings } from "../api.js";
import { detailOf } from "../dom.js";
import { say, sayError } from "../elements/toasts.js";
import { Meanwhile } from "../lib/meanwhile.js";
import { live } from "../live.js";
import { Masks } from "./masks.js";

/** @typedef {import("../api-types").FrameMask} FrameMask */
/** @typedef {{ object: number, restart: boolean, state: string, error: { message: string, hint: string } | null }} Told about an object being found */

export class LiveMasks extends EventTarget {
  project = "";
  stored = new Masks();
  /** @type {import("../api-types").Opening[]} how fronts were filmed to move */
  openings = [];
  #meanwhile = new Meanwhile();

  /** @param {AbortSignal} signal */
  listen(signal) {
    live.addEventListener("mask", (event) => this.#receive(detailOf(event)), { signal });
    live.addEventListener("segment", (event) => this.#told(detailOf(event)), { signal });
  }

  /** On which frames each object is seen; masks themselves are asked for frame by frame. */
  async load() {
    const both = Promise.all([getLanes(this.project), getOpenings(this.project)]);
    await this.#meanwhile.during(both, ([lanes, openings]) => {
      this.stored.fill(lanes);
      this.#open(openings);
    });
  }

  /**
   * Those of a frame, as they are stored.
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
