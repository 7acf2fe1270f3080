/** The main screen: click things in the frames, see their masks grow, name them. Every click is saved before it shows as saved. */

import * as api from "../api.js";
import { Frames } from "../annotate/frames.js";
import { Masks } from "../annotate/masks.js";
import { saveFields } from "../annotate/save-fields.js";
import { detailOf, h, icon, isTyping, LiveElement, plainKeys } from "../dom.js";
import { CommentList } from "../elements/comment-list.js";
import { FilmStrip } from "../elements/film-strip.js";
import { FrameCanvas } from "../elements/frame-canvas.js";
import { FrameMosaic } from "../elements/frame-mosaic.js";
import { ObjectCloud } from "../elements/object-cloud.js";
import { ObjectList } from "../elements/object-list.js";
import { ProposalList } from "../elements/proposal-list.js";
import { say, sayError } from "../elements/toasts.js";
import { clicksOfBox } from "../lib/box.js";
import { actionOf } from "../lib/keymap.js";
import { nextDoubtful } from "../lib/lanes.js";
import { rgbOf } from "../lib/masks.js";
import { live } from "../live.js";
import { outbox } from "../outbox.js";
import { remember } from "../router.js";

/** @typedef {import("../api-types").SceneObject} SceneObject */
/** @typedef {import("../api-types").LiveStatus} LiveStatus */
/** @typedef {import("../api-types").FrameMask} FrameMask */
/** @typedef {import("../api-types").Comment} Comment */
/** @typedef {import("../api-types").PointIn} PointIn */

const FRAME_MS = 100;
const SETTLE_MS = 30; // scrubbing passes frames faster: their masks are not asked for
const LANES_MS = 250;
/** What a key held down must not do again and again. */
const ONE_A_PRESS = new Set([
  "confirm-proposal",
  "dismiss-proposal",
  "confirm-all",
  "segment",
  "comment",
  "depth",
  "mosaic",
]);

export class AnnotatePage extends LiveElement {
  project = "";
  query = new URLSearchParams();
  #canvas = new FrameCanvas();
  #strip = new FilmStrip();
  #list = new ObjectList();
  #proposals = new ProposalList();
  #comments = new CommentList();
  #mosaic = new FrameMosaic();
  #cloud = new ObjectCloud();
  #depth = h("img", { class: "depth", alt: "Depth of this frame: red is near, blue is far" });
  #status = h("span", { class: "chip", role: "status" });
  #saved = h("span", { class: "chip", role: "status" });
  #tip = h("div", { class: "tip" });
  #category = h("input", {
    type: "text",
    value: "drawer",
    list: "categories",
    "aria-label": "Category of the next object",
  });
  #opacity = h("input", { type: "range", min: "0", max: "100", value: "42", "aria-label": "Mask opacity" });

  #frames = new Frames();
  #masks = new Masks();
  #position = 0;
  /** @type {Map<number, SceneObject>} */
  #objects = new Map();
  /** @type {number | null} */
  #current = null;
  /** @type {Set<number>} */
  #hidden = new Set();
  /** @type {string[]} */
  #palette = ["#e69f00"];
  /** @type {string[]} */
  #categories = [];
  #timer = 0;
  #settling = 0;
  #lanesTimer = 0;
  #batching = false;
  #pinning = false;
  #asDepth = false;

  connected() {
    for (const element of [this.#proposals, this.#comments, this.#mosaic, this.#cloud]) element.project = this.project;
    this.replaceChildren(
      h(
        "div",
        { class: "annotate" },
        h("aside", { "aria-label": "Objects" }, ...this.#tools()),
        h("div", { class: "stage" }, this.#canvas, h("div", { class: "status" }, this.#status, this.#saved), this.#tip),
        h("aside", { class: "evidence", "aria-label": "Depth, shape and comments" }, ...this.#evidence()),
        this.#strip,
      ),
      this.#mosaic,
    );
    this.#listen();
    this.#load();
  }

  #tools() {
    const undo = h("button", { type: "button", class: "quiet", "aria-label": "Undo" }, icon("undo"));
    const redo = h("button", { type: "button", class: "quiet", "aria-label": "Redo" }, icon("redo"));
    undo.addEventListener("click", () => this.act("undo"));
    redo.addEventListener("click", () => this.act("redo"));
    return [
      h("h1", {}, "Objects"),
      h("label", {}, h("span", { class: "muted" }, "Category of the next object"), this.#category),
      h(
        "div",
        { class: "row" },
        undo,
        redo,
        h("label", { class: "grow" }, h("span", { class: "muted" }, "Masks"), this.#opacity),
      ),
      this.#list,
      this.#proposals,
      h("a", { class: "button primary", href: `/p/${this.project}/run` }, "Run…"),
    ];
  }

  #evidence() {
    const many = h("button", { type: "button", onClick: () => this.act("mosaic") }, "On many frames");
    const pin = h("button", { type: "button", onClick: () => this.act("comment") }, "Pin a comment");
    return [
      h("h2", {}, "Depth"),
      this.#depth,
      h("h2", {}, "Shape so far"),
      this.#cloud,
      h("div", { class: "row" }, many, pin),
      this.#comments,
    ];
  }

  #listen() {
    const { signal } = this;
    /** @type {(target: EventTarget, type: string, act: (detail: any) => void) => void} */
    const on = (target, type, act) => target.addEventListener(type, (event) => act(detailOf(event)), { signal });
    on(this.#canvas, "click-point", (point) => this.#click(point));
    on(this.#canvas, "draw-box", (box) => this.#box(box));
    on(this.#canvas, "move-point", ({ id, x, y }) =>
      this.#change(id, (object) => api.changePoint(this.project, object, id, { x, y })),
    );
    on(this.#canvas, "remove-point", ({ id }) =>
      this.#change(id, (object) => api.deletePoint(this.project, object, id)),
    );
    on(this.#strip, "seek", (position) => this.#seek(position));
    on(this.#strip, "play", () => this.#play());
    on(this.#strip, "pick-object", (id) => this.#select(id));
    on(this.#list, "pick-object", (id) => this.#select(id));
    on(this.#list, "toggle", (id) => this.#toggle(id));
    on(this.#list, "delete", (id) => this.#delete(id));
    on(this.#list, "stop", (id) => this.#save(async () => this.#keep(await api.cancelSegment(this.project, id))));
    on(this.#list, "rename", ({ id, name }) => this.#patch(id, { name }));
    on(this.#list, "categorise", ({ id, category }) => this.#patch(id, { category }));
    on(this.#proposals, "proposals-changed", () => this.#drawProposals());
    on(this.#proposals, "show-frame", (index) => this.#seek(this.#frames.positionOf(index)));
    on(this.#proposals, "objects-made", (objects) => this.#adopt(objects));
    on(this.#mosaic, "seek-frame", (index) => this.#seek(this.#frames.positionOf(index)));
    on(this.#comments, "comments", () => this.#drawPins());
    on(this.#comments, "show-comment", (comment) => this.#showComment(comment));
    on(this.#canvas, "pick-pin", (id) =>
      this.#comments.open.filter((c) => c.id === id).forEach((c) => say(c.text, { hint: c.who })),
    );
    on(live, "object", ({ object }) => object.project === this.project && this.#store(object));
    on(live, "mask", (mask) => this.#receive(mask));
    on(live, "segment", (message) => this.#segment(message));
    on(live, "live", ({ status }) => this.#showLive(status));
    on(live, "hello", ({ reset }) => reset && this.#frames.list.length && this.#reload());
    this.#opacity.addEventListener("input", () =>
      this.#drawMasks((this.#canvas.opacity = Number(this.#opacity.value) / 100)),
    );
    document.addEventListener("keydown", (event) => this.#onKey(event), { signal });
    document.addEventListener("keyup", (event) => this.#onKeyUp(event), { signal });
    signal.addEventListener("abort", () => this.#stop());
  }

  #stop() {
    for (const timer of [this.#timer, this.#settling, this.#lanesTimer]) clearTimeout(timer);
    this.#frames.stop();
  }

  async #load() {
    this.#tip.textContent = "Loading the frames…";
    try {
      const [project, system] = await Promise.all([api.getProject(this.project, this.signal), api.getSystem()]);
      this.#palette = system.palette;
      this.#categories = system.categories.map((category) => category.name);
      this.#list.setCategories(system.categories);
      this.#frames.fill(this.project, project.media_version, await api.listFrames(this.project));
      this.#strip.setFrames(this.#frames.list, (frame) => this.#frames.url(frame, 160));
      const asked = this.#frames.positionOf(Number(this.query.get("frame") ?? -1));
      this.#seek(Math.max(asked, 0));
      await this.#reload();
      this.#select(this.query.has("object") ? Number(this.query.get("object")) : null);
      this.#showLive(await api.openLive(this.project));
    } catch (error) {
      this.#tip.textContent = error instanceof Error ? error.message : String(error);
      sayError(error);
    }
  }

  async #reload() {
    const [objects, lanes] = await Promise.all([api.listObjects(this.project), api.getLanes(this.project)]);
    this.#objects = new Map(objects.map((object) => [object.id, object]));
    this.#masks.fill(lanes);
    this.#draw();
    this.#fetchMasks();
  }

  get #frame() {
    return this.#frames.list[this.#position];
  }

  get #chosen() {
    return this.#current === null ? null : (this.#objects.get(this.#current) ?? null);
  }

  /** @param {SceneObject} object */
  #colour(object) {
    return this.#palette[object.colour % this.#palette.length] ?? "#e69f00";
  }

  // Frames

  /** @param {number} position */
  #seek(position) {
    this.#position = Math.min(Math.max(position, 0), Math.max(this.#frames.list.length - 1, 0));
    const frame = this.#frame;
    if (!frame) return;
    this.#strip.setPosition(this.#position);
    remember({ frame: frame.index });
    this.#showPicture();
    this.#drawMarkers();
    this.#drawMasks();
    this.#drawProposals();
    this.#drawPins();
    clearTimeout(this.#settling);
    this.#settling = window.setTimeout(() => this.#settle(), SETTLE_MS);
  }

  /** The frame's picture, or what is at hand until it is here. */
  #showPicture() {
    const frame = this.#frame;
    if (!frame) return;
    const image = this.#asDepth ? new Image() : this.#frames.large(frame);
    if (this.#asDepth) image.src = this.#frames.depthUrl(frame);
    const show = () => this.#frame === frame && this.#canvas.setFrame(image, frame, `Frame ${frame.index}`);
    if (image.complete && image.naturalWidth) return void show();
    image.addEventListener("load", show, { once: true });
    const meanwhile = this.#asDepth ? null : this.#frames.atOnce(this.#position);
    if (meanwhile) this.#canvas.setFrame(meanwhile, frame, `Frame ${frame.index}`);
  }

  /** A frame was stopped at: its masks, its depth and its neighbours are worth fetching. */
  #settle() {
    const frame = this.#frame;
    if (!frame) return;
    this.#fetchMasks();
    this.#depth.src = this.#frames.depthUrl(frame);
    this.#frames.prefetch(this.#position);
  }

  #play() {
    const playing = this.#timer !== 0;
    clearInterval(this.#timer);
    const next = () => this.#seek((this.#position + 1) % Math.max(this.#frames.list.length, 1));
    this.#timer = playing ? 0 : window.setInterval(next, FRAME_MS);
    this.#strip.setPlaying(!playing);
  }

  // Masks

  async #fetchMasks() {
    const frame = this.#frame;
    if (!frame) return;
    try {
      for (const mask of await api.getMasks(this.project, frame.index, this.signal)) this.#masks.keep(mask);
      if (this.#frame === frame) this.#drawMasks();
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {FrameMask} mask */
  #receive(mask) {
    this.#masks.receive(mask);
    if (mask.frame === this.#frame?.index) this.#drawMasks();
    if (mask.object === this.#current) this.#cloud.refresh();
    this.#drawLanesLater();
  }

  /** @param {{ object: number, restart: boolean, error: { message: string, hint: string } | null }} message */
  #segment({ object, restart, error }) {
    if (restart) {
      this.#masks.restart(object);
      this.#drawMasks();
    }
    if (error) say(error.message, { kind: "bad", hint: error.hint });
    if (object === this.#current) this.#cloud.refresh();
    this.#drawLanesLater();
  }

  // Objects and clicks

  /** @param {{ x: number, y: number, label: 0 | 1, hold: boolean }} point */
  #click({ x, y, label, hold }) {
    const frame = this.#frame;
    if (!frame) return;
    if (this.#pinning) return this.#pin({ frame: frame.index, x, y });
    if (this.#current === null && label === 0) {
      say("Left click on the object first: a right click takes away from the chosen one.");
      return;
    }
    this.#place([{ frame: frame.index, x, y, label }], hold);
  }

  /** @param {{ from: { x: number, y: number }, to: { x: number, y: number }, hold: boolean }} box */
  #box({ from, to, hold }) {
    const points = this.#frame && clicksOfBox(from, to, this.#frame);
    if (points) this.#place(points, hold);
  }

  /**
   * Clicks on the current object, or on a new one.
   * @param {PointIn[]} points
   * @param {boolean} hold whether more will follow before masks are wanted
   */
  #place(points, hold) {
    this.#batching = hold;
    this.#save(async () => {
      const [only] = points;
      if (this.#current === null) {
        const category = this.#category.value.trim() || "object";
        const object = await api.addObject(this.project, { category, points }, !hold);
        this.#keep(object);
        this.#select(object.id);
      } else if (points.length === 1 && only) this.#keep(await api.addPoint(this.project, this.#current, only, !hold));
      else this.#keep(await api.addPoints(this.project, this.#current, points, !hold));
    });
  }

  /**
   * Change a click of whichever object it belongs to.
   * @param {number} id
   * @param {(object: number) => Promise<SceneObject>} act
   */
  #change(id, act) {
    const owner = [...this.#objects.values()].find((object) => object.points.some((point) => point.id === id));
    if (owner) this.#save(async () => this.#keep(await act(owner.id)));
  }

  /** @param {() => Promise<unknown>} act */
  #save(act) {
    this.#showSaved("saving…");
    outbox.send(act).then(
      () => this.#showSaved(`saved ${new Date().toLocaleTimeString()}`),
      (error) => {
        this.#showSaved("not saved", "bad");
        sayError(error);
        this.#draw();
      },
    );
  }

  /**
   * @param {string} text
   * @param {string} [tone]
   */
  #showSaved(text, tone = "") {
    this.#saved.textContent = text;
    this.#saved.className = `chip ${tone}`;
  }

  /**
   * @param {number} id
   * @param {{ name?: string, category?: string }} wanted
   */
  #patch(id, wanted) {
    if (wanted.category) this.#category.value = wanted.category;
    const seen = this.#objects.get(id);
    if (!seen) return;
    this.#save(async () => this.#keep(await saveFields(this.project, seen, wanted)));
  }

  /** @param {number} id */
  #delete(id) {
    const name = this.#objects.get(id)?.name ?? "object";
    this.#save(async () => {
      this.#keep(await api.deleteObject(this.project, id));
      say(`Deleted ${name}; undo brings it back`);
    });
  }

  /** Of the chosen object, else of what was changed last. @param {"undo" | "redo"} which */
  #undoRedo(which) {
    const mine = which === "undo" ? this.#chosen?.can_undo : this.#chosen?.can_redo;
    this.#save(async () => {
      const { object, text, frame } = await api.undoRedo(this.project, which, mine ? this.#current : null, "prompts");
      this.#keep(object);
      const where = frame !== null && frame !== this.#frame?.index ? ` (frame ${frame})` : "";
      say(`${which === "undo" ? "Undone" : "Redone"}: ${text}${where}`);
    });
  }

  /**
   * An answer to a change. What the live connection said of the same change may be newer: masks can be done before it comes.
   * @param {SceneObject} object
   */
  #keep(object) {
    const held = this.#objects.get(object.id);
    if (held && held.version >= object.version) this.#draw();
    else this.#store(object);
  }

  /** @param {SceneObject} object */
  #store(object) {
    if (object.deleted) {
      this.#objects.delete(object.id);
      this.#masks.forget(object.id);
      if (this.#current === object.id) this.#select(null);
    } else this.#objects.set(object.id, object);
    this.#draw();
  }

  /** @param {SceneObject[]} objects confirmed just now: the next click starts a new object */
  #adopt(objects) {
    for (const object of objects) this.#keep(object);
    this.#select(null);
    this.#showSaved(`saved ${new Date().toLocaleTimeString()}`);
  }

  /** @param {number | null} id */
  #select(id) {
    this.#current = id !== null && this.#objects.has(id) ? id : null;
    remember({ object: this.#current });
    this.#cloud.show(this.#current);
    this.#draw();
  }

  /** @param {number} id */
  #toggle(id) {
    if (!this.#hidden.delete(id)) this.#hidden.add(id);
    this.#draw();
  }

  #solo() {
    if (this.#current === null) return;
    const others = [...this.#objects.keys()].filter((id) => id !== this.#current);
    const alone = others.every((id) => this.#hidden.has(id));
    this.#hidden = new Set(alone ? [] : others);
    this.#draw();
  }

  // Comments

  /** @param {{ frame: number, x: number, y: number }} pin */
  #pin(pin) {
    this.#pinning = false;
    this.#drawTip();
    this.#comments.ask({ ...pin, object: this.#current }, this.#chosen?.name ?? `frame ${pin.frame}`);
  }

  /** @param {Comment} comment */
  #showComment({ object, frame }) {
    if (object !== null) this.#select(object);
    if (frame !== null) this.#seek(this.#frames.positionOf(frame));
  }

  // Drawing

  #draw() {
    const view = { current: this.#current, hidden: this.#hidden, colourOf: this.#colour.bind(this) };
    this.#list.setObjects(this.#sorted, view);
    this.#drawMarkers();
    this.#drawLanes();
    this.#drawMasks();
    this.#drawProposals();
  }

  get #sorted() {
    return [...this.#objects.values()].toSorted((a, b) => a.id - b.id);
  }

  #drawMarkers() {
    const markers = this.#sorted.flatMap((object, k) =>
      object.points
        .filter((point) => point.frame === this.#frame?.index && !this.#hidden.has(object.id))
        .map((point) => ({
          ...point,
          colour: this.#colour(object),
          number: k + 1,
          object: object.id,
          current: object.id === this.#current,
        })),
    );
    this.#canvas.setMarkers(markers);
  }

  #drawMasks(_opacity = this.#canvas.opacity) {
    const frame = this.#frame;
    if (!frame) return;
    const layers = [...this.#objects.values()].flatMap((object) => {
      const mask = this.#masks.on(object.id, frame.index)?.mask;
      if (!mask || this.#hidden.has(object.id)) return [];
      return [{ object: object.id, colour: rgbOf(this.#colour(object)), mask, current: object.id === this.#current }];
    });
    this.#canvas.setMasks(layers);
  }

  /** Masks arrive by the dozen: redraw the lanes at most every quarter second. */
  #drawLanesLater() {
    if (this.#lanesTimer) return;
    this.#lanesTimer = window.setTimeout(() => {
      this.#lanesTimer = 0;
      if (!this.signal.aborted) this.#drawLanes();
    }, LANES_MS);
  }

  #drawLanes() {
    this.#strip.setLanes(
      this.#sorted.map((object, k) => ({
        id: object.id,
        number: k + 1,
        colour: this.#colour(object),
        name: object.name,
        frames: this.#masks.lane(object.id),
        prompts: new Set(object.points.map((point) => point.frame)),
        current: object.id === this.#current,
      })),
    );
  }

  #drawProposals() {
    this.#canvas.setOutlines(this.#frame ? this.#proposals.outlinesOn(this.#frame.index) : []);
    this.#drawTip();
  }

  #drawPins() {
    const here = this.#comments.open.filter((comment) => comment.frame === this.#frame?.index);
    this.#canvas.setPins(here.map(({ id, x, y, text }) => ({ id, x: x ?? 0, y: y ?? 0, text })));
  }

  #drawTip() {
    if (!this.#frames.list.length) return;
    const name = this.#chosen?.name;
    const proposed = this.#proposals.tip;
    this.#tip.hidden = !this.#pinning && this.#objects.size > 2;
    this.#tip.textContent = this.#pinning
      ? "Click where the comment belongs. Esc leaves it."
      : (proposed ??
        (name === undefined
          ? "Click a drawer, a door or a thing, or draw a box around it. The first click starts a new object."
          : `Not what you expected? Left click adds to ${name}, right click takes away. Enter starts the next object.`));
  }

  /** @param {LiveStatus} status */
  #showLive(status) {
    const percent = status.state === "preparing" ? ` ${Math.round(100 * status.fraction)} %` : "";
    const text = {
      off: "segmenter off",
      starting: "segmenter starting…",
      preparing: "preparing the scan",
      ready: "ready",
      failed: "no masks",
    };
    this.#status.textContent = `${text[status.state]}${percent}`;
    this.#status.className = `chip ${status.state === "ready" ? "good" : status.state === "failed" ? "bad" : ""}`;
    this.#status.title = status.error ? `${status.error.message} ${status.error.hint}` : status.text;
  }

  // Keys and commands

  /** @param {KeyboardEvent} event */
  #onKey(event) {
    if (isTyping(event) || document.querySelector("dialog[open]")) return;
    if (event.key === "Escape" && this.#pinning) return this.#pinWanted(false);
    if (this.#canvas.crosshair && this.#crosshairKey(event)) return event.preventDefault();
    const action = actionOf(event, "annotate", plainKeys());
    if (!action || !this.#actions[action]) return;
    event.preventDefault();
    if (!(event.repeat && ONE_A_PRESS.has(action))) this.act(action, event.key);
  }

  /**
   * Do what a key or the palette asks for.
   * @param {string} action
   * @param {string} [key]
   */
  act(action, key = "") {
    this.#actions[action]?.(key);
  }

  /**
   * What the palette offers on this page besides its keys.
   * @param {string} typed
   * @returns {import("../lib/commands.js").Command[]}
   */
  commands(typed) {
    const position = this.#frames.positionOf(Number(typed || Number.NaN));
    const frame = position < 0 ? [] : [{ text: `${typed.trim()}: go to that frame`, run: () => this.#seek(position) }];
    const objects = this.#sorted.map((object) => ({
      text: `Object ${object.name}`,
      run: () => this.#select(object.id),
    }));
    const categories = this.#categories.map((name) => ({
      text: `Category ${name}`,
      run: () => this.#categorise(name),
    }));
    return [...frame, ...objects, ...categories];
  }

  /** The chosen object's category, else the next one's. @param {string} category */
  #categorise(category) {
    if (this.#current === null) this.#category.value = category;
    else this.#patch(this.#current, { category });
  }

  /** @type {Record<string, (key: string) => void>} */
  #actions = {
    "next-frame": () => this.#seek(this.#position + 1),
    "previous-frame": () => this.#seek(this.#position - 1),
    "forward-ten": () => this.#seek(this.#position + 10),
    "back-ten": () => this.#seek(this.#position - 10),
    "first-frame": () => this.#seek(0),
    "last-frame": () => this.#seek(this.#frames.list.length - 1),
    play: () => this.#play(),
    "next-prompt": () => this.#seekPrompt(1),
    "previous-prompt": () => this.#seekPrompt(-1),
    "next-doubtful": () => this.#seekDoubtful(1),
    "previous-doubtful": () => this.#seekDoubtful(-1),
    "pick-number": (key) => this.#select(this.#sorted[Number(key) - 1]?.id ?? this.#current),
    finish: () => this.#select(null),
    undo: () => this.#undoRedo("undo"),
    redo: () => this.#undoRedo("redo"),
    "delete-point": () => this.#deleteLast(),
    segment: () => this.#onChosen((id) => api.segmentObject(this.project, id)),
    "cancel-segment": () => this.#onChosen((id) => api.cancelSegment(this.project, id)),
    "confirm-proposal": () => this.#proposals.confirm(),
    "dismiss-proposal": () => this.#proposals.dismiss(),
    "next-proposal": () => this.#proposals.move(1),
    "previous-proposal": () => this.#proposals.move(-1),
    "confirm-all": () => this.#proposals.confirmAll(),
    hide: () => this.#current !== null && this.#toggle(this.#current),
    solo: () => this.#solo(),
    raw: () => this.#raw(true),
    depth: () => {
      this.#asDepth = !this.#asDepth;
      this.#showPicture();
    },
    mosaic: () => this.#openMosaic(),
    comment: () => this.#pinWanted(!this.#pinning),
    fit: () => this.#canvas.fit(),
    crosshair: () => this.#canvas.showCrosshair(!this.#canvas.crosshair),
  };

  /** @param {(object: number) => Promise<SceneObject>} act */
  #onChosen(act) {
    const id = this.#current;
    if (id === null) say("Choose an object first.");
    else this.#save(async () => this.#keep(await act(id)));
  }

  #openMosaic() {
    const object = this.#chosen;
    if (!object) return say("Choose an object first.");
    const looked = {
      id: object.id,
      name: object.name,
      colour: this.#colour(object),
      lane: this.#masks.lane(object.id),
    };
    this.#mosaic.open(looked, this.#frames.list, (frame, width) => this.#frames.url(frame, width));
  }

  /** @param {boolean} on */
  #pinWanted(on) {
    this.#pinning = on;
    this.#drawTip();
  }

  /**
   * @param {KeyboardEvent} event
   * @returns {boolean} whether the crosshair took it
   */
  #crosshairKey(event) {
    const reach = event.shiftKey ? 5 : 1;
    /** @type {Record<string, [number, number]>} */
    const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const move = moves[event.key];
    if (move) this.#canvas.moveCrosshair(move[0] * reach, move[1] * reach);
    else if (event.key === "Escape") this.#canvas.showCrosshair(false);
    else if (this.#canvas.crosshair && ["+", "=", "-"].includes(event.key)) {
      this.#click({ ...this.#canvas.crosshair, label: event.key === "-" ? 0 : 1, hold: false });
    } else return false;
    return true;
  }

  /** @param {KeyboardEvent} event */
  #onKeyUp(event) {
    if (event.key.toLowerCase() === "t") this.#raw(false);
    if ((event.key === "Control" || event.key === "Meta") && this.#batching && this.#current !== null) {
      this.#batching = false;
      const object = this.#current;
      this.#save(() => api.segmentObject(this.project, object));
    }
  }

  /** @param {boolean} on */
  #raw(on) {
    this.#canvas.raw = on;
    this.#canvas.draw();
  }

  /** @param {1 | -1} direction */
  #seekPrompt(direction) {
    const wanted = new Set((this.#chosen?.points ?? []).map((point) => point.frame));
    for (let k = this.#position + direction; k >= 0 && k < this.#frames.list.length; k += direction) {
      if (wanted.has(this.#frames.list[k]?.index ?? -1)) return this.#seek(k);
    }
  }

  /** @param {1 | -1} direction */
  #seekDoubtful(direction) {
    const lane = this.#current === null ? new Map() : this.#masks.lane(this.#current);
    const found = nextDoubtful(this.#frames.list, lane, this.#position, direction);
    if (found === null) say("No doubtful frame that way.");
    else this.#seek(found);
  }

  #deleteLast() {
    const last = this.#chosen?.points.findLast((point) => point.frame === this.#frame?.index);
    if (last) this.#change(last.id, (object) => api.deletePoint(this.project, object, last.id));
  }
}
