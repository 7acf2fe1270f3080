/** Annotation page: click objects in the frames, see their masks grow, name them. A click shows as saved only once stored. */

import * as api from "../api.js";
import { actionsOf, offers, ONE_A_PRESS } from "../annotate/commands.js";
import { Cropper } from "../annotate/cropper.js";
import { Contradictions } from "../annotate/contradictions.js";
import { Edits } from "../annotate/edits.js";
import { EvidencePane } from "../annotate/evidence-pane.js";
import { listenToKeys } from "../annotate/keys.js";
import { Layout } from "../annotate/layout.js";
import { LiveMasks } from "../annotate/live-masks.js";
import { Painter } from "../annotate/painter.js";
import { ObjectsPane } from "../annotate/objects-pane.js";
import { Picture } from "../annotate/picture.js";
import { Player } from "../annotate/player.js";
import { Presses } from "../annotate/presses.js";
import { SceneObjects } from "../annotate/scene-objects.js";
import { StageTools } from "../annotate/stage-tools.js";
import { Tip } from "../annotate/tip.js";
import { detailOf, h, LiveElement } from "../dom.js";
import { FilmStrip } from "../elements/film-strip.js";
import { FrameCanvas } from "../elements/frame-canvas.js";
import { FrameMosaic } from "../elements/frame-mosaic.js";
import { say, sayError } from "../elements/toasts.js";
import { Commands } from "../keyboard.js";
import { Meanwhile } from "../lib/meanwhile.js";
import { partedText } from "../lib/parted.js";
import { live } from "../live.js";
import { outbox } from "../outbox.js";
import { remember } from "../router.js";
import { offerToSkip } from "../skip.js";
import { Waking } from "../waking.js";

/** @typedef {import("../api-types").Comment} Comment */
/** @typedef {import("../api-types").SceneObject} SceneObject */

export class AnnotatePage extends LiveElement {
  project = "";
  query = new URLSearchParams();
  // State
  #objects = new SceneObjects();
  #masks = new LiveMasks();
  #meanwhile = new Meanwhile();
  #waking = new Waking(
    () => this.#load(),
    (why) => this.#tip.say(why),
  );
  #contradictions = new Contradictions(this.#objects, this.#masks);
  #edits = new Edits(this.#objects);
  /** @type {string[]} */
  #categories = [];
  /** @type {string[]} possible assignees */
  #names = [];
  // Views
  #canvas = new FrameCanvas();
  #strip = new FilmStrip();
  #tools = new StageTools();
  #tip = new Tip();
  #pane = new ObjectsPane();
  #evidence = new EvidencePane();
  #mosaic = new FrameMosaic();
  #layout = new Layout();
  // Controllers
  #player = new Player(this.#canvas, this.#strip);
  #presses = new Presses(
    this.#objects,
    this.#edits,
    this.#player,
    (points) => this.#pane.next(points),
    (spot) => this.#canvas.objectsAt(spot),
  );
  #parts = {
    objects: this.#objects,
    masks: this.#masks.stored,
    edits: this.#edits,
    player: this.#player,
    presses: this.#presses,
    pane: this.#pane,
    evidence: this.#evidence,
    tools: this.#tools,
    canvas: this.#canvas,
    mosaic: this.#mosaic,
    layout: this.#layout,
  };
  #painter = new Painter({ ...this.#parts });
  #cropper = new Cropper(this.#parts);
  #commands = new Commands(
    "annotate",
    actionsOf({ ...this.#parts, painter: this.#painter, cropper: this.#cropper }),
    ONE_A_PRESS,
  );
  #picture = new Picture(
    {
      ...this.#parts,
      openings: () => this.#masks.openings,
      proposals: this.#pane.proposals,
      comments: this.#evidence.comments,
    },
    this.#canvas,
    this.#strip,
  );

  connected() {
    for (const part of [
      this.#painter,
      this.#cropper,
      this.#edits,
      this.#masks,
      this.#pane,
      this.#evidence,
      this.#mosaic,
    ])
      part.project = this.project;
    const stage = h("div", { class: "stage" }, this.#canvas, this.#cropper.element, this.#tip.element);
    this.#strip.status.replaceChildren(this.#tools.status);
    this.#layout.fill(this.#pane.element, this.#tools.element, stage, this.#evidence.element, this.#strip);
    this.replaceChildren(this.#layout.element, this.#mosaic);
    offerToSkip("Skip to the picture", this.#canvas, this.signal);
    this.#listen();
    this.#player.showFirst(this.project);
    this.#waking.begin(this.signal);
  }

  /** @param {string} action */
  act(action) {
    this.#commands.act(action);
  }

  /** Commands of this page for the command palette, besides its keys. @param {string} typed */
  commands(typed) {
    const { checklist } = this.#pane;
    const listed = checklist.left.map(({ name }) => ({
      text: `Click next: ${name}`,
      run: () => checklist.choose(name),
    }));
    const others = offers(typed, this.#parts, this.#categories, (category) => this.#categorise(category), {
      names: this.#names,
      assign: (name) => this.#edits.assign(this.#objects.changed, name),
    });
    return [...others, ...listed];
  }

  #listen() {
    this.#masks.listen(this.signal);
    this.#listenToThePicture();
    this.#listenToThePanes();
    this.#listenToTheOthers();
    const { signal } = this;
    listenToKeys({ ...this.#parts, painter: this.#painter, cropper: this.#cropper, commands: this.#commands }, signal);
    signal.addEventListener("abort", () =>
      [this.#player, this.#picture, this.#contradictions, this.#cropper].forEach((part) => part.stop()),
    );
  }

  #listenToThePicture() {
    const { signal } = this;
    this.#on(this.#canvas, "click-point", (point) => this.#painter.click(point) || this.#presses.click(point));
    this.#on(this.#canvas, "paint", (path) => this.#painter.stroke(path));
    this.#on(this.#painter, "tool", () => this.#tools.showTool(this.#painter.tool));
    this.#on(this.#painter, "painted", (frame) => this.#drawMasks(frame));
    this.#on(this.#tools, "paint", (tool) => this.act(tool));
    this.#on(this.#canvas, "draw-box", (box) => this.#presses.box(box));
    this.#on(this.#canvas, "move-point", ({ id, x, y }) => this.#edits.movePoint(id, { x, y }));
    this.#on(this.#canvas, "remove-point", ({ id }) => this.#edits.removePoint(id));
    this.#on(this.#canvas, "pick-pin", (id) => this.#tellComment(id));
    this.#on(this.#presses, "pinning", () => this.#drawTip());
    this.#on(this.#presses, "pin", (pin) => this.#comment(pin));
    this.#on(this.#player, "frame", () => (this.#picture.drawFrame(), this.#drawTip()));
    this.#on(this.#player, "settled", () => this.#settled());
    this.#on(this.#masks, "masks", ({ frame }) => !signal.aborted && this.#drawMasks(frame));
    this.#on(this.#masks, "openings", () => this.#opened());
    this.#on(this.#masks, "grown", ({ object }) => this.#grown(object));
    this.#on(this.#strip, "seek", (position) => this.#player.seek(position));
    this.#on(this.#strip, "play", () => this.#player.play());
    this.#on(this.#strip, "pick-object", (id) => this.#objects.choose(id));
    this.#on(this.#mosaic, "seek-frame", (index) => this.#player.seekFrame(index));
    this.#on(this.#tools, "opacity", () => ((this.#canvas.opacity = this.#tools.opacity), this.#picture.drawMasks()));
    this.#on(this.#tools, "sign", () => (this.#canvas.sign = this.#tools.sign));
    this.#on(this.#tools, "evidence", () => this.act("evidence"));
  }

  #listenToThePanes() {
    const { list, proposals } = this.#pane;
    const { comments } = this.#evidence;
    for (const action of ["undo", "redo"]) this.#on(this.#pane, action, () => this.act(action));
    this.#on(list, "pick-object", (id) => (id === null ? this.#presses.startNew() : this.#objects.choose(id)));
    this.#on(list, "choose-several", (ids) => this.#objects.select(ids));
    this.#on(list, "hide", (ids) => this.#objects.hide(ids));
    this.#on(list, "lock", (ids) => this.#edits.lock(this.#those(ids)));
    this.#on(list, "delete", (ids) => this.#edits.remove(this.#those(ids)));
    this.#on(list, "rename-all", ({ ids, name }) => this.#edits.renameAll(this.#those(ids), name));
    this.#on(list, "categorise-all", ({ ids, category }) =>
      this.#edits.unlocked(this.#those(ids)).forEach(({ id }) => this.#categorise(category, id)),
    );
    this.#on(list, "assign", ({ ids, name }) => this.#edits.assign(this.#those(ids), name));
    this.#on(list, "merge", ({ id, other }) => this.#edits.merge(id, other));
    this.#on(list, "find-alike", () => this.act("alike"));
    this.#on(list, "stop", (id) => this.#edits.stopSegmenting(id));
    this.#on(list, "rename", ({ seen, name }) => this.#edits.patch(seen.id, { name }, seen));
    this.#on(list, "categorise", ({ seen, category }) => this.#edits.patch(seen.id, { category }, seen));
    this.#on(proposals, "proposals-changed", () => (this.#picture.drawProposals(), this.#drawTip()));
    this.#on(proposals, "show-frame", (index) => this.#player.seekFrame(index));
    this.#on(proposals, "confirming", () => this.#objects.choose(null)); // the next click is not for the object chosen before
    this.#on(proposals, "objects-made", (objects) => this.#adopt(objects));
    this.#on(comments, "comments", () => this.#picture.drawPins());
    this.#on(comments, "show-comment", (comment) => this.#showComment(comment));
    for (const action of ["mosaic", "comment", "crop", "uncrop"])
      this.#on(this.#evidence, action, () => this.act(action));
    this.#on(this.#cropper, "use", () => this.#drawCrop());
    this.#on(this.#evidence, "open", () => this.#tools.showEvidence(this.#evidence.open));
  }

  /** Listen to changes of the objects: from the server, from other people, and the user's own pending edits. */
  #listenToTheOthers() {
    this.#on(this.#objects, "change", () => this.#drawObjects());
    this.#on(this.#objects, "choose", () => this.#chosen());
    this.#on(this.#objects, "gone", ({ id }) => this.#masks.forget(id));
    this.#on(this.#contradictions, "change", () => this.#drawList());
    this.#on(this.#edits, "object", ({ object }) => this.#objects.answered(object));
    this.#on(this.#edits, "made", ({ object }) => (this.#objects.answered(object), this.#objects.choose(object.id)));
    this.#on(this.#edits, "making", ({ name, coming }) => this.#pane.checklist.making(name, coming));
    this.#on(this.#edits, "clicks", () => this.#picture.drawMarkers());
    this.#on(this.#edits, "saved", ({ text, tone }) => this.#tools.saved(text, tone));
    this.#on(live, "object", ({ object }) => {
      if (object.project === this.project) this.#meanwhile.take(() => this.#objects.store(object));
    });
    this.#on(live, "project", () => this.#waking.loaded && this.#relist().catch(sayError));
    this.#on(live, "parted", ({ name, others }) => say(partedText(name, others)));
    this.#on(live, "live", ({ status }) => this.#tools.segmenter.show(status));
    this.#on(live, "hello", ({ reset }) => reset && this.#waking.loaded && this.#begunAnew());
    this.#on(outbox, "caught-up", () => this.#waking.loaded && this.#reload().catch(sayError));
  }

  /**
   * @param {EventTarget} target
   * @param {string} type
   * @param {(detail: any) => void} act
   */
  #on(target, type, act) {
    target.addEventListener(type, (event) => act(detailOf(event)), { signal: this.signal });
  }

  /** @param {number[]} ids */
  #those(ids) {
    return ids.flatMap((id) => this.#objects.get(id) ?? []);
  }

  async #load() {
    this.#tip.say("Loading the frames…");
    const [project, frames, system, names] = await Promise.all([
      api.getProject(this.project, this.signal),
      api.listFrames(this.project),
      api.getSystem(),
      api.listNames(this.project),
    ]);
    if (system.account) this.#pane.me = system.user;
    this.#pane.checklist.listed = project.checklist;
    this.#names = names;
    this.#pane.list.setNames(names);
    this.#objects.palette = system.palette;
    this.#categories = system.categories.map((category) => category.name);
    this.#pane.list.setCategories(system.categories);
    this.#player.fill(this.project, project.media_version, frames);
    this.#player.seekFrame(Number(this.query.get("frame") ?? -1));
    await this.#reload();
    this.#objects.choose(this.query.has("object") ? Number(this.query.get("object")) : null);
    await this.#tools.segmenter.open(api.openLive(this.project));
  }

  async #reload() {
    const listed = Promise.all([api.listObjects(this.project), this.#masks.load()]).then(([objects]) => objects);
    await this.#meanwhile.during(listed, (objects) => this.#objects.fill(objects));
    this.#fetchMasks();
  }

  /** Reload the checklist, which may have changed. */
  async #relist() {
    const { checklist } = await api.getProject(this.project, this.signal);
    this.#pane.checklist.listed = checklist;
  }

  /** Reload and reopen the segmenter after a restart of the server. */
  #begunAnew() {
    this.#reload().catch(sayError);
    this.#tools.segmenter.open(api.openLive(this.project)).catch(sayError);
  }

  #fetchMasks() {
    const { frame } = this.#player;
    if (frame) this.#masks.fetch(frame.index, this.signal);
  }

  /** Fetch masks and depth once the timeline rests on a frame. */
  #settled() {
    this.#fetchMasks();
    this.#evidence.showDepth(this.#player.depthUrl);
  }

  /** @param {number} object whose frames changed */
  #grown(object) {
    if (object === this.#objects.current) this.#evidence.cloud.refresh();
    this.#drawList();
    this.#picture.drawLanesSoon();
  }

  #chosen() {
    const { current } = this.#objects;
    this.#edits.finish();
    remember({ object: current });
    this.#evidence.cloud.show(current);
  }

  /** @param {SceneObject[]} objects confirmed just now */
  #adopt(objects) {
    for (const object of objects) this.#objects.answered(object);
    this.#tools.saved(`saved ${new Date().toLocaleTimeString()}`);
  }

  /**
   * Set an object's category; null sets that of the next object.
   * @param {string} category
   * @param {number | null} id
   */
  #categorise(category, id = this.#objects.current) {
    if (id === null) this.#pane.checklist.category = category;
    else this.#edits.patch(id, { category });
  }

  /** @param {{ frame: number, x: number, y: number }} pin */
  #comment(pin) {
    const { current, chosen } = this.#objects;
    this.#evidence.comments.ask({ ...pin, object: current }, chosen?.name ?? `frame ${pin.frame}`);
  }

  /** @param {Comment} comment */
  #showComment({ object, frame }) {
    if (object !== null) this.#objects.choose(object);
    if (frame !== null) this.#player.seekFrame(frame);
  }

  /** @param {number} id */
  #tellComment(id) {
    const comment = this.#evidence.comments.open.find((one) => one.id === id);
    if (comment) say(comment.text, { hint: comment.who });
  }

  /** @param {number | null} of the frame whose masks changed; null: of many */
  #drawMasks(of) {
    this.#painter.restore();
    this.#picture.drawMasks(of);
    const { frame } = this.#player;
    if (frame && (of ?? frame.index) === frame.index) this.#contradictions.lookSoon(frame);
  }

  #opened() {
    this.#picture.drawLanesSoon();
    if (this.#player.frame) this.#contradictions.lookSoon(this.#player.frame);
  }

  #contradicted = (/** @type {number} */ object) => this.#contradictions.about(object);

  #drawCrop() {
    this.#evidence.showCrop(this.#cropper.on, Boolean(this.#objects.chosen?.crop));
    this.#drawTip();
  }

  #drawList() {
    this.#pane.draw(this.#objects, this.#masks.stored, this.#contradicted);
  }

  #drawObjects() {
    this.#drawCrop(); // and the tip
    this.#drawList();
    this.#tools.segmenter.following = this.#objects.following;
    this.#picture.drawObjects();
    if (this.#player.frame) this.#contradictions.lookSoon(this.#player.frame);
  }

  #drawTip() {
    const { pinning } = this.#presses;
    const { chosen, size } = this.#objects;
    const proposed = this.#pane.proposals.tip;
    const cropping = this.#cropper.on;
    if (cropping || this.#player.frame)
      this.#tip.show({ cropping, pinning, proposed, name: chosen?.name, objects: size });
  }
}
