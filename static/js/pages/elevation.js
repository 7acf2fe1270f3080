/** Fronts drawn to scale on the planes of the scan: what the clicks found is set right here, and what is drawn is used as it is. */

import * as api from "../api.js";
import { SegmenterChip } from "../annotate/segmenter-chip.js";
import { detailOf, h, icon, LiveElement, segments } from "../dom.js";
import { ElevationCanvas } from "../elements/elevation-canvas.js";
import { say, sayError } from "../elements/toasts.js";
import { FrontPane } from "../elevation/front-pane.js";
import { drawnOf, Fronts } from "../elevation/fronts.js";
import { Questions, swallowed, without } from "../elevation/questions.js";
import { PlaneList } from "../elevation/plane-list.js";
import { Commands, isForPage } from "../keyboard.js";
import * as plane from "../lib/elevation.js";
import { counted } from "../lib/format.js";
import * as rows from "../lib/front-rows.js";
import { live } from "../live.js";
import { outbox } from "../outbox.js";
import { remember } from "../router.js";

/** @typedef {import("../api-types").Elevation} Elevation */
/** @typedef {import("../elevation/fronts.js").Front} Front */
/** @typedef {import("../lib/elevation.js").Rect} Rect */
/** @typedef {import("../lib/elevation.js").Side} Side */
/** @typedef {import("../lib/front-rows.js").Way} Way */
/** @typedef {"seam" | "level-seam" | "handle" | "hinge"} Tool */
/** @typedef {Front & { rect: Rect }} Placed */

const NEW_M = { width: 0.6, height: 0.72 }; // of a front that is added by keyboard
const STEP_M = { usual: 0.01, fine: 0.001 };
const EMPTY =
  "Drag over a front to draw it; its edges snap to lines. S splits it at the pointer, D divides it, R repeats it, W types its width.";
/** @type {[Tool, string, string][]} */
const TOOLS = [
  ["seam", "Seam │", "Click a front: an upright seam there (S at the pointer)"],
  ["level-seam", "Seam ─", "Click a front: a level seam there (Shift S at the pointer)"],
  ["handle", "Handle", "Click where the handle is (K at the pointer)"],
  ["hinge", "Hinge", "Click near the side it turns on (J at the pointer)"],
];

export class ElevationPage extends LiveElement {
  project = "";
  query = new URLSearchParams();
  #fronts = new Fronts();
  #questions = new Questions();
  /** The one that Y and X answer. @type {import("../elevation/questions.js").Question | null} */
  #asked = null;
  #planes = new PlaneList();
  #pane = new FrontPane();
  #canvas = new ElevationCanvas();
  #segmenter = new SegmenterChip();
  #saved = h("span", { class: "chip", role: "status" });
  #tip = h("p", { class: "tip" });
  #tools = h("div");
  /** @type {Elevation | null} */
  #elevation = null;
  /** @type {{ upright: ReturnType<typeof plane.decoded>, level: ReturnType<typeof plane.decoded> } | null} */
  #lines = null;
  /** @type {string[]} */
  #palette = ["#e69f00"];
  /** @type {Tool | null} */
  #tool = null;
  #commands = new Commands("elevation", this.#actions(), [
    "front-here",
    "seam",
    "level-seam",
    "merge",
    "is-seam",
    "no-seam",
  ]);

  connected() {
    this.#fronts.project = this.project;
    const button = (/** @type {string} */ name, /** @type {string} */ label) => {
      const made = h("button", { type: "button", "aria-label": label, title: label, onClick: () => this.act(name) });
      made.append(icon(name));
      return made;
    };
    this.#tools = segments(
      "What a click does",
      ...TOOLS.map(([tool, text, title]) =>
        h(
          "button",
          { type: "button", title, "aria-pressed": "false", "data-tool": tool, onClick: () => this.#use(tool) },
          text,
        ),
      ),
    );
    const bar = h(
      "div",
      { class: "stage-tools" },
      this.#segmenter.element,
      this.#saved,
      h("span", { class: "spring" }),
      this.#tools,
      segments("Last change", button("undo", "Undo"), button("redo", "Redo")),
    );
    const stage = h("section", { class: "stage", "aria-label": "Elevation" }, this.#canvas, bar, this.#tip);
    this.replaceChildren(h("div", { class: "elevation" }, this.#planes.element, stage, this.#pane.element));
    this.#canvas.snap = (side, at, rect, key, reach) => this.#snap(side, at, rect, key, reach);
    this.#listen();
    this.#load();
  }

  /** @param {string} action */
  act(action) {
    this.#commands.act(action);
  }

  #listen() {
    const { signal } = this;
    /** @param {EventTarget} target @param {string} type @param {(detail: any) => void} act */
    const on = (target, type, act) => target.addEventListener(type, (event) => act(detailOf(event)), { signal });
    on(this.#canvas, "draw", (rect) => this.#add(rect));
    on(this.#canvas, "move", ({ key, rect }) => this.#place(key, rect));
    on(this.#canvas, "pick", ({ key, side, also }) => this.#pick(key, side, also));
    on(this.#canvas, "enclose", (rect) => this.#chooseWithin(rect));
    on(this.#canvas, "use-tool", (at) => this.#useTool(at));
    on(this.#planes, "choose", (id) => this.#open(id));
    on(this.#fronts, "change", () => this.#draw());
    on(this.#fronts, "choose", () => this.#draw());
    on(this.#fronts, "refused", () => this.#reload().catch(sayError));
    on(
      this.#fronts,
      "saved",
      ({ text, tone }) => ((this.#saved.textContent = text), (this.#saved.className = `chip ${tone}`)),
    );
    on(this.#pane, "choose", (key) => this.#pick(key, null, false));
    on(this.#pane, "size", ({ side, metres }) => this.#resize(side, metres));
    on(this.#pane, "category", (category) => this.#change((front) => front.category !== category && { category }));
    on(this.#pane, "name", (name) => this.#name(name));
    on(this.#pane, "divide", ({ way, text }) => this.#divide(way, text));
    on(this.#pane, "next", () => this.#next(1));
    on(this.#pane, "hinge", (hinge) =>
      this.#change((front) => front.hinge !== hinge && { front: { ...drawnOf(front), hinge } }),
    );
    on(this.#pane, "handle", (/** @type {"none" | null} */ handle) =>
      this.#change((front) => ({ front: { ...drawnOf(front), handle } })),
    );
    on(this.#pane, "adopt", () => this.act("adopt-cut"));
    on(live, "live", ({ status }) => {
      this.#segmenter.show(status);
      if (status.state === "ready") this.#reload(true).catch(sayError); // the planes may be others now
    });
    on(live, "object", ({ object }) => object.project === this.project && (this.#fronts.take(object), this.#draw()));
    on(live, "segment", ({ state }) => state === "done" && this.#reload().catch(sayError));
    on(outbox, "caught-up", () => this.#reload().catch(sayError));
    document.addEventListener("keydown", (event) => isForPage(event) && this.#commands.press(event), { signal });
  }

  async #load() {
    this.#tell("Loading the planes…");
    try {
      const [system] = await Promise.all([api.getSystem(), this.#segmenter.open(api.openLive(this.project))]);
      this.#palette = system.palette;
      this.#pane.setCategories(system.categories);
      await this.#reload();
    } catch (error) {
      this.#tell(error instanceof Error ? error.message : String(error));
      sayError(error);
    }
  }

  #loading = Promise.resolve();

  /** One after the other: masks of many fronts end at once. @param {boolean} [anew] */
  #reload(anew = false) {
    const load = () => this.#loadNow(anew);
    this.#loading = this.#loading.then(load, load);
    return this.#loading;
  }

  /** @param {boolean} anew the planes too */
  async #loadNow(anew) {
    const [objects, found, planes] = await Promise.all([
      api.listObjects(this.project),
      api.getFoundFronts(this.project),
      this.#planes.items.length && !anew ? null : api.getElevations(this.project),
    ]);
    if (this.signal.aborted) return;
    this.#fronts.fill(objects, found);
    if (!planes) return;
    if (!planes.drawn)
      return this.#tell("The planes appear once the scan is prepared; until then you can click in Annotate.");
    if (!planes.items.length) return this.#tell("No flat upright part of this scan is large enough to hold a front.");
    const same = this.#planes.items[0]?.url === planes.items[0]?.url;
    if (same) return this.#draw();
    this.#planes.fill(planes.items);
    this.#open(this.#elevation?.id ?? Number(this.query.get("plane") ?? planes.items[0]?.id));
  }

  /** @param {number} id */
  #open(id) {
    const chosen = this.#planes.items.find((one) => one.id === id) ?? this.#planes.items[0];
    if (!chosen) return;
    const image = new Image();
    image.addEventListener("load", () => {
      if (this.#elevation !== chosen) return;
      const { width, height } = plane.sizeOf(chosen);
      this.#canvas.setPlane(image, chosen.cell_m, `Plane of ${width.toFixed(2)} × ${height.toFixed(2)} m`);
      this.#draw();
    });
    image.src = chosen.url;
    this.#elevation = chosen;
    this.#lines = { upright: plane.decoded(chosen.upright), level: plane.decoded(chosen.level) };
    this.#planes.choose(chosen.id);
    this.#fronts.choose(null);
    remember({ plane: chosen.id });
  }

  // What is shown

  /** The fronts on the plane that is looked at. @returns {Placed[]} */
  get #here() {
    const elevation = this.#elevation;
    if (!elevation) return [];
    return this.#fronts.all.flatMap((front) => {
      const rect = plane.rectOf(elevation, front.corners);
      return rect ? [{ ...front, rect }] : [];
    });
  }

  /** Panels that were cut and no front is on. @param {Placed[]} here @returns {Rect[]} */
  #cut(here) {
    const { cells = [], cell_m = 1 } = this.#elevation ?? {};
    const rects = cells.map(([left = 0, top = 0, right = 0, bottom = 0]) => ({
      left: left * cell_m,
      top: top * cell_m,
      right: right * cell_m,
      bottom: bottom * cell_m,
    }));
    return rects.filter((rect) => !here.some((front) => plane.overlap(front.rect, rect)));
  }

  #draw() {
    const here = this.#here;
    const chosen = new Set(this.#fronts.chosen.map(({ key }) => key));
    const cut = this.#cut(here);
    const open = this.#questions.open(here);
    const shown = here.map((front) => ({
      ...front,
      paint: this.#paint(front),
      chosen: chosen.has(front.key),
      handle: front.handle === "none" ? null : (front.handle ?? front.seen),
      hinge: front.hinge ?? null,
      slides: this.#pane.slides(front.category),
      asked: open.filter(({ key }) => key === front.key).map(({ side }) => side),
      overlaps: here.some((other) => other.key !== front.key && plane.overlap(other.rect, front.rect)),
    }));
    this.#canvas.setFronts(shown, cut);
    this.#pane.show(here, {
      leading: this.#leading(here),
      chosen,
      cut: cut.length,
      paint: (front) => this.#paint(front),
    });
    this.#planes.count(this.#fronts.all.map(({ corners }) => corners));
    if (this.#elevation) this.#tell(here.length ? this.#questionText(open) : EMPTY);
  }

  /** @param {import("../elevation/questions.js").Question[]} open */
  #questionText(open) {
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

  /** The next edge to be asked about. */
  #ask() {
    const open = this.#questions.open(rows.inOrder(this.#here));
    const at = open.findIndex(({ key, side }) => key === this.#asked?.key && side === this.#asked.side);
    const next = open[(at + 1) % open.length];
    if (!next) return say("No edge here is unsure.");
    this.#asked = next;
    return this.#pick(next.key, next.side, false);
  }

  /** @param {boolean} isSeam whether there is one at the edge asked about */
  #answer(isSeam) {
    const front = this.#here.find(({ key }) => key === this.#asked?.key);
    const kept = front && this.#fronts.get(front.key);
    if (!front || !kept || !this.#asked) return say("Q asks about an edge first.");
    const answers = this.#questions.answer(kept, this.#asked.side, isSeam);
    if (answers) this.#settle(front, kept, answers);
    if (this.#questions.open(this.#here).length) return this.#ask();
    this.#asked = null;
    return this.#draw();
  }

  /** The front as it was answered, drawn from now on. @param {Placed} front @param {Front} kept @param {Map<Side, boolean>} answers */
  #settle(front, kept, answers) {
    const elevation = this.#elevation;
    if (!elevation) return;
    const others = this.#here.filter(({ key }) => key !== front.key);
    const goesOn = [...answers].filter(([, isSeam]) => !isSeam).map(([side]) => side);
    const rect = goesOn.reduce((grown, side) => {
      const found = without(
        grown,
        side,
        others.map((other) => other.rect),
        this.#profile(side, grown),
      );
      if (!found) say(`No other line beyond the ${side} edge: drag it to where the front ends.`);
      return found ?? grown;
    }, front.rect);
    const remove = goesOn.length ? swallowed(others, rect) : [];
    const handle = plane.handleAfter(kept.handle ?? null, front.rect, rect);
    const wanted = { front: { ...drawnOf(kept), corners_m: plane.cornersOf(elevation, rect), handle } };
    this.#fronts.do({ change: [{ front: kept, wanted }], remove });
  }

  /** How clearly lines along one side's direction show beside a front. @param {Side} side @param {Rect} rect */
  #profile(side, rect) {
    const upright = side === "left" || side === "right";
    const [from, to] = upright ? [rect.top, rect.bottom] : [rect.left, rect.right];
    const lines = upright ? this.#lines?.upright : this.#lines?.level;
    return lines ? plane.profileOf(lines, this.#elevation?.cell_m ?? 1, from, to) : null;
  }

  /** @param {Front} front */
  #paint({ colour }) {
    return this.#palette[colour % this.#palette.length] ?? "#e69f00";
  }

  /** @param {string} text */
  #tell(text) {
    this.#tip.hidden = !text;
    this.#tip.textContent = text;
  }

  /** @param {Placed[]} here */
  #leading(here = this.#here) {
    return here.find(({ key }) => key === this.#fronts.leading?.key) ?? null;
  }

  // What is done

  /** @param {string | null} key @param {Side | null} side @param {boolean} also */
  #pick(key, side, also) {
    this.#canvas.edge = side;
    this.#fronts.choose(key, also);
  }

  /** @param {Rect} rect @returns {Front | undefined} */
  #add(rect) {
    const elevation = this.#elevation;
    if (!elevation) return undefined;
    const category = plane.likelyCategory(rect, elevation.top_m);
    const [made] = this.#fronts.do({ make: [{ category, corners: plane.cornersOf(elevation, rect) }] });
    this.#pick(made?.key ?? null, null, false);
    return made;
  }

  /** @param {string} key @param {Rect} rect */
  #place(key, rect) {
    const front = this.#fronts.get(key);
    const elevation = this.#elevation;
    const before = elevation && front && plane.rectOf(elevation, front.corners);
    if (!before) return;
    this.#fronts.choose(key);
    const handle = plane.handleAfter(front.handle ?? null, before, rect);
    const corners_m = plane.cornersOf(elevation, rect);
    this.#fronts.do({ change: [{ front, wanted: { front: { ...drawnOf(front), corners_m, handle } } }] });
  }

  /** All chosen fronts, as one gesture. @param {(front: Front) => import("../elevation/fronts.js").Wanted | false} want */
  #change(want) {
    const change = this.#fronts.chosen.flatMap((front) => {
      const wanted = want(front);
      return wanted ? [{ front, wanted }] : [];
    });
    if (change.length) this.#fronts.do({ change });
  }

  /** Its left or upper edge stays. @param {"width" | "height"} side @param {number} metres */
  #resize(side, metres) {
    const front = this.#leading();
    if (!front || !(metres >= plane.SMALLEST_M)) return;
    const { left, top } = front.rect;
    const rect = side === "width" ? { ...front.rect, right: left + metres } : { ...front.rect, bottom: top + metres };
    this.#place(front.key, rect);
  }

  /** @param {Way} way @param {{ x: number, y: number }} [at] */
  #split(way, at = this.#aim()) {
    const front = this.#at(at);
    if (!front || !at) return say("Choose a front first, or point at one.");
    const side = way === "upright" ? "left" : "top";
    const parts = plane.split(
      front.rect,
      way,
      this.#snap(side, way === "upright" ? at.x : at.y, front.rect, front.key, this.#canvas.reach),
    );
    if (!parts) return say("There is no room for a seam there.");
    return this.#part(front, way, parts);
  }

  /** By sizes that were typed. @param {Way} way @param {string} text */
  #divide(way, text) {
    const front = this.#leading();
    const parts = front && rows.divided(front.rect, way, text);
    if (parts) this.#part(front, way, parts);
    else say(`“${text}” does not fit: type 3 for equal parts, or sizes in mm as 600 450 600; / 3 leaves 3 mm between.`);
  }

  /** The first part keeps its name; the last one is chosen. @param {Front} front @param {Way} way @param {Rect[]} parts */
  #part(front, way, parts) {
    const elevation = this.#elevation;
    const kept = this.#fronts.get(front.key);
    if (!elevation || !kept) return;
    /** @type {"none" | null} */
    const handle = kept.handle === "none" ? "none" : null; // where it was is the middle of none of the parts
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
    this.#pick(made.at(-1)?.key ?? null, null, false);
  }

  /** As large as the chosen one, moved onto the lines that are near. @param {Way} way */
  #repeat(way) {
    const elevation = this.#elevation;
    const front = this.#leading();
    if (!elevation || !front) return say("Choose a front first.");
    const rect = this.#canvas.settled(rows.again(front.rect, way));
    const { category, handle, hinge } = front;
    const corners = plane.cornersOf(elevation, rect);
    const [made] = this.#fronts.do({ make: [{ category, corners, handle: handle === "none" ? "none" : null, hinge }] });
    return this.#pick(made?.key ?? null, null, false);
  }

  /** Several are numbered, from left to right and from the top down. @param {string} name */
  async #name(name) {
    const chosen = new Set(this.#fronts.chosen.map(({ key }) => key));
    await outbox.settled; // until then nobody knows what new ones are called
    const mine = rows.inOrder(this.#here.filter(({ key }) => chosen.has(key)));
    const taken = this.#fronts.all.filter(({ key }) => !chosen.has(key)).map((front) => front.name);
    const change = rows.renamed(mine, name, taken).flatMap(({ key, name }) => {
      const front = this.#fronts.get(key);
      return front ? [{ front, wanted: { name } }] : [];
    });
    this.#fronts.do({ change });
  }

  /** @param {Rect} rect */
  #chooseWithin(rect) {
    const within = this.#here.filter((front) => plane.holds(rect, plane.middleOf(front.rect)));
    this.#fronts.chooseAll(rows.inOrder(within).map(({ key }) => key));
  }

  #merge() {
    const elevation = this.#elevation;
    const rects = new Map(this.#here.map(({ key, rect }) => [key, rect]));
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
    return this.#pick(first.key, null, false);
  }

  /** @param {{ x: number, y: number }} at */
  #setHandle(at) {
    const front = this.#at(at);
    const kept = front && this.#fronts.get(front.key);
    if (!front || !kept) return;
    this.#pick(front.key, null, false);
    this.#fronts.do({
      change: [{ front: kept, wanted: { front: { ...drawnOf(kept), handle: plane.handleAt(front.rect, at) } } }],
    });
  }

  /** The side nearest to a position, none where it is that already. @param {{ x: number, y: number }} at */
  #setHinge(at) {
    const front = this.#at(at);
    const kept = front && this.#fronts.get(front.key);
    if (!front || !kept) return;
    this.#pick(front.key, null, false);
    const { side } = plane.nearestEdge(front.rect, at);
    const hinge = kept.hinge === side ? null : side;
    this.#fronts.do({ change: [{ front: kept, wanted: { front: { ...drawnOf(kept), hinge } } }] });
  }

  #turnHinge() {
    /** @type {(Side | null)[]} */
    const round = [null, "left", "right", "top", "bottom"];
    this.#change((front) => {
      const hinge = round[(round.indexOf(front.hinge ?? null) + 1) % round.length] ?? null;
      return { front: { ...drawnOf(front), hinge } };
    });
  }

  #remove() {
    const { chosen } = this.#fronts;
    if (!chosen.length) return;
    this.#fronts.do({ remove: chosen });
    say(`Deleted ${chosen.map(({ name }) => name).join(", ")}; undo brings it back`);
  }

  #adopt() {
    const elevation = this.#elevation;
    if (!elevation) return;
    const make = this.#cut(this.#here).map((rect) => ({
      category: plane.likelyCategory(rect, elevation.top_m),
      corners: plane.cornersOf(elevation, rect),
    }));
    if (make.length) this.#fronts.do({ make });
    else say("No panel was cut here that has no front yet.");
  }

  #addByKey() {
    const { x, y } = this.#aim() ?? this.#canvas.middle;
    const { width, height } = NEW_M;
    this.#add({ left: x - width / 2, right: x + width / 2, top: y - height / 2, bottom: y + height / 2 });
  }

  /** @param {string} key @param {boolean} coarse */
  #nudge(key, coarse) {
    const step = coarse ? STEP_M.usual : STEP_M.fine;
    const dx = key === "ArrowLeft" ? -step : key === "ArrowRight" ? step : 0;
    const dy = key === "ArrowUp" ? -step : key === "ArrowDown" ? step : 0;
    const front = this.#leading();
    if (!front) return;
    const { edge } = this.#canvas;
    const by = edge === "left" || edge === "right" ? dx : dy;
    this.#place(
      front.key,
      edge ? plane.withEdge(front.rect, edge, front.rect[edge] + by) : plane.moved(front.rect, dx, dy),
    );
  }

  #nextEdge() {
    const sides = [null, ...plane.SIDES];
    this.#canvas.edge = sides[(sides.indexOf(this.#canvas.edge) + 1) % sides.length] ?? null;
    this.#canvas.draw();
    say(this.#canvas.edge ? `Arrows move the ${this.#canvas.edge} edge` : "Arrows move the front");
  }

  /** @param {1 | -1} way */
  #next(way) {
    const here = rows.inOrder(this.#here);
    const at = here.findIndex(({ key }) => key === this.#fronts.leading?.key);
    const next = here[(at + way + here.length) % here.length];
    if (next) this.#pick(next.key, this.#canvas.edge, false);
  }

  /** @param {1 | -1} way */
  #nextPlane(way) {
    const { items } = this.#planes;
    const at = items.findIndex(({ id }) => id === this.#elevation?.id);
    const next = items[(at + way + items.length) % items.length];
    if (next) this.#open(next.id);
  }

  /** @param {Tool} tool */
  #use(tool) {
    this.#tool = this.#tool === tool ? null : tool;
    this.#canvas.tooled = this.#tool !== null;
    for (const one of this.#tools.querySelectorAll("button"))
      one.setAttribute("aria-pressed", String(one.dataset.tool === this.#tool));
  }

  /** @param {{ x: number, y: number }} at */
  #useTool(at) {
    if (this.#tool === "seam") this.#split("upright", at);
    else if (this.#tool === "level-seam") this.#split("level", at);
    else if (this.#tool === "handle") this.#setHandle(at);
    else if (this.#tool === "hinge") this.#setHinge(at);
  }

  /** Where a key is meant: at the pointer, else in the middle of the chosen front. */
  #aim() {
    const front = this.#leading();
    return this.#canvas.pointer ?? (front ? plane.middleOf(front.rect) : undefined);
  }

  /** The chosen front if it is there, else the one that is. @param {{ x: number, y: number } | undefined} at @returns {Placed | null} */
  #at(at) {
    if (!at) return null;
    const there = this.#here.filter(({ rect }) => plane.holds(rect, at));
    return there.find(({ key }) => key === this.#fronts.leading?.key) ?? there[0] ?? null;
  }

  /**
   * @param {Side} side
   * @param {number} at
   * @param {Rect} rect
   * @param {string | null} key of the front, whose own edges count for nothing
   * @param {number} reach
   */
  #snap(side, at, rect, key, reach) {
    const upright = side === "left" || side === "right";
    const others = this.#here.filter((front) => front.key !== key);
    const edges = others.flatMap((front) =>
      upright ? [front.rect.left, front.rect.right] : [front.rect.top, front.rect.bottom],
    );
    return plane.snapped(at, reach, edges, this.#profile(side, rect));
  }

  /** @returns {import("../keyboard.js").Actions} */
  #actions() {
    return {
      undo: () => this.#fronts.step("undo"),
      redo: () => this.#fronts.step("redo"),
      "ask-seam": () => this.#ask(),
      "is-seam": () => this.#answer(true),
      "no-seam": () => this.#answer(false),
      "front-here": () => this.#addByKey(),
      seam: () => this.#split("upright"),
      "level-seam": () => this.#split("level"),
      merge: () => this.#merge(),
      divide: () => this.#pane.type("across"),
      "level-divide": () => this.#pane.type("down"),
      repeat: () => this.#repeat("upright"),
      "repeat-below": () => this.#repeat("level"),
      "choose-all": () => this.#fronts.chooseAll(rows.inOrder(this.#here).map(({ key }) => key)),
      "front-name": () => this.#pane.type("name"),
      "delete-front": () => this.#remove(),
      width: () => this.#pane.type("width"),
      height: () => this.#pane.type("height"),
      handle: () => this.#canvas.pointer && this.#setHandle(this.#canvas.pointer),
      "no-handle": () => this.#change((front) => ({ front: { ...drawnOf(front), handle: "none" } })),
      hinge: () =>
        this.#canvas.pointer && this.#at(this.#canvas.pointer)
          ? this.#setHinge(this.#canvas.pointer)
          : this.#turnHinge(),
      "nudge-front": (key, shift) => this.#nudge(key, shift),
      "next-edge": () => this.#nextEdge(),
      "next-front": () => this.#next(1),
      "previous-front": () => this.#next(-1),
      "next-plane": () => this.#nextPlane(1),
      "previous-plane": () => this.#nextPlane(-1),
      "adopt-cut": () => this.#adopt(),
      "front-category": (key) => this.#pane.pickCategory(Number(key)),
      "fit-plane": () => this.#canvas.fit(),
      "zoom-in": () => this.#canvas.zoomBy(1.25),
      "zoom-out": () => this.#canvas.zoomBy(0.8),
      "leave-front": () => (this.#tool ? this.#use(this.#tool) : this.#pick(null, null, false)),
    };
  }
}
