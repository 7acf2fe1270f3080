/** The main screen: click things in the frames, see their masks grow, name them. Every click is saved before it shows as saved. */

import * as api from "../api.js";
import { crosshairKey } from "../annotate/crosshair.js";
import { Edits } from "../annotate/edits.js";
import { lanesOf, markersOn, masksOn } from "../annotate/layers.js";
import { Masks } from "../annotate/masks.js";
import { Player } from "../annotate/player.js";
import { SceneObjects } from "../annotate/scene-objects.js";
import { StageTools } from "../annotate/stage-tools.js";
import { detailOf, h, icon, isOperating, isTyping, LiveElement, plainKeys } from "../dom.js";
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
import { live } from "../live.js";
import { outbox } from "../outbox.js";
import { remember } from "../router.js";

/** @typedef {import("../api-types").SceneObject} SceneObject */
/** @typedef {import("../api-types").FrameMask} FrameMask */
/** @typedef {import("../api-types").Comment} Comment */
/** @typedef {import("../api-types").PointIn} PointIn */

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
  #stage = new StageTools();
  #tip = h("div", { class: "tip" });
  #evidence = h("aside", { class: "evidence", "aria-label": "Depth, shape and comments" });
  #category = h("input", {
    type: "text",
    value: "drawer",
    list: "categories",
    "aria-label": "Category of the next object",
  });

  #player = new Player(this.#canvas, this.#strip);
  #objects = new SceneObjects();
  #edits = new Edits(this.#objects);
  #masks = new Masks();
  /** @type {string[]} */
  #categories = [];
  #lanesTimer = 0;
  #batching = false;
  #pinning = false;

  connected() {
    for (const part of [this.#edits, this.#proposals, this.#comments, this.#mosaic, this.#cloud])
      part.project = this.project;
    this.replaceChildren(
      h(
        "div",
        { class: "annotate" },
        h("aside", { "aria-label": "Objects" }, ...this.#tools()),
        h("div", { class: "stage" }, this.#canvas, this.#stage.element, this.#tip),
        this.#evidence,
        this.#strip,
      ),
      this.#mosaic,
    );
    this.#fillEvidence();
    this.#listen();
    this.#player.showFirst(this.project);
    this.#load();
  }

  #tools() {
    const undo = h("button", { type: "button", class: "quiet", "aria-label": "Undo" }, icon("undo"));
    const redo = h("button", { type: "button", class: "quiet", "aria-label": "Redo" }, icon("redo"));
    undo.addEventListener("click", () => this.act("undo"));
    redo.addEventListener("click", () => this.act("redo"));
    return [
      h("div", { class: "heading" }, h("h1", {}, "Objects"), undo, redo),
      h("label", { class: "next" }, h("span", { class: "muted" }, "Category of the next"), this.#category),
      this.#list,
      this.#proposals,
      h("a", { class: "button primary", href: `/p/${this.project}/run` }, "Run…"),
    ];
  }

  #fillEvidence() {
    const many = h("button", { type: "button", onClick: () => this.act("mosaic") }, "On many frames");
    const pin = h("button", { type: "button", onClick: () => this.act("comment") }, "Pin a comment");
    const close = h(
      "button",
      { type: "button", class: "narrow-only", onClick: () => this.#showEvidence(false) },
      "Close",
    );
    this.#evidence.replaceChildren(
      close,
      h("h2", {}, "Depth"),
      this.#depth,
      h("h2", {}, "Shape so far"),
      this.#cloud,
      h("div", { class: "row" }, many, pin),
      this.#comments,
    );
  }

  /** On a narrow screen depth, shape and comments come and go; a wide one always has room for them. */
  #showEvidence(on = !this.#evidence.classList.contains("open")) {
    this.#evidence.classList.toggle("open", on);
    this.#stage.showEvidence(on);
  }

  #listen() {
    const { signal } = this;
    /** @type {(target: EventTarget, type: string, act: (detail: any) => void) => void} */
    const on = (target, type, act) => target.addEventListener(type, (event) => act(detailOf(event)), { signal });
    on(this.#canvas, "click-point", (point) => this.#click(point));
    on(this.#canvas, "draw-box", (box) => this.#box(box));
    on(this.#canvas, "move-point", ({ id, x, y }) => this.#edits.movePoint(id, { x, y }));
    on(this.#canvas, "remove-point", ({ id }) => this.#edits.removePoint(id));
    on(this.#edits, "object", ({ object }) => this.#keep(object));
    on(this.#edits, "made", ({ object }) => (this.#keep(object), this.#select(object.id)));
    on(this.#edits, "saved", ({ text, tone }) => this.#stage.saved(text, tone));
    on(this.#stage, "opacity", () => this.#drawMasks((this.#canvas.opacity = this.#stage.opacity)));
    on(this.#stage, "sign", () => (this.#canvas.sign = this.#stage.sign));
    on(this.#stage, "evidence", () => this.#showEvidence());
    on(this.#player, "frame", () => this.#drawFrame());
    on(this.#player, "settled", () => this.#settled());
    on(this.#strip, "seek", (position) => this.#player.seek(position));
    on(this.#strip, "play", () => this.#player.play());
    on(this.#strip, "pick-object", (id) => this.#select(id));
    on(this.#list, "pick-object", (id) => this.#select(id));
    on(this.#list, "toggle", (id) => (this.#objects.toggle(id), this.#draw()));
    on(this.#list, "delete", (id) => this.#edits.remove(id));
    on(this.#list, "stop", (id) => this.#edits.stopSegmenting(id));
    on(this.#list, "rename", ({ id, name }) => this.#edits.patch(id, { name }));
    on(this.#list, "categorise", ({ id, category }) => this.#categorise(category, id));
    on(this.#proposals, "proposals-changed", () => this.#drawProposals());
    on(this.#proposals, "show-frame", (index) => this.#player.seekFrame(index));
    on(this.#proposals, "objects-made", (objects) => this.#adopt(objects));
    on(this.#mosaic, "seek-frame", (index) => this.#player.seekFrame(index));
    on(this.#comments, "comments", () => this.#drawPins());
    on(this.#comments, "show-comment", (comment) => this.#showComment(comment));
    on(this.#canvas, "pick-pin", (id) =>
      this.#comments.open.filter((c) => c.id === id).forEach((c) => say(c.text, { hint: c.who })),
    );
    on(live, "object", ({ object }) => object.project === this.project && this.#store(object));
    on(live, "mask", (mask) => this.#receive(mask));
    on(live, "segment", (message) => this.#segment(message));
    on(live, "live", ({ status }) => this.#stage.segmenter.show(status));
    on(live, "hello", ({ reset }) => reset && this.#player.frame && this.#begunAnew());
    on(outbox, "caught-up", () => this.#player.frame && this.#reload().catch(sayError));
    document.addEventListener("keydown", (event) => this.#onKey(event), { signal });
    document.addEventListener("keyup", (event) => this.#onKeyUp(event), { signal });
    signal.addEventListener("abort", () => this.#stop());
  }

  #stop() {
    clearTimeout(this.#lanesTimer);
    this.#player.stop();
  }

  async #load() {
    this.#tip.textContent = "Loading the frames…";
    try {
      const [project, frames, system] = await Promise.all([
        api.getProject(this.project, this.signal),
        api.listFrames(this.project),
        api.getSystem(),
      ]);
      this.#objects.palette = system.palette;
      this.#categories = system.categories.map((category) => category.name);
      this.#list.setCategories(system.categories);
      this.#player.fill(this.project, project.media_version, frames);
      this.#player.seekFrame(Number(this.query.get("frame") ?? -1));
      await this.#reload();
      this.#select(this.query.has("object") ? Number(this.query.get("object")) : null);
      await this.#stage.segmenter.open(api.openLive(this.project));
    } catch (error) {
      this.#tip.textContent = error instanceof Error ? error.message : String(error);
      sayError(error);
    }
  }

  /** The server was started again: its segmenter is to be opened anew. */
  #begunAnew() {
    this.#reload().catch(sayError);
    this.#stage.segmenter.open(api.openLive(this.project)).catch(sayError);
  }

  async #reload() {
    const [objects, lanes] = await Promise.all([api.listObjects(this.project), api.getLanes(this.project)]);
    this.#objects.fill(objects);
    this.#masks.fill(lanes);
    this.#draw();
    this.#fetchMasks();
  }

  get #frame() {
    return this.#player.frame;
  }

  #drawFrame() {
    this.#drawMarkers();
    this.#drawMasks();
    this.#drawProposals();
    this.#drawPins();
  }

  /** A frame was stopped at: its masks and its depth are worth fetching. */
  #settled() {
    this.#fetchMasks();
    this.#depth.src = this.#player.depthUrl;
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
    if (mask.object === this.#objects.current) this.#cloud.refresh();
    this.#drawLanesLater();
  }

  /** @param {{ object: number, restart: boolean, error: { message: string, hint: string } | null }} message */
  #segment({ object, restart, error }) {
    if (restart) {
      this.#masks.restart(object);
      this.#drawMasks();
    }
    if (error) say(error.message, { kind: "bad", hint: error.hint });
    if (object === this.#objects.current) this.#cloud.refresh();
    this.#drawLanesLater();
  }

  // Objects and clicks

  /** @param {{ x: number, y: number, label: 0 | 1, hold: boolean }} point */
  #click({ x, y, label, hold }) {
    const frame = this.#frame;
    if (!frame) return;
    if (this.#pinning) return this.#pin({ frame: frame.index, x, y });
    if (this.#objects.current === null && label === 0) {
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
    this.#edits.place(points, { category: this.#category.value.trim() || "object", infer: !hold });
    this.#drawMarkers();
  }

  /** An answer to a change. @param {SceneObject} object */
  #keep(object) {
    if (this.#objects.isNews(object)) this.#store(object);
    else this.#draw();
  }

  /** @param {SceneObject} object */
  #store(object) {
    this.#objects.store(object);
    if (object.deleted) this.#masks.forget(object.id);
    if (object.deleted && this.#objects.current === object.id) this.#select(null);
    this.#draw();
  }

  /** @param {SceneObject[]} objects confirmed just now: the next click starts a new object */
  #adopt(objects) {
    for (const object of objects) this.#keep(object);
    this.#select(null);
    this.#stage.saved(`saved ${new Date().toLocaleTimeString()}`);
  }

  /** @param {number | null} id */
  #select(id) {
    this.#objects.choose(id);
    this.#edits.finish();
    remember({ object: this.#objects.current });
    this.#cloud.show(this.#objects.current);
    this.#draw();
  }

  // Comments

  /** @param {{ frame: number, x: number, y: number }} pin */
  #pin(pin) {
    this.#pinning = false;
    this.#drawTip();
    this.#comments.ask({ ...pin, object: this.#objects.current }, this.#objects.chosen?.name ?? `frame ${pin.frame}`);
  }

  /** @param {Comment} comment */
  #showComment({ object, frame }) {
    if (object !== null) this.#select(object);
    if (frame !== null) this.#player.seekFrame(frame);
  }

  // Drawing

  #draw() {
    const { current, hidden } = this.#objects;
    this.#list.setObjects(this.#objects.sorted, {
      current,
      hidden,
      colourOf: (object) => this.#objects.colour(object),
    });
    this.#drawMarkers();
    this.#drawLanes();
    this.#drawMasks();
    this.#drawProposals();
  }

  #drawMarkers() {
    this.#canvas.setMarkers(markersOn(this.#objects, this.#edits.clicks, this.#frame?.index));
  }

  #drawMasks(_opacity = this.#canvas.opacity) {
    const frame = this.#frame;
    if (!frame) return;
    this.#canvas.setMasks(masksOn(this.#objects, this.#masks, frame.index));
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
    this.#strip.setLanes(lanesOf(this.#objects, this.#masks));
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
    if (!this.#player.frame) return;
    const name = this.#objects.chosen?.name;
    const proposed = this.#proposals.tip;
    this.#tip.hidden = !this.#pinning && this.#objects.size > 2;
    this.#tip.textContent = this.#pinning
      ? "Click where the comment belongs. Esc leaves it."
      : (proposed ??
        (name === undefined
          ? "Click a drawer, a door or a thing, or draw a box around it. The first click starts a new object."
          : `Not what you expected? Left click adds to ${name}, right click takes away. Enter starts the next object.`));
  }

  // Keys and commands

  /** @param {KeyboardEvent} event */
  #onKey(event) {
    if (isTyping(event) || isOperating(event) || document.querySelector("dialog[open]")) return;
    if (event.key === "Escape" && this.#pinning) return this.#pinWanted(false);
    const click = (/** @type {0 | 1} */ label) =>
      this.#canvas.crosshair && this.#click({ ...this.#canvas.crosshair, label, hold: false });
    if (crosshairKey(event, this.#canvas, click)) return event.preventDefault();
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
    const position = this.#player.frames.positionOf(Number(typed || Number.NaN));
    const frame =
      position < 0 ? [] : [{ text: `${typed.trim()}: go to that frame`, run: () => this.#player.seek(position) }];
    const objects = this.#objects.sorted.map((object) => ({
      text: `Object ${object.name}`,
      run: () => this.#select(object.id),
    }));
    const categories = this.#categories.map((name) => ({
      text: `Category ${name}`,
      run: () => this.#categorise(name),
    }));
    return [...frame, ...objects, ...categories];
  }

  /**
   * An object's category, else the next one's.
   * @param {string} category
   * @param {number | null} id
   */
  #categorise(category, id = this.#objects.current) {
    this.#category.value = category;
    if (id !== null) this.#edits.patch(id, { category });
  }

  /** @type {Record<string, (key: string) => void>} */
  #actions = {
    "next-frame": () => this.#player.seek(this.#player.position + 1),
    "previous-frame": () => this.#player.seek(this.#player.position - 1),
    "forward-ten": () => this.#player.seek(this.#player.position + 10),
    "back-ten": () => this.#player.seek(this.#player.position - 10),
    "first-frame": () => this.#player.seek(0),
    "last-frame": () => this.#player.seek(this.#player.frames.list.length - 1),
    play: () => this.#player.play(),
    "next-prompt": () => this.#seekPrompt(1),
    "previous-prompt": () => this.#seekPrompt(-1),
    "next-doubtful": () => this.#seekDoubtful(1),
    "previous-doubtful": () => this.#seekDoubtful(-1),
    "pick-number": (key) => this.#select(this.#objects.sorted[Number(key) - 1]?.id ?? this.#objects.current),
    finish: () => this.#select(null),
    undo: () => this.#edits.undoRedo("undo", this.#frame?.index),
    redo: () => this.#edits.undoRedo("redo", this.#frame?.index),
    "delete-point": () => this.#deleteLast(),
    segment: () => this.#edits.segment(),
    "cancel-segment": () => this.#edits.stopSegmenting(),
    "confirm-proposal": () => this.#proposals.confirm(),
    "dismiss-proposal": () => this.#proposals.dismiss(),
    "next-proposal": () => this.#proposals.move(1),
    "previous-proposal": () => this.#proposals.move(-1),
    "confirm-all": () => this.#proposals.confirmAll(),
    hide: () => this.#hide(),
    solo: () => (this.#objects.solo(), this.#draw()),
    raw: () => this.#raw(true),
    depth: () => this.#player.switchDepth(),
    mosaic: () => this.#openMosaic(),
    comment: () => this.#pinWanted(!this.#pinning),
    fit: () => this.#canvas.fit(),
    sign: () => this.#stage.switchSign(),
    evidence: () => this.#showEvidence(),
    crosshair: () => this.#canvas.showCrosshair(!this.#canvas.crosshair),
  };

  #hide() {
    if (this.#objects.current !== null) this.#objects.toggle(this.#objects.current);
    this.#draw();
  }

  #openMosaic() {
    const object = this.#objects.chosen;
    if (!object) return say("Choose an object first.");
    const looked = {
      id: object.id,
      name: object.name,
      colour: this.#objects.colour(object),
      lane: this.#masks.lane(object.id),
    };
    const { frames } = this.#player;
    this.#mosaic.open(looked, frames.list, (frame, width) => frames.url(frame, width));
  }

  /** @param {boolean} on */
  #pinWanted(on) {
    this.#pinning = on;
    this.#drawTip();
  }

  /** @param {KeyboardEvent} event */
  #onKeyUp(event) {
    if (event.key.toLowerCase() === "t") this.#raw(false);
    if ((event.key === "Control" || event.key === "Meta") && this.#batching) {
      this.#batching = false;
      this.#edits.segment();
    }
  }

  /** @param {boolean} on */
  #raw(on) {
    this.#canvas.raw = on;
    this.#canvas.draw();
  }

  /** @param {1 | -1} direction */
  #seekPrompt(direction) {
    this.#player.seekOneOf(new Set((this.#objects.chosen?.points ?? []).map((point) => point.frame)), direction);
  }

  /** @param {1 | -1} direction */
  #seekDoubtful(direction) {
    const { current } = this.#objects;
    const lane = current === null ? new Map() : this.#masks.lane(current);
    if (!this.#player.seekDoubtful(lane, direction)) say("No doubtful frame that way.");
  }

  #deleteLast() {
    const last = this.#objects.chosen?.points.findLast((point) => point.frame === this.#frame?.index);
    if (last) this.#edits.removePoint(last.id);
  }
}
