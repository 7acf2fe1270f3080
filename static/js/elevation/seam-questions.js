/** Questions to the user, one at a time, whether an uncertain edge is a seam; the answers change the front. */

import { say } from "../elements/toasts.js";
import { counted } from "../lib/format.js";
import * as plane from "../lib/elevation.js";
import * as rows from "../lib/front-rows.js";
import { drawnOf } from "./fronts.js";
import { Questions, swallowed, without } from "./questions.js";

/** @typedef {import("./fronts.js").Front} Front */
/** @typedef {import("./plane-view.js").Placed} Placed */
/** @typedef {import("./questions.js").Question} Question */
/** @typedef {import("../lib/elevation.js").Side} Side */

export class SeamQuestions {
  #questions = new Questions();
  /** Current question, answered by Y or X. @type {Question | null} */
  #asked = null;
  #view;
  #fronts;
  #edits;
  #redraw;

  /**
   * @param {import("./plane-view.js").PlaneView} view
   * @param {import("./fronts.js").Fronts} fronts
   * @param {import("./edits.js").FrontEdits} edits
   * @param {() => void} redraw
   */
  constructor(view, fronts, edits, redraw) {
    this.#view = view;
    this.#fronts = fronts;
    this.#edits = edits;
    this.#redraw = redraw;
  }

  /** @param {Placed[]} here @returns {Question[]} */
  open(here) {
    return this.#questions.open(here);
  }

  /** @param {import("../elevation/questions.js").Question[]} open */
  text(open) {
    const asked = open.find(({ key, side }) => key === this.#asked?.key && side === this.#asked.side);
    if (asked) {
      const name = this.#fronts.get(asked.key)?.name ?? "";
      const sure = `${Math.round(100 * asked.sure)} % sure`;
      return `Is there a seam at the ${asked.side} edge of ${name} (${sure})? Y: yes · X: no, the front goes on · Q: the next one`;
    }
    this.#asked = null;
    if (!open.length) return "";
    return `${counted(open.length, "edge")} hardly ${open.length > 1 ? "show" : "shows"}: Q asks whether there is a seam`;
  }

  /** Ask about the next edge. */
  ask() {
    const open = this.#questions.open(rows.inOrder(this.#view.here));
    const at = open.findIndex(({ key, side }) => key === this.#asked?.key && side === this.#asked.side);
    const next = open[(at + 1) % open.length];
    if (!next) return say("No edge here is unsure.");
    this.#asked = next;
    return this.#edits.pick(next.key, next.side, false);
  }

  /** @param {boolean} isSeam whether there is a seam at the edge */
  answer(isSeam) {
    const front = this.#view.here.find(({ key }) => key === this.#asked?.key);
    const kept = front && this.#fronts.get(front.key);
    if (!front || !kept || !this.#asked) return say("Q asks about an edge first.");
    const answers = this.#questions.answer(kept, this.#asked.side, isSeam);
    if (answers) this.#settle(front, kept, answers);
    if (this.#questions.open(this.#view.here).length) return this.ask();
    this.#asked = null;
    return this.#redraw();
  }

  /** Draw a front by its answers. @param {Placed} front @param {Front} kept @param {Map<Side, boolean>} answers */
  #settle(front, kept, answers) {
    const elevation = this.#view.elevation;
    if (!elevation) return;
    const others = this.#view.here.filter(({ key }) => key !== front.key);
    const goesOn = [...answers].filter(([, isSeam]) => !isSeam).map(([side]) => side);
    const rect = goesOn.reduce((grown, side) => {
      const found = without(
        grown,
        side,
        others.map((other) => other.rect),
        this.#view.profile(side, grown),
      );
      if (!found) say(`No other line beyond the ${side} edge: drag it to where the front ends.`);
      return found ?? grown;
    }, front.rect);
    const remove = goesOn.length ? swallowed(others, rect) : [];
    const handle = plane.handleAfter(kept.handle ?? null, front.rect, rect);
    const wanted = { front: { ...drawnOf(kept), corners_m: plane.cornersOf(elevation, rect), handle } };
    this.#fronts.do({ change: [{ front: kept, wanted }], remove });
  }
}
