/** Candidates beside their evidence, the mesh over photos and scan, the finished scene with its joints. The verdict is a person's. */

import {
  changeOverride,
  getCertificate,
  getScene,
  giveVerdict,
  listCandidates,
  moveJoints,
  undoRedo,
  uploadCandidate,
} from "../api.js";
import { detailOf, h, icon, isTyping, LiveElement, plainKeys } from "../dom.js";
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
/** @typedef {"candidate" | "aligned" | "photo" | "scene" | "cloud"} Mode */

/** @type {[Mode, string][]} */
const MODES = [
  ["photo", "Over the photos"],
  ["candidate", "Candidate"],
  ["aligned", "Over the scan"],
  ["scene", "Finished scene"],
  ["cloud", "Scan"],
];
const MOVE_MS = 100;

export class ReviewPage extends LiveElement {
  project = "";
  query = new URLSearchParams();
  #nav = h("nav", { "aria-label": "Objects" });
  #bar = h("div", { class: "bar" });
  #viewer = new ViewerFrame();
  #photos = new PhotoCheck();
  #state = new ReviewState();
  #comments = new CommentList();
  #panel = h("aside", { "aria-label": "Candidates" });
  #opacity = h("input", { type: "range", min: "0", max: "100", value: "85", "aria-label": "Opacity of the mesh" });
  #collision = h("input", { type: "checkbox" });
  #scan = h("input", { type: "checkbox" });
  #job = h("span", { class: "chip", role: "status", hidden: true });
  #joints = new JointPanel((values) => this.#move(values));

  /** @type {CandidateGroup[]} */
  #groups = [];
  /** @type {SceneItem[]} */
  #items = [];
  /** @type {Certificate | null} */
  #certificate = null;
  #object = -1;
  #candidate = "";
  /** @type {Mode} */
  #mode = "scene";

  connected() {
    for (const element of [this.#state, this.#comments, this.#photos]) element.project = this.project;
    const objects = h("div", { class: "objects" }, this.#state, this.#nav, this.#comments);
    const centre = h("div", { class: "centre" }, this.#bar, this.#viewer, this.#photos, this.#joints.element);
    this.replaceChildren(h("div", { class: "review" }, objects, centre, this.#panel));
    const { signal } = this;
    for (const input of [this.#opacity, this.#collision, this.#scan])
      input.addEventListener("change", () => this.#show(), { signal });
    this.#viewer.addEventListener("shown", (event) => this.#shown(detailOf(event)), { signal });
    this.#viewer.addEventListener(
      "not-ready",
      (event) => say(String(detailOf(event)), { hint: "run the pipeline first" }),
      { signal },
    );
    this.#photos.addEventListener("pin-point", (event) => this.#comment(detailOf(event)), { signal });
    this.#comments.addEventListener("show-comment", (event) => this.#showComment(detailOf(event)), { signal });
    live.addEventListener("review", () => this.#load(), { signal });
    live.addEventListener("hello", (event) => detailOf(event).reset && this.#load(), { signal });
    live.addEventListener("job", (event) => this.#hear(/** @type {{ job: Job }} */ (detailOf(event)).job), { signal });
    document.addEventListener("keydown", (event) => this.#onKey(event), { signal });
    document.addEventListener("keyup", (event) => event.key.toLowerCase() === "b" && this.#photos.blink(false), {
      signal,
    });
    signal.addEventListener("abort", () => this.#joints.stop());
    if (this.query.has("object")) this.#mode = "photo";
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
      this.#groups = groups;
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
    if (show && (this.#mode === "scene" || this.#mode === "cloud")) this.#mode = "photo";
    this.#draw();
    if (show) this.#show();
  }

  #wanted() {
    const mode = this.#mode === "photo" ? "aligned" : this.#mode;
    return {
      mode,
      object: mode === "cloud" || this.#object < 0 ? null : this.#object,
      candidate: mode === "candidate" ? this.#candidate || null : null,
      cloud: mode === "scene" ? this.#scan.checked : mode !== "candidate",
      opacity: Number(this.#opacity.value) / 100,
      collision: this.#collision.checked,
    };
  }

  #show() {
    const photo = this.#mode === "photo";
    this.#viewer.hidden = photo;
    this.#photos.hidden = !photo;
    if (this.#mode !== "scene") this.#joints.element.hidden = true;
    this.#drawBar();
    if (!photo) this.#viewer.show(this.#wanted());
    else if (this.#object >= 0) this.#photos.show(this.#object).then(() => this.#drawPanel());
  }

  /** @param {Mode} mode */
  #setMode(mode) {
    this.#mode = mode;
    this.#show();
  }

  /** @param {ViewerShown} shown */
  #shown(shown) {
    this.#joints.show(shown.joints, this.#items);
    this.#joints.element.hidden = this.#mode !== "scene" || !shown.joints.length;
  }

  // Drawing

  #draw() {
    this.#drawNav();
    this.#drawPanel();
  }

  #drawNav() {
    const items = this.#groups.map((group) => {
      const [text, tone] = standing(group);
      const button = h("button", { type: "button", "aria-pressed": String(group.object === this.#object) }, group.name);
      button.append(h("span", { class: `chip ${tone}` }, text));
      button.addEventListener("click", () => this.#choose(group.object));
      return h("li", {}, button);
    });
    const done = this.#groups.filter((group) => group.accepted).length;
    this.#nav.replaceChildren(
      h("h1", {}, "Review"),
      h(
        "p",
        { class: "muted" },
        this.#groups.length ? `${done} of ${counted(this.#groups.length, "object")} accepted` : "",
      ),
      this.#groups.length
        ? h("ul", {}, ...items)
        : h("p", {}, "Nothing to review yet. ", h("a", { href: `/p/${this.project}/run` }, "Run the pipeline")),
    );
  }

  #drawBar() {
    this.#bar.replaceChildren(
      ...MODES.map(([mode, text]) => {
        const button = h("button", { type: "button", "aria-pressed": String(mode === this.#mode) }, text);
        button.addEventListener("click", () => this.#setMode(mode));
        return button;
      }),
      this.#mode === "aligned" ? h("label", { class: "row" }, "Opacity", this.#opacity) : "",
      this.#mode === "scene" ? h("label", { class: "row" }, this.#collision, "Colliders") : "",
      this.#mode === "scene" ? h("label", { class: "row" }, this.#scan, "Scan") : "",
      this.#job,
    );
  }

  #drawPanel() {
    const group = this.#group;
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
      if (file) this.#review(() => uploadCandidate(this.project, group.object, file));
    });
    const told = {
      show: (/** @type {Candidate} */ candidate) => this.#showCandidate(candidate),
      verdict: (/** @type {Candidate} */ candidate, /** @type {"accepted" | "rejected"} */ said) =>
        this.#verdict(candidate, said),
    };
    const edits = {
      change: (/** @type {Partial<OverridePatch>} */ patch) =>
        this.#review(() => changeOverride(this.project, group.object, patch)),
      preview: (/** @type {{ pose: number[][], size: number[] } | null} */ box) => this.#photos.preview(box),
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
      corrections(group, this.#item, this.#mode === "photo" ? this.#photos.box : null, edits),
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
    this.#setMode("candidate");
  }

  /**
   * @param {Candidate} candidate
   * @param {"accepted" | "rejected"} said
   */
  async #verdict(candidate, said) {
    const object = this.#object;
    const again = candidate.verdict === said;
    const asks = said === "rejected" && !again;
    const reason = asks
      ? await askForText(`Reject ${candidate.id}`, "Why? (optional)", { button: "Reject", required: false })
      : "";
    if (reason === null) return;
    const verdict = again ? /** @type {const} */ ("cleared") : said;
    await this.#review(() =>
      giveVerdict(this.project, object, { candidate: candidate.id, verdict, reason, rerun: true }),
    );
    if (verdict === "accepted" && this.#object === object) this.#nextToReview();
  }

  /** @param {() => Promise<Reviewed>} request */
  async #review(request) {
    try {
      const { text, job } = await outbox.send(request);
      say(text, { kind: "good" });
      if (job) this.#hear(job);
      this.#photos.preview(null);
      await this.#load();
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {"undo" | "redo"} which */
  async #undo(which) {
    try {
      const { text } = await outbox.send(() => undoRedo(this.project, which, this.#object, "review"));
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
    if (point) this.#setMode("scene");
  }

  /** @param {Job} job */
  #hear(job) {
    if (job.project !== this.project || job.kind !== "run") return;
    const running = ["queued", "running"].includes(job.state);
    this.#job.hidden = !running;
    this.#job.textContent = `running ${job.stage} ${Math.round(100 * job.progress)} %`;
    if (job.state === "done") this.#load().then(() => this.#show());
    if (job.state === "failed" && job.error) say(job.error.message, { kind: "bad", hint: job.error.hint });
  }

  /** @type {Record<string, number>} */
  #moving = {};
  #moveTimer = 0;

  /** At most ten moves a second. @param {Record<string, number>} values */
  #move(values) {
    Object.assign(this.#moving, values);
    if (this.#moveTimer) return;
    this.#moveTimer = window.setTimeout(() => {
      this.#moveTimer = 0;
      const sent = this.#moving;
      this.#moving = {};
      moveJoints(this.project, sent).catch(sayError);
    }, MOVE_MS);
  }

  // Keys and commands

  /** @param {KeyboardEvent} event */
  #onKey(event) {
    if (isTyping(event) || document.querySelector("dialog[open]")) return;
    const action = actionOf(event, "review", plainKeys());
    if (!action || !this.#actions[action]) return;
    event.preventDefault();
    if (!event.repeat || action !== "comment") this.act(action);
  }

  /** Do what a key or the palette asks for. @param {string} action */
  act(action) {
    this.#actions[action]?.();
  }

  /** @returns {import("../lib/commands.js").Command[]} */
  commands() {
    return this.#groups.map((group) => ({ text: `Object ${group.name}`, run: () => this.#choose(group.object) }));
  }

  /** @type {Record<string, () => void>} */
  #actions = {
    accept: () => this.#onCandidate("accepted"),
    reject: () => this.#onCandidate("rejected"),
    more: () => this.#more(),
    "next-object": () => this.#step(1),
    "previous-object": () => this.#step(-1),
    "next-photo": () => this.#photos.move(1),
    "previous-photo": () => this.#photos.move(-1),
    blink: () => this.#photos.blink(true),
    sweep: () => this.#joints.sweep(this.#group?.name ?? null),
    comment: () => this.#comment(),
    "view-candidate": () => this.#setMode("candidate"),
    "view-aligned": () => this.#setMode("aligned"),
    "view-scene": () => this.#setMode("scene"),
    "view-cloud": () => this.#setMode("cloud"),
    "view-photo": () => this.#setMode("photo"),
    undo: () => this.#undo("undo"),
    redo: () => this.#undo("redo"),
  };

  /** Another draw of candidates beside those that are there. */
  #more() {
    const group = this.#group;
    if (!group) return;
    const regenerate = (group.override.regenerate ?? 0) + 1;
    this.#review(() => changeOverride(this.project, group.object, { regenerate }));
  }

  /** @param {"accepted" | "rejected"} verdict */
  #onCandidate(verdict) {
    const candidate = this.#group?.candidates.find((c) => c.id === this.#candidate);
    if (candidate) this.#verdict(candidate, verdict);
  }

  /** The next object that nobody accepted yet; stay when all are. */
  #nextToReview() {
    const at = this.#groups.findIndex((group) => group.object === this.#object);
    const left = [...this.#groups.slice(at + 1), ...this.#groups.slice(0, at)].find((group) => !group.accepted);
    if (left) this.#choose(left.object);
  }

  /** @param {number} by */
  #step(by) {
    const at = this.#groups.findIndex((group) => group.object === this.#object);
    const next = this.#groups[(at + by + this.#groups.length) % Math.max(this.#groups.length, 1)];
    if (next) this.#choose(next.object);
  }
}

/**
 * @param {CandidateGroup} group
 * @returns {[string, string]} text and tone
 */
function standing(group) {
  if (group.accepted) return ["accepted", "good"];
  if (!group.placement) return ["not placed", ""];
  return group.placement.unsure ? ["unsure", "warn"] : ["to review", ""];
}
