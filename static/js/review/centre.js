/**
 * The middle of the review: the object over its photos, or in the 3D view with its joints and the handles that move it.
 * Says "pin" {frame, x, y} where a comment is wanted, "store" {patch} when the object is to stay where it was moved, "about" when
 * it is known whether it can be moved.
 */

import { moveJoints, placeInViewer } from "../api.js";
import { detailOf, h } from "../dom.js";
import { PhotoCheck } from "../elements/photo-check.js";
import { say } from "../elements/toasts.js";
import { ViewerFrame } from "../elements/viewer-frame.js";
import { JointPanel } from "./joint-panel.js";
import { Mover } from "./mover.js";
import { Paced } from "./paced.js";
import { ViewBar } from "./view-bar.js";

/** @typedef {import("../api-types").ViewerShow} ViewerShow */
/** @typedef {import("../api-types").ViewerShown} ViewerShown */

const MOVE_MS = 100;

export class Centre extends EventTarget {
  bar = new ViewBar();
  photos = new PhotoCheck();
  mover = new Mover();
  joints = new JointPanel((values) => this.#turn.add(values));
  #viewer = new ViewerFrame();
  #objects;
  #turn = new Paced(MOVE_MS, (/** @type {Record<string, number>} */ values) => moveJoints(this.#project, values));
  #place = new Paced(MOVE_MS, (/** @type {{ pose?: number[][] }} */ { pose }) => this.#drag(pose ?? null));
  #open = false; // nothing is shown before it is known what there is
  #handles = false; // whether the 3D view has them
  element = h(
    "div",
    { class: "centre" },
    this.bar.element,
    this.#viewer,
    this.photos,
    this.joints.element,
    this.mover.element,
  );

  /** @param {import("./objects.js").ReviewObjects} objects */
  constructor(objects) {
    super();
    this.#objects = objects;
  }

  /** @param {AbortSignal} signal */
  listen(signal) {
    /** @type {(target: EventTarget, type: string, act: (detail: any) => void) => void} */
    const on = (target, type, act) => target.addEventListener(type, (event) => act(detailOf(event)), { signal });
    on(this.bar, "change", () => this.show());
    on(this.mover, "shown", () => this.#drawMover());
    on(this.mover, "moved", () => this.#follow());
    on(this.mover, "store", (patch) => this.dispatchEvent(new CustomEvent("store", { detail: patch })));
    on(this.photos, "pin-point", (pin) => this.dispatchEvent(new CustomEvent("pin", { detail: pin })));
    on(this.#viewer, "dragging", () => this.#handles && this.#place.add({}));
    on(this.#viewer, "shown", (shown) => this.#shown(shown));
    on(this.#viewer, "not-ready", (message) => say(String(message), { hint: "run the pipeline first" }));
    signal.addEventListener("abort", () => [this.joints, this.#turn, this.#place].forEach((part) => part.stop()));
  }

  /** Show what is looked at, now that it is known. */
  open() {
    this.#open = true;
    this.show();
    this.#viewer.open(this.#project, this.#wanted);
  }

  /** Another object is looked at: on its photos rather than in the whole scene. */
  turnTo() {
    this.bar.moving = false;
    if (this.#open) this.bar.set(["scene", "cloud"].includes(this.bar.mode) ? "photo" : this.bar.mode);
  }

  async show() {
    if (!this.#open) return;
    const photo = this.bar.mode === "photo";
    this.#viewer.hidden = photo;
    this.photos.hidden = !photo;
    if (this.bar.mode !== "scene") this.joints.element.hidden = true;
    this.#handles = false;
    this.#drawMover();
    if (!photo) this.#viewer.show(this.#wanted);
    if (this.#objects.number === null) return;
    await this.photos.show(this.#objects.number);
    this.aboutObject();
  }

  /** What is known of the object changed: its box may be moved, once there is one. */
  aboutObject() {
    const { group, object } = this.#objects;
    this.mover.about(group, this.photos.boxOf(object));
    this.bar.offer(this.mover.box !== null);
    this.#drawMover();
    this.dispatchEvent(new Event("about"));
  }

  /** Turn the camera to the chosen object, or back to where all of the scene is seen. @param {"object" | "scene"} look */
  look(look) {
    if (this.bar.mode !== "photo") this.#viewer.show({ ...this.#wanted, look });
  }

  /**
   * @param {string} key
   * @param {boolean} fine
   */
  nudge(key, fine) {
    if (!this.bar.moving) this.bar.move(true);
    this.mover.nudge(key, fine);
  }

  get #project() {
    return this.#objects.project;
  }

  /** What is asked of the 3D view. */
  get #wanted() {
    const { mode, ...look } = this.bar.wish;
    const { number, candidate } = this.#objects;
    return {
      ...look,
      mode,
      object: mode === "cloud" ? null : number,
      candidate: mode === "candidate" ? candidate || null : null,
      box: this.bar.moving ? /** @type {ViewerShow["box"]} */ (this.mover.box) : null,
    };
  }

  /** @param {ViewerShown} shown */
  #shown(shown) {
    this.bar.told(shown.reduced);
    this.#handles = this.bar.moving && shown.mode === "aligned";
    this.joints.show(shown.joints, this.#objects.items);
    this.joints.element.hidden = this.bar.mode !== "scene" || !shown.joints.length;
    this.#follow();
  }

  #drawMover() {
    const { moving } = this.bar;
    this.mover.element.hidden = !moving;
    this.photos.preview(moving ? (this.mover.wanted ?? this.mover.box) : null);
  }

  /** The handles in the 3D view go where a number or a key moved the object. */
  #follow() {
    const { box, wanted } = this.mover;
    if (this.#handles && box) this.#place.add({ pose: (wanted ?? box).pose });
  }

  /** Put the handles somewhere, or learn where they were dragged. @param {number[][] | null} pose */
  async #drag(pose) {
    const { object } = this.#objects;
    const placed = await placeInViewer(this.#project, pose);
    if (!pose && placed.pose && this.#handles && object === this.#objects.object) this.mover.dragged(placed.pose);
  }
}
