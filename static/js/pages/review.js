/** Candidates beside their evidence, the mesh over photos and scan, the finished scene with its joints. The verdict is a person's. */

import { getCertificate, getScene, listCandidates, moveJoints, placeInViewer, uploadCandidate } from "../api.js";
import { changeOverride, giveVerdict, undoRedo } from "../changes.js";
import { detailOf, h, icon, isOperating, isTyping, LiveElement, plainKeys } from "../dom.js";
import { askForText } from "../elements/ask-dialog.js";
import { CommentList } from "../elements/comment-list.js";
import { PhotoCheck } from "../elements/photo-check.js";
import { ReviewState } from "../elements/review-state.js";
import { say, sayError } from "../elements/toasts.js";
import { ViewerFrame } from "../elements/viewer-frame.js";
import { counted } from "../lib/format.js";
import { actionOf } from "../lib/keymap.js";
import { live } from "../live.js";
import { outbox } from "../outbox.js";
import { choice, gallery } from "../review/candidates.js";
import { corrections } from "../review/corrections.js";
import { findingsOf, placement } from "../review/evidence.js";
import { JointPanel } from "../review/joint-panel.js";
import { Mover } from "../review/mover.js";
import { nextToReview, objectNav } from "../review/object-nav.js";
import { Paced } from "../review/paced.js";
import { ViewBar } from "../review/view-bar.js";
import { remember } from "../router.js";

/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */
/** @typedef {import("../api-types").Candidate} Candidate */
/** @typedef {import("../api-types").Certificate} Certificate */
/** @typedef {import("../api-types").Comment} Comment */
/** @typedef {import("../api-types").CommentIn} CommentIn */
/** @typedef {import("../api-types").Job} Job */
/** @typedef {import("../api-types").OverridePatch} OverridePatch */
/** @typedef {import("../api-types").Reviewed} Reviewed */
/** @typedef {import("../api-types").SceneItem} SceneItem */
/** @typedef {import("../api-types").ViewerShown} ViewerShown */
/** @typedef {import("../review/view-bar.js").Mode} Mode */

const MOVE_MS = 100;

export class ReviewPage extends LiveElement {
  project = "";
  query = new URLSearchParams();
  #nav = h("nav", { "aria-label": "Objects" });
  #bar = new ViewBar();
  #viewer = new ViewerFrame();
  #photos = new PhotoCheck();
  #state = new ReviewState();
  #comments = new CommentList();
  #panel = h("aside", { "aria-label": "Candidates" });
  #joints = new JointPanel((values) => this.#turn.add(values));
  #mover = new Mover();
  #turn = new Paced(MOVE_MS, (/** @type {Record<string, number>} */ values) => moveJoints(this.project, values));
  #place = new Paced(MOVE_MS, (/** @type {{ pose?: number[][] }} */ { pose }) => this.#drag(pose ?? null));

  /** @type {CandidateGroup[]} */
  #groups = [];
  /** @type {SceneItem[]} */
  #items = [];
  /** @type {Certificate | null} */
  #certificate = null;
  #object = -1;
  #candidate = "";
  #handles = false; // whether the 3D view has them
  /** Objects that were accepted here and are not stored yet, with the candidate. @type {Map<number, string>} */
  #accepting = new Map();

  connected() {
    for (const element of [this.#state, this.#comments, this.#photos]) element.project = this.project;
    const objects = h("div", { class: "objects" }, this.#state, this.#nav, this.#comments);
    const centre = h(
      "div",
      { class: "centre" },
      this.#bar.element,
      this.#viewer,
      this.#photos,
      this.#joints.element,
      this.#mover.element,
    );
    this.replaceChildren(h("div", { class: "review" }, objects, centre, this.#panel));
    const { signal } = this;
    this.#bar.addEventListener("change", () => this.#show(), { signal });
    this.#mover.addEventListener("shown", () => this.#drawMover(), { signal });
    this.#mover.addEventListener("moved", () => this.#follow(), { signal });
    this.#mover.addEventListener("store", (event) => this.#correct(detailOf(event)), { signal });
    this.#viewer.addEventListener("dragging", () => this.#handles && this.#place.add({}), { signal });
    this.#viewer.addEventListener("shown", (event) => this.#shown(detailOf(event)), { signal });
    this.#viewer.addEventListener(
      "not-ready",
      (event) => say(String(detailOf(event)), { hint: "run the pipeline first" }),
      { signal },
    );
    this.#photos.addEventListener("pin-point", (event) => this.#comment(detailOf(event)), { signal });
    this.#comments.addEventListener("show-comment", (event) => this.#showComment(detailOf(event)), { signal });
    live.addEventListener("review", () => this.#load(), { signal });
    outbox.addEventListener("caught-up", () => this.#load(), { signal });
    live.addEventListener("hello", (event) => detailOf(event).reset && this.#load(), { signal });
    live.addEventListener("job", (event) => this.#hear(/** @type {{ job: Job }} */ (detailOf(event)).job), { signal });
    document.addEventListener("keydown", (event) => this.#onKey(event), { signal });
    document.addEventListener("keyup", (event) => event.key.toLowerCase() === "b" && this.#photos.blink(false), {
      signal,
    });
    signal.addEventListener("abort", () => [this.#joints, this.#turn, this.#place].forEach((part) => part.stop()));
    if (this.query.has("object")) this.#bar.mode = "photo";
    this.#load().then(() => {
      this.#show();
      this.#viewer.open(this.project, this.#wanted());
    });
  }

  async #load() {
    try {
      const orNone = (/** @type {unknown} */ _) => null; // there is no scene or certificate before the first run
      const [groups, scene, certificate] = await Promise.all([
        listCandidates(this.project),
        getScene(this.project).catch(orNone),
        getCertificate(this.project).catch(orNone),
      ]);
      this.#groups = groups.map((group) => this.#asAccepted(group));
      this.#items = scene?.items ?? [];
      this.#certificate = certificate;
      const asked = Number(this.query.get("object") ?? this.#object);
      if (!this.#group) this.#choose(groups.some((g) => g.object === asked) ? asked : (groups[0]?.object ?? -1), false);
      this.#draw();
    } catch (error) {
      sayError(error);
    }
  }

  get #group() {
    return this.#groups.find((group) => group.object === this.#object);
  }

  get #item() {
    return this.#items.find((item) => item.object === this.#object);
  }

  /**
   * @param {number} object
   * @param {boolean} show
   */
  #choose(object, show = true) {
    this.#object = object;
    this.#candidate = this.#group?.chosen ?? "";
    remember({ object: object < 0 ? null : object });
    this.#bar.moving = false;
    this.#draw();
    if (show) this.#bar.set(["scene", "cloud"].includes(this.#bar.mode) ? "photo" : this.#bar.mode);
  }

  #wanted() {
    const { mode, ...look } = this.#bar.wish;
    const { box } = this.#mover;
    return {
      ...look,
      mode,
      object: mode === "cloud" || this.#object < 0 ? null : this.#object,
      candidate: mode === "candidate" ? this.#candidate || null : null,
      box:
        this.#bar.moving && box ? { pose: box.pose, size: /** @type {[number, number, number]} */ (box.size) } : null,
    };
  }

  async #show() {
    const photo = this.#bar.mode === "photo";
    this.#viewer.hidden = photo;
    this.#photos.hidden = !photo;
    this.#drawMover();
    if (this.#bar.mode !== "scene") this.#joints.element.hidden = true;
    this.#handles = false;
    if (!photo) this.#viewer.show(this.#wanted());
    if (this.#object < 0) return;
    await this.#photos.show(this.#object);
    this.#drawPanel();
  }

  /** @param {ViewerShown} shown */
  #shown(shown) {
    this.#bar.told(shown.reduced);
    this.#handles = this.#bar.moving && shown.mode === "aligned";
    this.#joints.show(shown.joints, this.#items);
    this.#joints.element.hidden = this.#bar.mode !== "scene" || !shown.joints.length;
    this.#follow();
  }

  // Drawing

  #draw() {
    const view = { current: this.#object, project: this.project, choose: this.#choose.bind(this) };
    this.#nav.replaceChildren(...objectNav(this.#groups, view));
    this.#drawPanel();
  }

  #drawPanel() {
    const group = this.#group;
    this.#mover.about(group, this.#photos.boxOf(this.#object));
    this.#bar.offer(this.#mover.box !== null);
    this.#drawMover();
    if (!group) return this.#panel.replaceChildren(h("p", { class: "muted" }, "Choose an object."));
    const undo = h(
      "button",
      { type: "button", class: "quiet", disabled: !group.can_undo, "aria-label": "Undo" },
      icon("undo"),
    );
    undo.addEventListener("click", () => this.act("undo"));
    const upload = h("input", { type: "file", accept: ".glb,.obj,.ply,.stl", hidden: true, "aria-label": "Mesh file" });
    upload.addEventListener("change", () => {
      const file = upload.files?.[0];
      if (file) this.#review(uploadCandidate(this.project, group.object, file));
    });
    const told = {
      show: (/** @type {Candidate} */ candidate) => this.#showCandidate(candidate),
      verdict: (/** @type {Candidate} */ candidate, /** @type {"accepted" | "rejected"} */ said) =>
        this.#verdict(candidate, said),
    };
    this.#panel.replaceChildren(
      h("div", { class: "row" }, h("h2", {}, group.name), h("span", { class: "chip" }, group.category), undo),
      choice(group),
      group.placement ? placement(group.placement, this.#item) : h("p", { class: "chip warn" }, "not placed"),
      findingsOf(
        this.#certificate,
        group.name,
        this.#groups.map((other) => other.name),
      ),
      corrections(group, this.#item, this.#mover.box && (() => this.#bar.move(true)), (patch) => this.#correct(patch)),
      h("h3", {}, counted(group.candidates.length, "candidate")),
      gallery(group, this.#candidate, told),
      h(
        "div",
        { class: "row" },
        h("button", { type: "button", onClick: () => this.act("more") }, "More candidates"),
        h("button", { type: "button", onClick: () => upload.click() }, "Upload a mesh…"),
        upload,
        this.#commentButton(),
      ),
    );
  }

  #commentButton() {
    return h("button", { type: "button", onClick: () => this.act("comment") }, "Comment");
  }

  // What people say

  /** @param {Candidate} candidate */
  #showCandidate(candidate) {
    this.#candidate = candidate.id;
    this.#drawPanel();
    this.#bar.set("candidate");
  }

  /**
   * @param {Candidate} candidate
   * @param {"accepted" | "rejected"} said
   */
  async #verdict(candidate, said) {
    const group = this.#group;
    if (!group) return;
    const again = candidate.verdict === said;
    const asks = said === "rejected" && !again;
    const reason = asks
      ? await askForText(`Reject ${candidate.id}`, "Why? (optional)", { button: "Reject", required: false })
      : "";
    if (reason === null) return;
    const verdict = again ? /** @type {const} */ ("cleared") : said;
    const change = giveVerdict(this.project, group, { candidate: candidate.id, verdict, reason, rerun: true });
    const answer = outbox.send(change);
    if (verdict === "accepted") this.#accepted(group, candidate.id, answer);
    if ((await this.#review(answer)) || verdict !== "accepted") return;
    this.#choose(group.object); // it was not stored: back to it
    await this.#load();
  }

  /**
   * Go on to the next object at once: the outbox keeps what was said, and the next key is meant for what comes next.
   * @param {CandidateGroup} group
   * @param {string} candidate
   * @param {Promise<unknown>} answer
   */
  #accepted(group, candidate, answer) {
    const stored = () => this.#accepting.delete(group.object);
    this.#accepting.set(group.object, candidate);
    answer.then(stored, stored);
    this.#groups = this.#groups.map((one) => this.#asAccepted(one));
    if (this.#object === group.object) this.#nextToReview();
    this.#draw();
  }

  /** @param {CandidateGroup} group */
  #asAccepted(group) {
    return { ...group, accepted: this.#accepting.get(group.object) ?? group.accepted };
  }

  /** @param {Partial<OverridePatch>} patch */
  #correct(patch) {
    const group = this.#group;
    if (group) this.#review(outbox.send(changeOverride(this.project, group, patch)));
  }

  /**
   * @param {Promise<Reviewed>} answer
   * @returns {Promise<boolean>} whether it was stored; not where somebody else's is left as it is
   */
  async #review(answer) {
    try {
      const { text, job, group } = await answer;
      say(text ?? "What is stored stays as it is", { kind: text ? "good" : "" });
      if (job) this.#hear(job);
      if (group?.object === this.#object) this.#mover.drop();
      await this.#load();
      return Boolean(text);
    } catch (error) {
      sayError(error);
      return false;
    }
  }

  /** @param {"undo" | "redo"} which */
  async #undo(which) {
    try {
      const { text } = await outbox.send(undoRedo(this.project, which, this.#object, "review"));
      say(`${which === "undo" ? "Undone" : "Redone"}: ${text}`);
      await this.#load();
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {Partial<CommentIn>} pin */
  #comment(pin = {}) {
    const object = this.#object < 0 ? null : this.#object;
    this.#comments.ask({ ...pin, object }, this.#group?.name ?? "the project");
  }

  /** @param {Comment} comment */
  #showComment({ object, point_world: point }) {
    if (object !== null) this.#choose(object);
    if (point) this.#bar.set("scene");
  }

  /** @param {Job} job */
  #hear(job) {
    if (job.project !== this.project || job.kind !== "run") return;
    const running = ["queued", "running"].includes(job.state);
    this.#bar.job.hidden = !running;
    this.#bar.job.textContent = `running ${job.stage} ${Math.round(100 * job.progress)} %`;
    if (job.state === "done") this.#load().then(() => this.#show());
    if (job.state === "failed" && job.error) say(job.error.message, { kind: "bad", hint: job.error.hint });
  }

  #drawMover() {
    const { moving } = this.#bar;
    this.#mover.element.hidden = !moving;
    this.#photos.preview(moving ? (this.#mover.wanted ?? this.#mover.box) : null);
  }

  /** The handles in the 3D view go where a number or a key moved the object. */
  #follow() {
    const { box, wanted } = this.#mover;
    if (this.#handles && box) this.#place.add({ pose: (wanted ?? box).pose });
  }

  /** Put the handles somewhere, or learn where they were dragged. @param {number[][] | null} pose */
  async #drag(pose) {
    const object = this.#object;
    const placed = await placeInViewer(this.project, pose);
    if (!pose && placed.pose && this.#handles && object === this.#object) this.#mover.dragged(placed.pose);
  }

  // Keys and commands

  /** @param {KeyboardEvent} event */
  #onKey(event) {
    if (isTyping(event) || isOperating(event) || document.querySelector("dialog[open]")) return;
    const action = actionOf(event, "review", plainKeys());
    if (!action || !this.#actions[action]) return;
    event.preventDefault();
    if (!event.repeat || action !== "comment") this.act(action, event.key, event.shiftKey);
  }

  /**
   * Do what a key or the palette asks for.
   * @param {string} action
   * @param {string} [key]
   * @param {boolean} [fine]
   */
  act(action, key = "", fine = false) {
    this.#actions[action]?.(key, fine);
  }

  /** @returns {import("../lib/commands.js").Command[]} */
  commands() {
    return this.#groups.map((group) => ({ text: `Object ${group.name}`, run: () => this.#choose(group.object) }));
  }

  /** @type {Record<string, (key: string, fine: boolean) => void>} */
  #actions = {
    accept: () => this.#accept(),
    reject: () => this.#onCandidate("rejected"),
    more: () => this.#more(),
    "next-object": () => this.#step(1),
    "previous-object": () => this.#step(-1),
    "next-photo": () => this.#photos.move(1),
    "previous-photo": () => this.#photos.move(-1),
    blink: () => this.#photos.blink(true),
    sweep: () => this.#joints.sweep(this.#group?.name ?? null),
    comment: () => this.#comment(),
    "view-candidate": () => this.#bar.set("candidate"),
    "view-aligned": () => this.#bar.set("aligned"),
    "view-scene": () => this.#bar.set("scene"),
    "view-cloud": () => this.#bar.set("cloud"),
    "view-photo": () => this.#bar.set("photo"),
    "move-object": () => this.#bar.move(!this.#bar.moving),
    nudge: (key, fine) => (this.#bar.moving || this.#bar.move(true), this.#mover.nudge(key, fine)),
    "store-move": () => this.#bar.moving && this.#mover.store(),
    "drop-move": () => this.#bar.moving && this.#mover.drop(),
    undo: () => this.#undo("undo"),
    redo: () => this.#undo("redo"),
  };

  /** Another draw of candidates beside those that are there. */
  #more() {
    const group = this.#group;
    if (!group) return;
    this.#correct({ regenerate: (group.override.regenerate ?? 0) + 1 });
  }

  /** Never takes an acceptance back, however often the key is pressed: the button does. */
  #accept() {
    const group = this.#group;
    if (group?.accepted && group.accepted === this.#candidate) this.#nextToReview();
    else this.#onCandidate("accepted");
  }

  /** @param {"accepted" | "rejected"} verdict */
  #onCandidate(verdict) {
    const candidate = this.#group?.candidates.find((c) => c.id === this.#candidate);
    if (candidate) this.#verdict(candidate, verdict);
  }

  #nextToReview() {
    const left = nextToReview(this.#groups, this.#object);
    if (left) this.#choose(left.object);
  }

  /** @param {number} by */
  #step(by) {
    const at = this.#groups.findIndex((group) => group.object === this.#object);
    const next = this.#groups[(at + by + this.#groups.length) % Math.max(this.#groups.length, 1)];
    if (next) this.#choose(next.object);
  }
}
