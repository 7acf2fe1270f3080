/** Elevation page: fronts to scale on the planes of the scan. Found fronts are corrected here; drawn ones are used as is. */

import * as api from "../api.js";
import { SegmenterChip } from "../annotate/segmenter-chip.js";
import { detailOf, h, icon, LiveElement, segments } from "../dom.js";
import { ElevationCanvas } from "../elements/elevation-canvas.js";
import { sayError } from "../elements/toasts.js";
import { actionsOf, ONE_A_PRESS } from "../elevation/commands.js";
import { FrontEdits } from "../elevation/edits.js";
import { FrontPane } from "../elevation/front-pane.js";
import { FrontTools } from "../elevation/front-tools.js";
import { drawnOf, Fronts } from "../elevation/fronts.js";
import { PlaneList } from "../elevation/plane-list.js";
import { PlaneView } from "../elevation/plane-view.js";
import { SeamQuestions } from "../elevation/seam-questions.js";
import { Commands, isForPage } from "../keyboard.js";
import * as plane from "../lib/elevation.js";
import { live } from "../live.js";
import { outbox } from "../outbox.js";
import { remember } from "../router.js";
import { Waking } from "../waking.js";

/** @typedef {import("../elevation/fronts.js").Front} Front */

const EMPTY =
  "Drag over a front to draw it; its edges snap to lines. S splits it at the pointer, D divides it, R repeats it, W types its width.";

export class ElevationPage extends LiveElement {
  project = "";
  query = new URLSearchParams();
  #fronts = new Fronts();
  #planes = new PlaneList();
  #pane = new FrontPane();
  #canvas = new ElevationCanvas();
  #view = new PlaneView(this.#fronts);
  #edits = new FrontEdits(this.#view, this.#fronts, this.#canvas);
  #seams = new SeamQuestions(this.#view, this.#fronts, this.#edits, () => this.#draw());
  #tools = new FrontTools(this.#edits, this.#canvas);
  #segmenter = new SegmenterChip();
  #saved = h("span", { class: "chip", role: "status" });
  #tip = h("p", { class: "tip" });
  #waking = new Waking(
    () => this.#load(),
    (why) => this.#tell(why),
  );
  /** @type {string[]} */
  #palette = ["#e69f00"];
  #commands = new Commands(
    "elevation",
    actionsOf({
      view: this.#view,
      fronts: this.#fronts,
      edits: this.#edits,
      seams: this.#seams,
      pane: this.#pane,
      canvas: this.#canvas,
      tools: this.#tools,
      nextPlane: (way) => this.#nextPlane(way),
    }),
    ONE_A_PRESS,
  );

  connected() {
    this.#fronts.project = this.project;
    const button = (/** @type {string} */ name, /** @type {string} */ label) => {
      const made = h("button", { type: "button", "aria-label": label, title: label, onClick: () => this.act(name) });
      made.append(icon(name));
      return made;
    };
    const bar = h(
      "div",
      { class: "stage-tools" },
      this.#segmenter.element,
      this.#saved,
      h("span", { class: "spring" }),
      this.#tools.element,
      segments("Last change", button("undo", "Undo"), button("redo", "Redo")),
    );
    const stage = h("section", { class: "stage", "aria-label": "Elevation" }, this.#canvas, bar, this.#tip);
    this.replaceChildren(h("div", { class: "elevation" }, this.#planes.element, stage, this.#pane.element));
    this.#canvas.snap = (side, at, rect, key, reach) => this.#view.snap(side, at, rect, key, reach);
    this.#listen();
    this.#waking.begin(this.signal);
  }

  /** @param {string} action */
  act(action) {
    this.#commands.act(action);
  }

  #listen() {
    const { signal } = this;
    /** @param {EventTarget} target @param {string} type @param {(detail: any) => void} act */
    const on = (target, type, act) => target.addEventListener(type, (event) => act(detailOf(event)), { signal });
    on(this.#canvas, "draw", (rect) => this.#edits.add(rect));
    on(this.#canvas, "move", ({ key, rect }) => this.#edits.place(key, rect));
    on(this.#canvas, "pick", ({ key, side, also }) => this.#edits.pick(key, side, also));
    on(this.#canvas, "enclose", (rect) => this.#edits.chooseWithin(rect));
    on(this.#canvas, "use-tool", (at) => this.#tools.clicked(at));
    on(this.#planes, "choose", (id) => this.#open(id));
    on(this.#fronts, "change", () => this.#draw());
    on(this.#fronts, "choose", () => this.#draw());
    on(this.#fronts, "refused", () => this.#reload().catch(sayError));
    on(
      this.#fronts,
      "saved",
      ({ text, tone }) => ((this.#saved.textContent = text), (this.#saved.className = `chip ${tone}`)),
    );
    on(this.#pane, "choose", (key) => this.#edits.pick(key, null, false));
    on(this.#pane, "size", ({ side, metres }) => this.#edits.resize(side, metres));
    on(this.#pane, "category", (category) =>
      this.#edits.change((front) => front.category !== category && { category }),
    );
    on(this.#pane, "name", ({ name, seen }) => this.#edits.name(name, seen));
    on(this.#pane, "divide", ({ way, text }) => this.#edits.divide(way, text));
    on(this.#pane, "next", () => this.#edits.next(1));
    on(this.#pane, "hinge", (hinge) =>
      this.#edits.change((front) => front.hinge !== hinge && { front: { ...drawnOf(front), hinge } }),
    );
    on(this.#pane, "handle", (/** @type {"none" | null} */ handle) =>
      this.#edits.change((front) => ({ front: { ...drawnOf(front), handle } })),
    );
    on(this.#pane, "copy", () => this.act("copy-handle"));
    on(this.#pane, "adopt", () => this.act("adopt-cut"));
    on(live, "live", ({ status }) => {
      this.#segmenter.show(status);
      if (status.state === "ready" && this.#waking.loaded) this.#reload(true).catch(sayError); // the planes may have changed
    });
    on(live, "object", ({ object }) => object.project === this.project && (this.#fronts.take(object), this.#draw()));
    on(live, "segment", ({ state }) => state === "done" && this.#reload().catch(sayError));
    on(outbox, "caught-up", () => this.#reload().catch(sayError));
    document.addEventListener("keydown", (event) => isForPage(event) && this.#commands.press(event), { signal });
  }

  async #load() {
    this.#tell("Loading the planes…");
    const [system] = await Promise.all([api.getSystem(), this.#segmenter.open(api.openLive(this.project))]);
    this.#palette = system.palette;
    this.#pane.setCategories(system.categories);
    await this.#reload();
  }

  #loading = Promise.resolve();

  /** Reload, one at a time: masks of many fronts may finish at once. @param {boolean} [anew] reload the planes too */
  #reload(anew = false) {
    const load = () => this.#loadNow(anew);
    this.#loading = this.#loading.then(load, load);
    return this.#loading;
  }

  /** @param {boolean} anew reload the planes too */
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
    this.#open(this.#view.elevation?.id ?? Number(this.query.get("plane") ?? planes.items[0]?.id));
  }

  /** @param {number} id */
  #open(id) {
    const chosen = this.#planes.items.find((one) => one.id === id) ?? this.#planes.items[0];
    if (!chosen) return;
    const image = new Image();
    image.addEventListener("load", () => {
      if (this.#view.elevation !== chosen) return;
      const { width, height } = plane.sizeOf(chosen);
      this.#canvas.setPlane(image, chosen.cell_m, `Plane of ${width.toFixed(2)} × ${height.toFixed(2)} m`);
      this.#draw();
    });
    image.src = chosen.url;
    this.#view.open(chosen);
    this.#planes.choose(chosen.id);
    this.#fronts.choose(null);
    remember({ plane: chosen.id });
  }

  #draw() {
    const here = this.#view.here;
    const chosen = new Set(this.#fronts.chosen.map(({ key }) => key));
    const cut = this.#view.cut(here);
    const open = this.#seams.open(here);
    const shown = here.map((front) => ({
      ...front,
      paint: this.#paint(front),
      chosen: chosen.has(front.key),
      handle: front.handle === "none" ? null : (front.handle ?? front.seen),
      detected: !front.handle,
      hinge: front.hinge ?? null,
      slides: this.#pane.slides(front.category),
      asked: open.filter(({ key }) => key === front.key).map(({ side }) => side),
      overlaps: here.some((other) => other.key !== front.key && plane.overlap(other.rect, front.rect)),
    }));
    this.#canvas.setFronts(shown, cut);
    this.#pane.show(here, {
      leading: this.#view.leading(here),
      chosen,
      cut: cut.length,
      paint: (front) => this.#paint(front),
    });
    this.#planes.count(this.#fronts.all.map(({ corners }) => corners));
    if (this.#view.elevation) this.#tell(here.length ? this.#seams.text(open) : EMPTY);
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

  /** @param {1 | -1} way */
  #nextPlane(way) {
    const { items } = this.#planes;
    const at = items.findIndex(({ id }) => id === this.#view.elevation?.id);
    const next = items[(at + way + items.length) % items.length];
    if (next) this.#open(next.id);
  }
}
