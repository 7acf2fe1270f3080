/** Review page: candidates with their evidence, the mesh over photos and scan, the scene with its joints, and verdicts. */

import { listJobs } from "../api.js";
import { detailOf, h, LiveElement, renew, spinner } from "../dom.js";
import { CommentList } from "../elements/comment-list.js";
import { ReviewState } from "../elements/review-state.js";
import { say, sayError } from "../elements/toasts.js";
import { Commands, isForPage } from "../keyboard.js";
import { stageWord } from "../lib/words.js";
import { live } from "../live.js";
import { outbox } from "../outbox.js";
import { Centre } from "../review/centre.js";
import { actionsOf, ONE_A_PRESS } from "../review/commands.js";
import { Decisions } from "../review/decisions.js";
import { objectNav } from "../review/object-nav.js";
import { ReviewObjects } from "../review/objects.js";
import { panel } from "../review/panel.js";
import { remember } from "../router.js";

/** @typedef {import("../api-types").Candidate} Candidate */
/** @typedef {import("../api-types").Comment} Comment */
/** @typedef {import("../api-types").CommentIn} CommentIn */
/** @typedef {import("../api-types").Job} Job */

export class ReviewPage extends LiveElement {
  project = "";
  query = new URLSearchParams();
  #objects = new ReviewObjects();
  #decisions = new Decisions(this.#objects);
  #state = new ReviewState();
  #nav = h("nav", { "aria-label": "Objects" });
  #comments = new CommentList();
  #centre = new Centre(this.#objects);
  #panel = h("aside", { "aria-label": "Candidates" });
  #drawn = "";
  #commands = new Commands(
    "review",
    actionsOf({
      objects: this.#objects,
      decisions: this.#decisions,
      centre: this.#centre,
      comment: () => this.#comment(),
    }),
    ONE_A_PRESS,
  );

  connected() {
    const { photos, compare } = this.#centre;
    for (const part of [this.#objects, this.#state, this.#comments, photos, compare]) part.project = this.project;
    const left = h("div", { class: "objects" }, this.#state, this.#nav, this.#comments);
    this.#nav.replaceChildren(spinner("Loading the objects…"));
    if (this.query.has("object")) this.#centre.bar.set("photo");
    this.replaceChildren(h("div", { class: "review" }, left, this.#centre.element, this.#panel));
    this.#listen();
    listJobs(this.project).then((jobs) => {
      const newest = jobs.find(({ kind }) => kind === "run");
      if (newest && !this.signal.aborted) this.#tell(newest);
    }, sayError);
    this.#objects.load(Number(this.query.get("object") ?? -1)).then(() => !this.signal.aborted && this.#centre.open());
  }

  /** @param {string} action */
  act(action) {
    this.#commands.act(action);
  }

  /** @returns {import("../lib/commands.js").Command[]} */
  commands() {
    return this.#objects.groups.map(({ name, object }) => ({
      text: `Object ${name}`,
      run: () => this.#objects.choose(object),
    }));
  }

  #listen() {
    const { signal } = this;
    /** @type {(target: EventTarget, type: string, act: (detail: any) => void) => void} */
    const on = (target, type, act) => target.addEventListener(type, (event) => act(detailOf(event)), { signal });
    const again = () => this.#objects.load();
    this.#centre.listen(signal);
    on(this.#objects, "choose", () => this.#chosen());
    on(this.#objects, "change", () => (this.#drawNav(), this.#centre.aboutObject()));
    on(this.#centre, "about", () => this.#drawPanel());
    on(this.#centre, "pin", (pin) => this.#comment(pin));
    on(this.#centre, "mark", (mark) => this.#decisions.mark(mark));
    on(this.#centre, "store", (patch) => this.#decisions.correct(patch));
    on(this.#centre.compare, "show-candidate", (candidate) => this.#showCandidate(candidate));
    on(this.#centre.compare, "judge", ({ candidate, said }) => this.#decisions.judge(candidate, said));
    on(this.#decisions, "stored", (stored) => this.#stored(stored));
    on(this.#decisions, "undone", () => this.#centre.show());
    on(this.#comments, "comments", (open) => this.#centre.photos.setComments(open));
    on(this.#comments, "show-comment", (comment) => this.#showComment(comment));
    on(live, "review", again);
    on(live, "hello", ({ reset }) =>
      reset || !this.#objects.loaded ? again() : this.#centre.photos.isEmpty && this.#centre.show(),
    );
    on(live, "job", ({ job }) => this.#hear(job));
    on(
      live,
      "segment",
      ({ object, state }) => state === "done" && object === this.#objects.number && this.#centre.show(),
    );
    on(outbox, "caught-up", again);
    document.addEventListener("keydown", (event) => isForPage(event) && this.#commands.press(event), { signal });
    document.addEventListener("keyup", ({ key }) => key.toLowerCase() === "b" && this.#centre.photos.blink(false), {
      signal,
    });
  }

  #chosen() {
    remember({ object: this.#objects.number });
    this.#centre.turnTo();
  }

  #drawNav() {
    const bringBack = (/** @type {{ name: string, run_name: string }} */ item) =>
      this.#decisions.correctMade(item, { left_out: null });
    const copy = (/** @type {Partial<import("../api-types").OverridePatch>} */ patch, /** @type {number[]} */ to) =>
      this.#decisions.copy(patch, to);
    renew(this.#nav, ...objectNav(this.#objects, bringBack, copy));
  }

  /** Redraw the panel only if its data changed, as the user may be typing a number. */
  #drawPanel() {
    const { group, item, certificate, candidate } = this.#objects;
    const movable = this.#centre.mover.box !== null;
    const state = JSON.stringify([group, item, certificate, candidate, movable]);
    if (state === this.#drawn) return;
    const same = this.#panel.dataset.object === String(group?.object);
    const open = /** @type {HTMLElement[]} */ ([...this.#panel.querySelectorAll("details[open] > summary")]);
    const unfolded = new Set(same ? open.map(({ dataset }) => dataset.at ?? "") : []);
    this.#drawn = state;
    this.#panel.dataset.object = String(group?.object);
    const asked = {
      show: (/** @type {Candidate} */ shown) => this.#showCandidate(shown),
      move: movable ? () => this.#centre.bar.move(true) : null,
      comment: () => this.#comment(),
    };
    renew(this.#panel, ...panel(this.#objects, this.#decisions, asked, unfolded));
  }

  /** @param {Candidate} candidate */
  #showCandidate(candidate) {
    this.#objects.look(candidate.id);
    this.#centre.bar.set("candidate");
  }

  /** @param {{ object: number | undefined, job: Job | null }} stored */
  #stored({ object, job }) {
    if (job) this.#hear(job);
    if (object === this.#objects.object) this.#centre.mover.drop();
    this.#centre.show(); // shows the geometric part of a correction before any run
  }

  /** @param {Partial<CommentIn>} pin */
  #comment(pin = {}) {
    const { number, group } = this.#objects;
    const view = pin.frame === undefined ? this.#centre.kept().catch(() => null) : null; // none if the viewer is down
    this.#comments.ask({ ...pin, object: number }, group?.name ?? "the project", view);
  }

  /** @param {Comment} comment */
  #showComment({ object, point_world: point, view }) {
    if (object !== null) this.#objects.choose(object);
    if (view) this.#centre.restore(view);
    else if (point) this.#centre.bar.set("scene");
  }

  /** Say how far a run is. @param {Job} job */
  #tell(job) {
    const { bar } = this.#centre;
    this.#centre.running = ["queued", "running"].includes(job.state);
    bar.job.hidden = !["queued", "running"].includes(job.state);
    bar.job.textContent = `${stageWord(job.stage) || "waiting"}… ${Math.round(100 * job.progress)} %`;
  }

  /** @param {Job} job */
  #hear(job) {
    if (job.project !== this.project || job.kind !== "run") return;
    this.#tell(job);
    if (job.state === "done") this.#objects.load().then(() => this.#centre.show());
    if (job.state === "failed" && job.error) say(job.error.message, { kind: "bad", hint: job.error.hint });
  }
}
