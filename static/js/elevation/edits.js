/** Edits of the fronts on the open plane: draw, move, split, repeat, name and more. Each call is one undo step. */

import { say } from "../elements/toasts.js";
import * as plane from "../lib/elevation.js";
import * as rows from "../lib/front-rows.js";
import { outbox } from "../outbox.js";
import { drawnOf } from "./fronts.js";

/** @typedef {import("./fronts.js").Front} Front */
/** @typedef {import("./plane-view.js").Placed} Placed */
/** @typedef {import("../lib/elevation.js").Rect} Rect */
/** @typedef {import("../lib/elevation.js").Side} Side */
/** @typedef {import("../lib/front-rows.js").Way} Way */

const NEW_M = { width: 0.6, height: 0.72 }; // of a front added by keyboard
const STEP_M = { usual: 0.01, fine: 0.001 };

export class FrontEdits {
  #view;
  #fronts;
  #canvas;

  /**
   * @param {import("./plane-view.js").PlaneView} view
   * @param {import("./fronts.js").Fronts} fronts
   * @param {import("../elements/elevation-canvas.js").ElevationCanvas} canvas
   */
  constructor(view, fronts, canvas) {
    this.#view = view;
    this.#fronts = fronts;
    this.#canvas = canvas;
  }

  /** @param {string | null} key @param {Side | null} side @param {boolean} also */
  pick(key, side, also) {
    this.#canvas.edge = side;
    this.#fronts.choose(key, also);
  }

  /** @param {Rect} rect @returns {Front | undefined} */
  add(rect) {
    const elevation = this.#view.elevation;
    if (!elevation) return undefined;
    const category = plane.likelyCategory(rect, elevation.top_m);
    const [made] = this.#fronts.do({ make: [{ category, corners: plane.cornersOf(elevation, rect) }] });
    this.pick(made?.key ?? null, null, false);
    return made;
  }

  /** @param {string} key @param {Rect} rect */
  place(key, rect) {
    const front = this.#fronts.get(key);
    const elevation = this.#view.elevation;
    const before = elevation && front && plane.rectOf(elevation, front.corners);
    if (!before) return;
    this.#fronts.choose(key);
    const handle = plane.handleAfter(front.handle ?? null, before, rect);
    const corners_m = plane.cornersOf(elevation, rect);
    front.seen = front.seen && plane.seenAfter(front.seen, before, rect); // until it is detected again
    this.#fronts.do({ change: [{ front, wanted: { front: { ...drawnOf(front), corners_m, handle } } }] });
  }

  /** Change chosen fronts as one gesture. @param {(front: Front) => import("../elevation/fronts.js").Wanted | false} want */
  change(want) {
    const change = this.#fronts.chosen.flatMap((front) => {
      const wanted = want(front);
      return wanted ? [{ front, wanted }] : [];
    });
    if (change.length) this.#fronts.do({ change });
  }

  /** Resize the leading front at its chosen edge, or at the one that is less certain. @param {"width" | "height"} side @param {number} metres */
  resize(side, metres) {
    const front = this.#view.leading();
    if (!front || !(metres >= plane.SMALLEST_M)) return;
    const others = this.#view.here.filter(({ key }) => key !== front.key).map(({ rect }) => rect);
    const sure = front.drawn ? [] : front.edges;
    this.place(front.key, plane.resized(front.rect, side, metres, { chosen: this.#canvas.edge, sure, others }));
  }

  /** @param {Way} way @param {{ x: number, y: number }} [at] */
  split(way, at = this.#aim()) {
    const front = this.#view.at(at);
    if (!front || !at) return say("Choose a front first, or point at one.");
    const side = way === "upright" ? "left" : "top";
    const parts = plane.split(
      front.rect,
      way,
      this.#view.snap(side, way === "upright" ? at.x : at.y, front.rect, front.key, this.#canvas.reach),
    );
    if (!parts) return say("There is no room for a seam there.");
    return this.#part(front, way, parts);
  }

  /** Divide the leading front by typed sizes. @param {Way} way @param {string} text */
  divide(way, text) {
    const front = this.#view.leading();
    const parts = front && rows.divided(front.rect, way, text);
    if (parts) this.#part(front, way, parts);
    else say(`“${text}” does not fit: type 3 for equal parts, or sizes in mm as 600 450 600; / 3 leaves 3 mm between.`);
  }

  /**
   * Replace a front by its parts: the first keeps the name, the last is chosen.
   * @param {Front} front
   * @param {Way} way
   * @param {Rect[]} parts
   */
  #part(front, way, parts) {
    const elevation = this.#view.elevation;
    const kept = this.#fronts.get(front.key);
    if (!elevation || !kept) return;
    /** @type {"none" | null} */
    const handle = kept.handle === "none" ? "none" : null; // its position does not fit any of the parts
    const [first, ...others] = parts.map((rect) => ({
      category: way === "level" ? plane.likelyCategory(rect, elevation.top_m) : front.category,
      corners: plane.cornersOf(elevation, rect),
      handle,
    }));
    if (!first) return;
    const wanted = {
      front: { ...drawnOf(kept), corners_m: first.corners, handle },
      ...(first.category === front.category ? {} : { category: first.category }),
    };
    const made = this.#fronts.do({ change: [{ front: kept, wanted }], make: others });
    this.pick(made.at(-1)?.key ?? null, null, false);
  }

  /** Add a front beside the leading one, of the same size and snapped to nearby lines. @param {Way} way */
  repeat(way) {
    const elevation = this.#view.elevation;
    const front = this.#view.leading();
    if (!elevation || !front) return say("Choose a front first.");
    const rect = this.#canvas.settled(rows.again(front.rect, way));
    const { category, handle, hinge } = front;
    const corners = plane.cornersOf(elevation, rect);
    const [made] = this.#fronts.do({ make: [{ category, corners, handle: handle === "none" ? "none" : null, hinge }] });
    return this.pick(made?.key ?? null, null, false);
  }

  /**
   * Rename the chosen fronts; several are numbered from left to right and top to bottom.
   * @param {string} name
   * @param {Front | null} seen the leading front as it was when typing began
   */
  async name(name, seen) {
    const chosen = new Set(this.#fronts.chosen.map(({ key }) => key));
    await outbox.settled; // new fronts get their names from the server
    const mine = rows.inOrder(this.#view.here.filter(({ key }) => chosen.has(key)));
    const taken = this.#fronts.all.filter(({ key }) => !chosen.has(key)).map((front) => front.name);
    const change = rows.renamed(mine, name, taken).flatMap(({ key, name }) => {
      const front = this.#fronts.get(key);
      return front ? [{ front, wanted: { name }, ...(seen?.key === key && seen.id !== null ? { seen } : {}) }] : [];
    });
    this.#fronts.do({ change });
  }

  /** @param {Rect} rect */
  chooseWithin(rect) {
    const within = this.#view.here.filter((front) => plane.holds(rect, plane.middleOf(front.rect)));
    this.#fronts.chooseAll(rows.inOrder(within).map(({ key }) => key));
  }

  merge() {
    const elevation = this.#view.elevation;
    const rects = new Map(this.#view.here.map(({ key, rect }) => [key, rect]));
    const [first, ...others] = this.#fronts.chosen.filter(({ key }) => rects.has(key));
    const before = first && rects.get(first.key);
    if (!elevation || !before || !others.length) return say("Choose two fronts first: Shift-click adds one.");
    const rect = plane.around([before, ...others.map(({ key }) => rects.get(key) ?? before)]);
    const handle = plane.handleAfter(first.handle ?? null, before, rect);
    const corners_m = plane.cornersOf(elevation, rect);
    this.#fronts.do({
      change: [{ front: first, wanted: { front: { ...drawnOf(first), corners_m, handle } } }],
      remove: others,
    });
    return this.pick(first.key, null, false);
  }

  /** @param {{ x: number, y: number }} at */
  setHandle(at) {
    const front = this.#view.at(at);
    const kept = front && this.#fronts.get(front.key);
    if (!front || !kept) return;
    this.pick(front.key, null, false);
    this.#fronts.do({
      change: [{ front: kept, wanted: { front: { ...drawnOf(kept), handle: plane.handleAt(front.rect, at) } } }],
    });
  }

  /** Copy handle and hinge of the front chosen last to the other chosen ones, as one gesture. */
  copyToOthers() {
    const from = this.#view.leading();
    const elevation = this.#view.elevation;
    if (!from || !elevation || this.#fronts.chosen.length < 2)
      return say("Choose several fronts: handle and hinge of the last one are copied to the others.");
    const handle = from.handle ?? from.seen;
    this.change((front) => {
      const rect = plane.rectOf(elevation, front.corners);
      if (front.key === from.key || !rect) return false;
      const drawn = handle && handle !== "none" ? plane.handleLike(handle, from.rect, rect) : handle;
      return { front: { ...drawnOf(front), hinge: from.hinge, handle: drawn } };
    });
  }

  /**
   * Set the hinge to the side nearest to a position; if it is there already, clear it.
   * @param {{ x: number, y: number }} at
   */
  setHinge(at) {
    const front = this.#view.at(at);
    const kept = front && this.#fronts.get(front.key);
    if (!front || !kept) return;
    this.pick(front.key, null, false);
    const { side } = plane.nearestEdge(front.rect, at);
    const hinge = kept.hinge === side ? null : side;
    this.#fronts.do({ change: [{ front: kept, wanted: { front: { ...drawnOf(kept), hinge } } }] });
  }

  turnHinge() {
    /** @type {(Side | null)[]} */
    const round = [null, "left", "right", "top", "bottom"];
    this.change((front) => {
      const hinge = round[(round.indexOf(front.hinge ?? null) + 1) % round.length] ?? null;
      return { front: { ...drawnOf(front), hinge } };
    });
  }

  remove() {
    const { chosen } = this.#fronts;
    if (!chosen.length) return;
    this.#fronts.do({ remove: chosen });
    say(`Deleted ${chosen.map(({ name }) => name).join(", ")}; undo brings it back`);
  }

  adopt() {
    const elevation = this.#view.elevation;
    if (!elevation) return;
    const make = this.#view.cut(this.#view.here).map((rect) => ({
      category: plane.likelyCategory(rect, elevation.top_m),
      corners: plane.cornersOf(elevation, rect),
    }));
    if (make.length) this.#fronts.do({ make });
    else say("Every panel cut here has a front already.");
  }

  addByKey() {
    const { x, y } = this.#aim() ?? this.#canvas.middle;
    const { width, height } = NEW_M;
    this.add({ left: x - width / 2, right: x + width / 2, top: y - height / 2, bottom: y + height / 2 });
  }

  /** @param {string} key @param {boolean} coarse */
  nudge(key, coarse) {
    const step = coarse ? STEP_M.usual : STEP_M.fine;
    const dx = key === "ArrowLeft" ? -step : key === "ArrowRight" ? step : 0;
    const dy = key === "ArrowUp" ? -step : key === "ArrowDown" ? step : 0;
    const front = this.#view.leading();
    if (!front) return;
    const { edge } = this.#canvas;
    const by = edge === "left" || edge === "right" ? dx : dy;
    this.place(
      front.key,
      edge ? plane.withEdge(front.rect, edge, front.rect[edge] + by) : plane.moved(front.rect, dx, dy),
    );
  }

  nextEdge() {
    const sides = [null, ...plane.SIDES];
    this.#canvas.edge = sides[(sides.indexOf(this.#canvas.edge) + 1) % sides.length] ?? null;
    this.#canvas.draw();
    say(this.#canvas.edge ? `Arrows move the ${this.#canvas.edge} edge` : "Arrows move the front");
  }

  /** @param {1 | -1} way */
  next(way) {
    const here = rows.inOrder(this.#view.here);
    const at = here.findIndex(({ key }) => key === this.#fronts.leading?.key);
    const next = here[(at + way + here.length) % here.length];
    if (next) this.pick(next.key, this.#canvas.edge, false);
  }

  /** Position a key applies to: the pointer, else the middle of the leading front. */
  #aim() {
    const front = this.#view.leading();
    return this.#canvas.pointer ?? (front ? plane.middleOf(front.rect) : undefined);
  }
}
