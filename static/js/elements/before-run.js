/** Warnings beside the run button: contradicting, missing and doubtful objects, each with a link to its frame. */

import { getLanes, getMasks, getOpenings, listFrames, listObjects } from "../api.js";
import { h } from "../dom.js";
import { framesToLook, spoiling } from "../lib/before-run.js";
import { contradictionsOn, shownOn } from "../lib/contradictions.js";
import { counted } from "../lib/format.js";
import { isComing } from "../lib/listing.js";

/** @typedef {import("../api-types").SceneObject} SceneObject */
/** @typedef {import("../lib/before-run.js").Told} Told */

export class BeforeRun {
  element = h("section", { class: "card stack", hidden: true, "aria-label": "Before the run" });

  /** Check the project's current masks and draw the warnings. @param {string} project @param {AbortSignal} signal */
  async look(project, signal) {
    const [objects, lanes, frames, openings] = await Promise.all([
      listObjects(project),
      getLanes(project),
      listFrames(project),
      getOpenings(project),
    ]);
    const widths = new Map(frames.map(({ index, width }) => [index, width]));
    const looked = await Promise.all(
      framesToLook(lanes).map(async (frame) => {
        const masks = (await getMasks(project, frame, signal)).flatMap(({ object, mask }) => {
          const known = objects.find(({ id }) => id === object);
          return known ? [{ object: known, mask }] : [];
        });
        const shown = await shownOn(masks, { index: frame, width: widths.get(frame) ?? 1 }, openings);
        return { frame, said: contradictionsOn(shown) };
      }),
    );
    if (!signal.aborted) this.#draw(project, objects, spoiling(objects, looked));
  }

  /**
   * @param {string} project
   * @param {SceneObject[]} objects
   * @param {Told[]} told
   */
  #draw(project, objects, told) {
    const names = new Map(objects.map(({ id, name }) => [id, name]));
    const lines = (/** @type {Told[]} */ all) =>
      h(
        "ul",
        {},
        ...all.map(({ object, frame, text }) => {
          const href = `/p/${project}/annotate?object=${object}${frame === null ? "" : `&frame=${frame}`}`;
          return h("li", {}, h("a", { href }, names.get(object) ?? ""), `: ${text}`);
        }),
      );
    const unsure = objects.flatMap(({ id, points, doubts }) =>
      doubts.map((text) => ({ object: id, frame: points[0]?.frame ?? null, text })),
    );
    const coming = objects.filter(isComing).length;
    this.element.hidden = !told.length && !unsure.length && !coming;
    this.element.replaceChildren(
      h("h2", {}, told.length ? "Fix this before the run" : "Before the run"),
      ...(told.length ? [lines(told)] : []),
      ...(coming
        ? [h("p", { class: "muted" }, `${counted(coming, "object")} still being found: the run finds the rest.`)]
        : []),
      ...(unsure.length
        ? [
            h(
              "details",
              {},
              h("summary", {}, `${counted(unsure.length, "doubt")} about sizes and edges`),
              lines(unsure),
            ),
          ]
        : []),
    );
  }
}
