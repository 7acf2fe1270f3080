/**
 * Centre of the review page: the object over its photos, or in the 3D view with its joints and the handles that move it.
 * Emits "pin" {frame, x, y} to comment on a point, "mark" {leaf, frame, value} to mark a leaf's opening, "store" patch to store
 * the moved object, and "about" once it is known whether the object can be moved.
 */

import { addLength, getPicked, getViewerCamera, moveJoints, placeInViewer } from "../api.js";
import { detailOf, h } from "../dom.js";
import { askForText } from "../elements/ask-dialog.js";
import { PhotoCheck } from "../elements/photo-check.js";
import { say, sayError } from "../elements/toasts.js";
import { ViewerFrame } from "../elements/viewer-frame.js";
import { offBy, parseLength } from "../lib/lengths.js";
import { CandidateCompare } from "./compare.js";
import { REVIEWERS } from "./decisions.js";
import { JointPanel } from "./joint-panel.js";
import { Mover } from "./mover.js";
import { Paced } from "./paced.js";
import { reading, withPoint } from "./tape.js";
import { ViewBar } from "./view-bar.js";

/** @typedef {import("../api-types").ViewerShow} ViewerShow */
/** @typedef {import("../api-types").ViewerShown} ViewerShown */

const MOVE_MS = 100;
const PICK_MS = 150;
const PICK_TRIES = 40;

export class Centre extends EventTarget {
  bar = new ViewBar();
  photos = new PhotoCheck();
  compare = new CandidateCompare();
  mover = new Mover();
  joints = new JointPanel((values) => this.#turn.add(values));
  #viewer = new ViewerFrame();
  #objects;
  #turn = new Paced(MOVE_MS, (/** @type {Record<string, number>} */ values) => moveJoints(this.#project, values));
  #place = new Paced(MOVE_MS, (/** @type {{ pose?: number[][] }} */ { pose }) => this.#drag(pose ?? null));
  #open = false; // whether the objects are loaded; nothing is shown before
  /** @type {number[][]} */
  #tape = [];
  #picked = 0; // number of the last click in the 3D view that was handled
  #handles = false; // whether the 3D view shows handles
  element = h(
    "div",
    { class: "centre" },
    this.bar.element,
    this.bar.below,
    this.#viewer,
    this.photos,
    this.compare,
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
    this.#arrange();
    /** @type {(target: EventTarget, type: string, act: (detail: any) => void) => void} */
    const on = (target, type, act) => target.addEventListener(type, (event) => act(detailOf(event)), { signal });
    on(this.bar, "change", () => this.show());
    on(this.bar, "measure", () => this.#measure([]));
    on(this.bar, "keep-length", () => this.#keepLength().catch(sayError));
    on(this.bar, "look", (look) => this.look(look));
    on(this.#objects, "hide", () => this.bar.mode === "scene" && this.show());
    on(this.#viewer, "clicked", () => !this.bar.moving && this.#pick().catch(sayError));
    on(this.mover, "shown", () => this.#drawMover());
    on(this.mover, "moved", () => this.#follow());
    on(this.mover, "store", (patch) => this.dispatchEvent(new CustomEvent("store", { detail: patch })));
    on(this.compare, "seek-photo", (frame) => (this.photos.seek(frame), this.bar.set("photo")));
    on(this.photos, "mark", (mark) => this.dispatchEvent(new CustomEvent("mark", { detail: mark })));
    on(this.photos, "pin-point", (pin) => this.dispatchEvent(new CustomEvent("pin", { detail: pin })));
    on(this.#viewer, "dragging", () => this.#handles && this.#place.add({}));
    on(this.#viewer, "shown", (shown) => this.#shown(shown));
    signal.addEventListener("abort", () => [this.joints, this.#turn, this.#place].forEach((part) => part.stop()));
  }

  /** Show the chosen object, once the objects are loaded. */
  open() {
    this.#open = true;
    this.show();
    this.#viewer.open(this.#project, this.#wanted);
  }

  /** Show another object in the same mode; objects made from the scan have no photos or candidates, so use the scene. */
  turnTo() {
    this.bar.moving = false;
    const onlyInScene = this.#objects.madeName && !["scene", "cloud"].includes(this.bar.mode);
    if (this.#open) this.bar.set(onlyInScene ? "scene" : this.bar.mode);
  }

  async show() {
    this.#arrange();
    if (!this.#open) return;
    const { mode, isSolid } = this.bar;
    if (this.bar.mode !== "scene") this.joints.element.hidden = true;
    this.#handles = false;
    this.#drawMover();
    if (isSolid) this.#viewer.show(this.#wanted);
    if (mode === "compare") this.#compare();
    if (this.#objects.number === null) return this.photos.none("Choose an object to see its photos.");
    await this.photos.show(this.#objects.number);
    this.aboutObject();
  }

  /** Show the view of the mode, and no other. */
  #arrange() {
    const { mode, isSolid } = this.bar;
    this.#viewer.hidden = !isSolid;
    this.photos.hidden = mode !== "photo";
    this.compare.hidden = mode !== "compare";
  }

  /** Whether a run is at work. @param {boolean} running */
  set running(running) {
    this.#viewer.running = running;
  }

  #compare() {
    this.compare.judges = this.#objects.judges;
    this.compare.show(this.#objects.group);
  }

  /** Update after the object's data changed: it can be moved once it has a box. */
  aboutObject() {
    const { group, object } = this.#objects;
    if (this.#open && this.bar.mode === "compare") this.#compare();
    this.photos.about(object, group?.override.states ?? {}, this.#objects.judges ? "" : REVIEWERS);
    this.mover.about(group, this.photos.boxOf(object));
    this.bar.offer(this.mover.box !== null && this.#objects.judges);
    this.#drawMover();
    this.dispatchEvent(new Event("about"));
  }

  /** Choose the object clicked in the 3D view, or add the point to the tape. */
  async #pick() {
    for (let tries = 0; tries < PICK_TRIES; tries++) {
      const { number, object, name, point } = await getPicked(this.#project);
      if (number !== this.#picked) {
        this.#picked = number;
        if (this.bar.measuring) return void (point && this.#measure(withPoint(this.#tape, point)));
        if (object !== null && this.#objects.groups.some((group) => group.object === object))
          this.#objects.choose(object);
        else if (name) this.#objects.chooseMade(name);
        return;
      }
      await new Promise((after) => setTimeout(after, PICK_MS)); // the click reaches the server over the viewer's own connection
    }
  }

  /** @param {number[][]} points ends of the tape */
  #measure(points) {
    this.#tape = points;
    this.bar.read(reading(points), points.length === 2);
    this.show();
  }

  /** Ask for the true length between the two points, measured in the room, and store it. */
  async #keepLength() {
    const [points, typed] = [
      this.#tape,
      await askForText("True length", "Length measured in the room in mm, then what was measured", {
        button: "Keep",
        value: "",
      }),
    ];
    if (typed === null || points.length !== 2) return;
    const found = parseLength(typed);
    if (!found) return say(`“${typed}” is no length`, { kind: "bad", hint: "such as 596, or 596 mm worktop" });
    const kept = await addLength(this.#project, { ...found, points_world: points });
    const said = kept.lengths.at(-1);
    say(`Kept: ${said?.text ?? ""}, ${said ? offBy(said) : ""}`, {
      kind: "good",
      hint: "all are on the Overview page",
    });
  }

  /** Turn the camera to the chosen object, or to the whole scene. @param {NonNullable<ViewerShow["look"]>} look */
  look(look) {
    if (!this.bar.isSolid) return;
    const frame = this.photos.frame;
    if (look === "photo" && frame === null) return say("There is no photo of it to look from: choose another object");
    this.#viewer.show({ ...this.#wanted, look, frame });
  }

  /**
   * Current settings and camera of the 3D view, to store with a comment; null while a photo is shown.
   * @returns {Promise<import("../api-types").ViewerLookInput | null>}
   */
  async kept() {
    if (!this.bar.isSolid) return null;
    const camera = await getViewerCamera(this.#project);
    return { ...this.bar.kept, hidden: this.#wanted.hidden, camera };
  }

  /** Restore the 3D view stored with a comment. @param {import("../api-types").ViewerLookOutput} look */
  restore(look) {
    this.#objects.hideOnly(look.hidden);
    this.bar.restore(look);
    this.show();
    this.#viewer.show({ ...this.#wanted, camera: look.camera });
  }

  /**
   * @param {string} key
   * @param {boolean} fine
   */
  nudge(key, fine) {
    if (!this.bar.moving) this.bar.move(true);
    this.mover.nudge(key, fine);
  }

  /**
   * Act on the leaves' marks over the photo; if no photo is shown, only switch to it.
   * @param {(marks: import("../elements/opening-marks.js").OpeningMarks) => void} act
   */
  mark(act) {
    if (this.bar.mode !== "photo") return this.bar.set("photo");
    if (!this.photos.marks.leaves.length) return say("Nothing of it opens: there is nothing to mark");
    act(this.photos.marks);
  }

  get #project() {
    return this.#objects.project;
  }

  /** Request to the 3D view. */
  get #wanted() {
    const { mode, ...look } = this.bar.wish;
    const { number, candidate } = this.#objects;
    return {
      ...look,
      mode,
      object: mode === "cloud" ? null : number,
      made: (mode === "scene" && this.#objects.madeName) || null,
      tape: this.bar.measuring && mode !== "candidate" ? this.#tape : [],
      hidden: mode === "scene" ? [...this.#objects.hidden] : [],
      candidate: mode === "candidate" ? candidate || null : null,
      box: this.bar.moving ? /** @type {ViewerShow["box"]} */ (this.mover.box) : null,
    };
  }

  /** @param {ViewerShown} shown */
  #shown(shown) {
    this.bar.told(shown);
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

  /** Move the handles in the 3D view to the object's current pose. */
  #follow() {
    const { box, wanted } = this.mover;
    if (this.#handles && box) this.#place.add({ pose: (wanted ?? box).pose });
  }

  /** Place the handles at a pose; null reads where they were dragged. @param {number[][] | null} pose */
  async #drag(pose) {
    const { object } = this.#objects;
    const placed = await placeInViewer(this.#project, pose);
    if (!pose && placed.pose && this.#handles && object === this.#objects.object) this.mover.dragged(placed.pose);
  }
}
