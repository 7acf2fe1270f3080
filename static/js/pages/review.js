/** Candidates beside their evidence, the aligned mesh over the scan, the finished scene with its joints. The verdict is a person's. */

import { changeOverride, giveVerdict, listCandidates, moveJoints, undoRedo, uploadCandidate } from "../api.js";
import { detailOf, h, icon, isTyping, LiveElement } from "../dom.js";
import { say, sayError } from "../elements/toasts.js";
import { ViewerFrame } from "../elements/viewer-frame.js";
import { counted, jointValue } from "../lib/format.js";
import { actionOf } from "../lib/keymap.js";
import { live } from "../live.js";
import { remember } from "../router.js";

/** @typedef {import("../api-types").CandidateGroup} CandidateGroup */
/** @typedef {import("../api-types").Candidate} Candidate */
/** @typedef {import("../api-types").Reviewed} Reviewed */
/** @typedef {import("../api-types").ViewerShown} ViewerShown */
/** @typedef {import("../api-types").Job} Job */
/** @typedef {"candidate" | "aligned" | "scene" | "cloud"} Mode */

/** @type {[Mode, string][]} */
const MODES = [
  ["candidate", "Candidate"],
  ["aligned", "Over the scan"],
  ["scene", "Finished scene"],
  ["cloud", "Scan"],
];

export class ReviewPage extends LiveElement {
  project = "";
  query = new URLSearchParams();
  #nav = h("nav", { "aria-label": "Objects" });
  #bar = h("div", { class: "bar" });
  #viewer = new ViewerFrame();
  #joints = h("div", { class: "joints", hidden: true });
  #panel = h("aside", { "aria-label": "Candidates" });
  #opacity = h("input", { type: "range", min: "0", max: "100", value: "85", "aria-label": "Opacity of the mesh" });
  #collision = h("input", { type: "checkbox" });
  #job = h("span", { class: "chip", role: "status", hidden: true });

  /** @type {CandidateGroup[]} */
  #groups = [];
  #object = -1;
  #candidate = "";
  /** @type {Mode} */
  #mode = "scene";

  connected() {
    this.replaceChildren(
      h(
        "div",
        { class: "review" },
        this.#nav,
        h("div", { class: "centre" }, this.#bar, this.#viewer, this.#joints),
        this.#panel,
      ),
    );
    const { signal } = this;
    this.#opacity.addEventListener("input", () => this.#show(), { signal });
    this.#collision.addEventListener("change", () => this.#show(), { signal });
    this.#viewer.addEventListener("shown", (event) => this.#drawJoints(detailOf(event)), { signal });
    this.#viewer.addEventListener(
      "not-ready",
      (event) => say(String(detailOf(event)), { hint: "run the pipeline first" }),
      { signal },
    );
    live.addEventListener("review", () => this.#load(), { signal });
    live.addEventListener("job", (event) => this.#hear(/** @type {{ job: Job }} */ (detailOf(event)).job), { signal });
    document.addEventListener("keydown", (event) => this.#onKey(event), { signal });
    this.#drawBar();
    this.#load().then(() => this.#viewer.open(this.project, this.#wanted()));
  }

  async #load() {
    try {
      this.#groups = await listCandidates(this.project);
      const asked = Number(this.query.get("object") ?? this.#object);
      if (!this.#group)
        this.#choose(this.#groups.some((g) => g.object === asked) ? asked : (this.#groups[0]?.object ?? -1), false);
      this.#draw();
    } catch (error) {
      sayError(error);
    }
  }

  get #group() {
    return this.#groups.find((group) => group.object === this.#object);
  }

  /**
   * @param {number} object
   * @param {boolean} show
   */
  #choose(object, show = true) {
    this.#object = object;
    this.#candidate = this.#group?.chosen ?? "";
    remember({ object: object < 0 ? null : object });
    if (show && (this.#mode === "scene" || this.#mode === "cloud")) this.#mode = "aligned";
    this.#draw();
    if (show) this.#show();
  }

  #wanted() {
    const object = this.#object < 0 ? null : this.#object;
    return {
      mode: this.#mode,
      object: this.#mode === "scene" || this.#mode === "cloud" ? null : object,
      candidate: this.#mode === "candidate" ? this.#candidate || null : null,
      cloud: this.#mode !== "candidate",
      opacity: Number(this.#opacity.value) / 100,
      collision: this.#collision.checked,
    };
  }

  #show() {
    this.#drawBar();
    this.#viewer.show(this.#wanted());
  }

  /** @param {Mode} mode */
  #setMode(mode) {
    this.#mode = mode;
    this.#show();
  }

  #draw() {
    this.#drawNav();
    this.#drawPanel();
  }

  #drawNav() {
    const items = this.#groups.map((group) => {
      const tone = group.accepted ? "good" : group.placement?.unsure ? "warn" : "";
      const text = group.accepted
        ? "accepted"
        : group.placement
          ? group.placement.unsure
            ? "unsure"
            : "to review"
          : "not placed";
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
    undo.addEventListener("click", () => this.#undo("undo"));
    const upload = h("input", { type: "file", accept: ".glb,.obj,.ply,.stl", hidden: true, "aria-label": "Mesh file" });
    upload.addEventListener("change", () => {
      const file = upload.files?.[0];
      if (file) this.#review(uploadCandidate(this.project, group.object, file));
    });
    this.#panel.replaceChildren(
      h("div", { class: "row" }, h("h2", {}, group.name), h("span", { class: "chip" }, group.category), undo),
      h(
        "p",
        {},
        group.chosen_by === "person" ? "Chosen by a person. " : "Chosen automatically: ",
        h("span", { class: "muted" }, group.reason),
      ),
      group.placement ? placement(group.placement) : h("p", { class: "chip warn" }, "not placed"),
      this.#corrections(group),
      h("h3", {}, counted(group.candidates.length, "candidate")),
      h("div", { class: "candidates" }, ...group.candidates.map((candidate) => this.#card(group, candidate))),
      h("p", {}, h("button", { type: "button", onClick: () => upload.click() }, "Upload a mesh instead…"), upload),
    );
  }

  /**
   * @param {CandidateGroup} group
   * @param {Candidate} candidate
   */
  #card(group, candidate) {
    const { metrics } = candidate;
    const show = h("button", { type: "button", class: "show", "aria-label": `Show ${candidate.id} in 3D` });
    show.append(h("img", { src: candidate.thumbnail, alt: `Candidate ${candidate.id}`, loading: "lazy" }));
    show.addEventListener("click", () => {
      this.#candidate = candidate.id;
      this.#drawPanel();
      this.#setMode("candidate");
    });
    const accept = h(
      "button",
      { type: "button", "aria-pressed": String(candidate.verdict === "accepted") },
      icon("check"),
      "Accept",
    );
    accept.addEventListener("click", () => this.#verdict(candidate, "accepted"));
    const reject = h(
      "button",
      { type: "button", "aria-pressed": String(candidate.verdict === "rejected") },
      icon("cross"),
      "Reject",
    );
    reject.addEventListener("click", () => this.#verdict(candidate, "rejected"));
    const iou = metrics.mask_iou === undefined ? "" : `mask ${(100 * metrics.mask_iou).toFixed(0)} %`;
    const depth =
      metrics.depth_residual_m === undefined ? "" : `depth ${(1000 * metrics.depth_residual_m).toFixed(0)} mm`;
    return h(
      "article",
      { class: candidate.id === this.#candidate ? "current" : "" },
      show,
      h(
        "div",
        { class: "body" },
        h(
          "div",
          {},
          h("strong", {}, candidate.id),
          candidate.id === group.chosen ? h("span", { class: "chip good" }, "★ used") : "",
        ),
        h("div", { class: "muted" }, [iou, depth, counted(candidate.faces, "face")].filter(Boolean).join(" · ")),
        h(
          "div",
          { class: "muted" },
          `${candidate.watertight ? "watertight" : "not watertight"} · ${candidate.generator}`,
        ),
        ...candidate.warnings.map((warning) => h("div", { class: "muted" }, warning)),
        accept,
        reject,
      ),
    );
  }

  /** @param {CandidateGroup} group */
  #corrections(group) {
    const select = h("select", { "aria-label": `Hinge of ${group.name}` });
    for (const side of ["automatic", "left", "right", "top", "bottom"]) {
      select.append(h("option", { value: side, selected: (group.override.hinge ?? "automatic") === side }, side));
    }
    select.addEventListener("change", () => {
      const hinge = select.value === "automatic" ? null : /** @type {"left"} */ (select.value);
      this.#review(changeOverride(this.project, group.object, { hinge }));
    });
    return h("label", {}, h("span", { class: "muted" }, "Hinge"), select);
  }

  /**
   * @param {Candidate} candidate
   * @param {"accepted" | "rejected"} verdict
   */
  #verdict(candidate, verdict) {
    const again = candidate.verdict === verdict;
    const reason = verdict === "rejected" && !again ? (prompt(`Why reject ${candidate.id}? (optional)`) ?? null) : "";
    if (reason === null) return; // the prompt was cancelled
    const given = {
      candidate: candidate.id,
      verdict: again ? /** @type {const} */ ("cleared") : verdict,
      reason,
      rerun: true,
    };
    this.#review(giveVerdict(this.project, this.#object, given));
  }

  /** @param {Promise<Reviewed>} request */
  async #review(request) {
    try {
      const { text, job } = await request;
      say(text, { kind: "good" });
      if (job) this.#hear(job);
      await this.#load();
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {"undo" | "redo"} which */
  async #undo(which) {
    try {
      const { text } = await undoRedo(this.project, which, this.#object, "review");
      say(`${which === "undo" ? "Undone" : "Redone"}: ${text}`);
      await this.#load();
    } catch (error) {
      sayError(error);
    }
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

  /** @param {ViewerShown} shown */
  #drawJoints(shown) {
    this.#joints.hidden = shown.joints.length === 0;
    const sliders = shown.joints.map((joint) => {
      const type = joint.upper > 0.9 ? "revolute" : "prismatic"; // a drawer of 0.9 m travel does not exist
      const input = h("input", {
        type: "range",
        min: String(joint.lower),
        max: String(joint.upper),
        step: "any",
        value: String(joint.value),
        "aria-label": joint.name,
      });
      const value = h("output", { class: "mono" }, jointValue(type, joint.value));
      input.addEventListener("input", () => {
        value.textContent = jointValue(type, Number(input.value));
        this.#move({ [joint.name]: Number(input.value) });
      });
      return { joint, input, value, type, element: h("label", {}, h("span", {}, joint.name), input, value) };
    });
    /** @type {(share: number) => void} */
    const all = (share) => {
      /** @type {Record<string, number>} */
      const values = {};
      for (const { joint, input, value, type } of sliders) {
        const position = joint.lower + share * (joint.upper - joint.lower);
        input.value = String(position);
        value.textContent = jointValue(/** @type {"revolute"} */ (type), position);
        values[joint.name] = position;
      }
      this.#move(values);
    };
    this.#joints.replaceChildren(
      h(
        "div",
        { class: "row" },
        h("strong", {}, counted(shown.joints.length, "joint")),
        h("button", { type: "button", onClick: () => all(1) }, "Open all"),
        h("button", { type: "button", onClick: () => all(0) }, "Close all"),
      ),
      ...sliders.map(({ element }) => element),
    );
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
    }, 100);
  }

  /** @param {KeyboardEvent} event */
  #onKey(event) {
    if (isTyping(event)) return;
    const action = actionOf(event, "review");
    const act = action ? this.#actions[action] : undefined;
    if (!act) return;
    event.preventDefault();
    act();
  }

  /** @type {Record<string, () => void>} */
  #actions = {
    accept: () => this.#onCandidate("accepted"),
    reject: () => this.#onCandidate("rejected"),
    "next-object": () => this.#step(1),
    "previous-object": () => this.#step(-1),
    "view-candidate": () => this.#setMode("candidate"),
    "view-aligned": () => this.#setMode("aligned"),
    "view-scene": () => this.#setMode("scene"),
    "view-cloud": () => this.#setMode("cloud"),
    undo: () => this.#undo("undo"),
    redo: () => this.#undo("redo"),
  };

  /** @param {"accepted" | "rejected"} verdict */
  #onCandidate(verdict) {
    const candidate = this.#group?.candidates.find((c) => c.id === this.#candidate);
    if (candidate) this.#verdict(candidate, verdict);
  }

  /** @param {number} by */
  #step(by) {
    const at = this.#groups.findIndex((group) => group.object === this.#object);
    const next = this.#groups[(at + by + this.#groups.length) % Math.max(this.#groups.length, 1)];
    if (next) this.#choose(next.object);
  }
}

/** @param {NonNullable<CandidateGroup["placement"]>} placement */
function placement(placement) {
  /** @type {[string, string][]} */
  const rows = [
    ["Placed by", placement.method],
    ["Distance to the scan", `${(1000 * placement.rms_m).toFixed(1)} mm rms`],
    ["Silhouette overlap", `${(100 * placement.mask_iou).toFixed(0)} %`],
    ["Keypoints", `${placement.inliers} of ${placement.matches} agree`],
    [
      "Runner-up",
      placement.runner_up === null ? "none" : `${(100 * placement.runner_up).toFixed(0)} % of the winner's score`,
    ],
  ];
  return h(
    "div",
    { class: "stack" },
    placement.unsure ? h("span", { class: "chip warn" }, "unsure: another pose fits nearly as well") : "",
    h("dl", { class: "facts" }, ...rows.flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, value)])),
    ...placement.warnings.map((warning) => h("p", { class: "muted" }, warning)),
  );
}
