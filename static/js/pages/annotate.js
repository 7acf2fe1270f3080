/** The main screen: click things in the frames, see their masks grow, name them. Every click is saved before it shows as saved. */

import {
  addObject,
  addPoint,
  changeObject,
  changePoint,
  deleteObject,
  deletePoint,
  getLanes,
  getMasks,
  getProject,
  getSystem,
  listFrames,
  listObjects,
  openLive,
  segmentObject,
  undoRedo,
} from "../api.js";
import { detailOf, h, icon, isTyping, LiveElement } from "../dom.js";
import { FilmStrip } from "../elements/film-strip.js";
import { FrameCanvas } from "../elements/frame-canvas.js";
import { ObjectList } from "../elements/object-list.js";
import { ProposalList } from "../elements/proposal-list.js";
import { say, sayError } from "../elements/toasts.js";
import { actionOf } from "../lib/keymap.js";
import { rgbOf } from "../lib/masks.js";
import { live } from "../live.js";
import { remember } from "../router.js";

/** @typedef {import("../api-types").SceneObject} SceneObject */
/** @typedef {import("../api-types").FrameInfo} FrameInfo */
/** @typedef {import("../api-types").FrameMask} FrameMask */
/** @typedef {import("../api-types").LiveStatus} LiveStatus */

const PREFETCH = 12;
const FRAME_MS = 100;
/** What a key held down must not do again and again. */
const ONE_A_PRESS = new Set(["confirm-proposal", "dismiss-proposal", "confirm-all"]);

export class AnnotatePage extends LiveElement {
  project = "";
  query = new URLSearchParams();
  #canvas = new FrameCanvas();
  #strip = new FilmStrip();
  #list = new ObjectList();
  #proposals = new ProposalList();
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

  /** @type {FrameInfo[]} */
  #frames = [];
  #position = 0;
  /** @type {Map<number, SceneObject>} */
  #objects = new Map();
  /** @type {number | null} */
  #current = null;
  /** @type {Set<number>} */
  #hidden = new Set();
  /** @type {string[]} */
  #palette = ["#e69f00"];
  /** @type {Map<number, Map<number, number>>} object -> frame -> confidence */
  #lanes = new Map();
  /** @type {Map<string, FrameMask>} of the frame shown and of those that arrived live, by "object/frame" */
  #masks = new Map();
  /** @type {Map<number, HTMLImageElement>} */
  #images = new Map();
  #version = "";
  #timer = 0;
  #batching = false;
  /** @type {Promise<unknown>} clicks are saved in the order they were made */
  #saving = Promise.resolve();

  connected() {
    const undo = h("button", { type: "button", class: "quiet", "aria-label": "Undo" }, icon("undo"));
    this.#proposals.project = this.project;
    const redo = h("button", { type: "button", class: "quiet", "aria-label": "Redo" }, icon("redo"));
    undo.addEventListener("click", () => this.#undoRedo("undo"));
    redo.addEventListener("click", () => this.#undoRedo("redo"));
    this.replaceChildren(
      h(
        "div",
        { class: "annotate" },
        h(
          "aside",
          { "aria-label": "Objects" },
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
        ),
        h("div", { class: "stage" }, this.#canvas, h("div", { class: "status" }, this.#status, this.#saved), this.#tip),
        this.#strip,
      ),
    );
    this.#listen();
    this.#load();
  }

  #listen() {
    const { signal } = this;
    /** @type {(target: EventTarget, type: string, act: (detail: any) => void) => void} */
    const on = (target, type, act) => target.addEventListener(type, (event) => act(detailOf(event)), { signal });
    on(this.#canvas, "click-point", (point) => this.#click(point));
    on(this.#canvas, "move-point", ({ id, x, y }) =>
      this.#change(id, (object) => changePoint(this.project, object, id, { x, y })),
    );
    on(this.#canvas, "remove-point", ({ id }) => this.#change(id, (object) => deletePoint(this.project, object, id)));
    on(this.#strip, "seek", (position) => this.#seek(position));
    on(this.#strip, "play", () => this.#play());
    on(this.#list, "pick-object", (id) => this.#select(id));
    on(this.#list, "toggle", (id) => this.#toggle(id));
    on(this.#list, "delete", (id) => this.#delete(id));
    on(this.#list, "rename", ({ id, name, version }) => this.#patch(id, { name, version }));
    on(this.#list, "categorise", ({ id, category, version }) => this.#patch(id, { category, version }));
    on(this.#proposals, "proposals-changed", () => this.#drawProposals());
    on(this.#proposals, "show-frame", (index) => this.#seek(this.#frames.findIndex((frame) => frame.index === index)));
    on(this.#proposals, "objects-made", (objects) => this.#adopt(objects));
    on(live, "object", ({ object }) => object.project === this.project && this.#store(object));
    on(live, "mask", (mask) => this.#receive(mask));
    on(live, "segment", (message) => this.#segment(message));
    on(live, "live", ({ status }) => this.#showLive(status));
    on(live, "hello", ({ reset }) => reset && this.#frames.length && this.#reload());
    this.#opacity.addEventListener("input", () => {
      this.#canvas.opacity = Number(this.#opacity.value) / 100;
      this.#draw();
    });
    document.addEventListener("keydown", (event) => this.#onKey(event), { signal });
    document.addEventListener("keyup", (event) => this.#onKeyUp(event), { signal });
    signal.addEventListener("abort", () => clearInterval(this.#timer));
  }

  async #load() {
    this.#tip.textContent = "Loading the frames…";
    try {
      const [project, system] = await Promise.all([getProject(this.project, this.signal), getSystem()]);
      this.#version = project.media_version;
      this.#palette = system.palette;
      this.#list.setCategories(system.categories);
      this.#frames = await listFrames(this.project);
      this.#strip.setFrames(this.#frames, (frame) => this.#url(frame, 160));
      await this.#reload();
      const asked = this.#frames.findIndex((frame) => frame.index === Number(this.query.get("frame") ?? -1));
      this.#select(this.query.has("object") ? Number(this.query.get("object")) : null);
      this.#seek(Math.max(asked, 0));
      this.#showLive(await openLive(this.project));
    } catch (error) {
      this.#tip.textContent = error instanceof Error ? error.message : String(error);
      sayError(error);
    }
  }

  async #reload() {
    const [objects, lanes] = await Promise.all([listObjects(this.project), getLanes(this.project)]);
    this.#objects = new Map(objects.map((object) => [object.id, object]));
    this.#lanes = new Map(lanes.map((lane) => [lane.object, new Map(lane.frames.map((e) => [e.frame, e.confidence]))]));
    this.#masks.clear();
    this.#draw();
    this.#fetchMasks();
  }

  get #frame() {
    return this.#frames[this.#position];
  }

  /** @param {SceneObject} object */
  #colour(object) {
    return this.#palette[object.colour % this.#palette.length] ?? "#e69f00";
  }

  /**
   * @param {FrameInfo} frame
   * @param {number} width
   */
  #url(frame, width) {
    return `/media/${this.project}/frames/${frame.index}.jpg?w=${width}&v=${this.#version}`;
  }

  // Frames

  /** @param {number} position */
  #seek(position) {
    this.#position = Math.min(Math.max(position, 0), Math.max(this.#frames.length - 1, 0));
    const frame = this.#frame;
    if (!frame) return;
    this.#strip.setPosition(this.#position);
    remember({ frame: frame.index });
    const image = this.#image(frame);
    const show = () => {
      if (this.#frame === frame) this.#canvas.setFrame(image, frame, `Frame ${frame.index}`);
    };
    if (image.complete) show();
    else image.addEventListener("load", show, { once: true });
    this.#draw();
    this.#fetchMasks();
    this.#prefetch();
  }

  /** @param {FrameInfo} frame */
  #image(frame) {
    const held = this.#images.get(frame.index);
    if (held) return held;
    const image = new Image();
    image.src = this.#url(frame, 960);
    this.#images.set(frame.index, image);
    if (this.#images.size > 6 * PREFETCH) this.#images.delete(/** @type {number} */ (this.#images.keys().next().value));
    return image;
  }

  #prefetch() {
    for (let k = 1; k <= PREFETCH; k += 1) {
      for (const near of [this.#position + k, this.#position - k]) {
        const frame = this.#frames[near];
        if (frame) this.#image(frame);
      }
    }
  }

  #play() {
    const playing = this.#timer !== 0;
    clearInterval(this.#timer);
    this.#timer = 0;
    if (!playing) {
      this.#timer = setInterval(() => this.#seek((this.#position + 1) % Math.max(this.#frames.length, 1)), FRAME_MS);
    }
    this.#strip.setPlaying(!playing);
  }

  // Masks

  async #fetchMasks() {
    const frame = this.#frame;
    if (!frame) return;
    try {
      for (const mask of await getMasks(this.project, frame.index, this.signal))
        this.#masks.set(`${mask.object}/${mask.frame}`, mask);
      if (this.#frame === frame) this.#drawMasks();
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {FrameMask & { done: number, total: number }} message */
  #receive(message) {
    // A first look can be here before the answer that names its object.
    const lane = this.#lanes.get(message.object) ?? new Map();
    this.#lanes.set(message.object, lane);
    if (message.mask.box_width) lane.set(message.frame, message.confidence);
    this.#masks.set(`${message.object}/${message.frame}`, message);
    if (message.frame === this.#frame?.index) this.#drawMasks();
    this.#later();
  }

  /** @param {{ object: number, state: string, restart: boolean, error: { message: string, hint: string } | null }} message */
  #segment(message) {
    if (message.restart) {
      this.#lanes.set(message.object, new Map());
      for (const key of [...this.#masks.keys()]) if (key.startsWith(`${message.object}/`)) this.#masks.delete(key);
      this.#drawMasks();
    }
    if (message.error) say(message.error.message, { kind: "bad", hint: message.error.hint });
    this.#later();
  }

  #drawProposals() {
    this.#canvas.setOutlines(this.#frame ? this.#proposals.outlinesOn(this.#frame.index) : []);
    this.#drawTip();
  }

  #drawMasks() {
    const frame = this.#frame;
    if (!frame) return;
    const layers = [...this.#objects.values()].flatMap((object) => {
      const held = this.#masks.get(`${object.id}/${frame.index}`);
      if (!held || this.#hidden.has(object.id)) return [];
      return [
        {
          object: object.id,
          colour: rgbOf(this.#colour(object)),
          mask: held.mask,
          current: object.id === this.#current,
        },
      ];
    });
    this.#canvas.setMasks(layers);
  }

  #pending = 0;

  /** Masks arrive by the dozen: redraw the lanes at most every quarter second. */
  #later() {
    if (this.#pending) return;
    this.#pending = window.setTimeout(() => {
      this.#pending = 0;
      if (!this.signal.aborted) this.#drawLanes();
    }, 250);
  }

  // Objects and clicks

  /** @param {{ x: number, y: number, label: 0 | 1, hold: boolean }} point */
  #click({ x, y, label, hold }) {
    const frame = this.#frame;
    if (!frame) return;
    const point = { frame: frame.index, x, y, label };
    if (this.#current === null && label === 0) {
      say("Left click on the object first: a right click takes away from the chosen one.");
      return;
    }
    this.#batching = hold;
    this.#save(async () => {
      if (this.#current === null) {
        const object = await addObject(
          this.project,
          { category: this.#category.value.trim() || "object", points: [point] },
          !hold,
        );
        this.#current = object.id;
        remember({ object: object.id });
        this.#keep(object);
      } else this.#keep(await addPoint(this.project, this.#current, point, !hold));
    });
  }

  /**
   * Change a click of the current object.
   * @param {number} id
   * @param {(object: number) => Promise<SceneObject>} act
   */
  #change(id, act) {
    const owner = [...this.#objects.values()].find((object) => object.points.some((point) => point.id === id));
    if (owner) this.#save(async () => this.#keep(await act(owner.id)));
  }

  /** @param {() => Promise<unknown>} act */
  #save(act) {
    this.#saved.textContent = "saving…";
    this.#saving = this.#saving.then(act).then(
      () => (this.#saved.textContent = `saved ${new Date().toLocaleTimeString()}`),
      (error) => {
        this.#saved.textContent = "not saved";
        this.#saved.className = "chip bad";
        sayError(error);
        this.#draw();
      },
    );
  }

  /**
   * @param {number} id
   * @param {{ name?: string, category?: string, version: number }} patch
   */
  #patch(id, patch) {
    if (patch.category) this.#category.value = patch.category;
    this.#save(async () => this.#keep(await changeObject(this.project, id, patch)));
  }

  /** @param {number} id */
  #delete(id) {
    const name = this.#objects.get(id)?.name ?? "object";
    this.#save(async () => {
      this.#keep(await deleteObject(this.project, id));
      say(`Deleted ${name}; undo brings it back`);
    });
  }

  /** @param {"undo" | "redo"} which */
  #undoRedo(which) {
    this.#save(async () => {
      const { object, text, frame } = await undoRedo(this.project, which, null, "prompts");
      this.#keep(object);
      say(
        `${which === "undo" ? "Undone" : "Redone"}: ${text}${frame !== null && frame !== this.#frame?.index ? ` (frame ${frame})` : ""}`,
      );
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
      this.#lanes.delete(object.id);
      if (this.#current === object.id) this.#current = null;
    } else this.#objects.set(object.id, object);
    this.#draw();
  }

  /** @param {SceneObject[]} objects confirmed just now: the next click starts a new object */
  #adopt(objects) {
    for (const object of objects) this.#keep(object);
    this.#select(null);
    this.#saved.textContent = `saved ${new Date().toLocaleTimeString()}`;
  }

  /** @param {number | null} id */
  #select(id) {
    this.#current = id !== null && this.#objects.has(id) ? id : null;
    remember({ object: this.#current });
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

  // Drawing

  #draw() {
    const objects = [...this.#objects.values()].toSorted((a, b) => a.id - b.id);
    this.#list.setObjects(objects, {
      current: this.#current,
      hidden: this.#hidden,
      colourOf: (object) => this.#colour(object),
    });
    this.#canvas.setMarkers(
      objects.flatMap((object, k) =>
        object.points
          .filter((point) => point.frame === this.#frame?.index && !this.#hidden.has(object.id))
          .map((point) => ({
            ...point,
            colour: this.#colour(object),
            number: k + 1,
            object: object.id,
            current: object.id === this.#current,
          })),
      ),
    );
    this.#drawLanes();
    this.#drawMasks();
    this.#drawProposals();
  }

  #drawTip() {
    if (!this.#frames.length) return;
    const name = this.#current === null ? null : this.#objects.get(this.#current)?.name;
    const proposed = this.#proposals.tip;
    this.#tip.hidden = this.#objects.size > 2;
    this.#tip.textContent =
      proposed ??
      (name === null || name === undefined
        ? "Click a drawer, a door or a thing. The first click starts a new object."
        : `Not what you expected? Left click adds to ${name}, right click takes away. Enter starts the next object.`);
  }

  #drawLanes() {
    this.#strip.setLanes(
      [...this.#objects.values()].map((object) => ({
        colour: this.#colour(object),
        name: object.name,
        frames: this.#lanes.get(object.id) ?? new Map(),
        prompts: new Set(object.points.map((point) => point.frame)),
        current: object.id === this.#current,
      })),
    );
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

  // Keys

  /** @param {KeyboardEvent} event */
  #onKey(event) {
    if (isTyping(event)) return;
    if (this.#canvas.crosshair && this.#crosshairKey(event)) return event.preventDefault();
    const action = actionOf(event, "annotate");
    if (!action) return;
    const act = this.#actions[action];
    if (!act) return;
    event.preventDefault();
    if (!(event.repeat && ONE_A_PRESS.has(action))) act();
  }

  /** @type {Record<string, () => void>} */
  #actions = {
    "next-frame": () => this.#seek(this.#position + 1),
    "previous-frame": () => this.#seek(this.#position - 1),
    "forward-ten": () => this.#seek(this.#position + 10),
    "back-ten": () => this.#seek(this.#position - 10),
    "first-frame": () => this.#seek(0),
    "last-frame": () => this.#seek(this.#frames.length - 1),
    play: () => this.#play(),
    "next-prompt": () => this.#seekPrompt(1),
    "previous-prompt": () => this.#seekPrompt(-1),
    finish: () => this.#select(null),
    undo: () => this.#undoRedo("undo"),
    redo: () => this.#undoRedo("redo"),
    "delete-point": () => this.#deleteLast(),
    "confirm-proposal": () => this.#proposals.confirm(),
    "dismiss-proposal": () => this.#proposals.dismiss(),
    "next-proposal": () => this.#proposals.move(1),
    "previous-proposal": () => this.#proposals.move(-1),
    "confirm-all": () => this.#proposals.confirmAll(),
    hide: () => this.#current !== null && this.#toggle(this.#current),
    solo: () => this.#solo(),
    raw: () => this.#raw(true),
    fit: () => this.#canvas.fit(),
    crosshair: () => this.#canvas.showCrosshair(!this.#canvas.crosshair),
  };

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
      this.#save(() => segmentObject(this.project, object));
    }
  }

  /** @param {boolean} on */
  #raw(on) {
    this.#canvas.raw = on;
    this.#canvas.draw();
  }

  /** @param {1 | -1} direction */
  #seekPrompt(direction) {
    const points = this.#current === null ? [] : (this.#objects.get(this.#current)?.points ?? []);
    const wanted = new Set(points.map((point) => point.frame));
    for (let k = this.#position + direction; k >= 0 && k < this.#frames.length; k += direction) {
      if (wanted.has(this.#frames[k]?.index ?? -1)) return this.#seek(k);
    }
  }

  #deleteLast() {
    const points = this.#current === null ? [] : (this.#objects.get(this.#current)?.points ?? []);
    const last = points.findLast((point) => point.frame === this.#frame?.index);
    if (last) this.#change(last.id, (object) => deletePoint(this.project, object, last.id));
  }
}
