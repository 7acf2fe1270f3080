/**
 * List of the segmenter's proposals, to confirm or dismiss. Emits "proposals-changed" (redraw the outlines), "show-frame"
 * frame, "confirming" (objects are about to be created), "objects-made" SceneObject[]. The page reads a frame's outlines with
 * `outlinesOn`.
 */

import { getFoundFronts, getProposals, restoreProposals } from "../api.js";
import { confirmProposals, dismissProposals } from "../changes.js";
import { detailOf, h, icon, LiveElement, renew, reveal } from "../dom.js";
import { Answers } from "../lib/answers.js";
import { counted } from "../lib/format.js";
import { alike, kindOf } from "../lib/likeness.js";
import { neighbour, proposedAt, surest } from "../lib/proposals.js";
import { live } from "../live.js";
import { outbox } from "../outbox.js";
import { say, sayError } from "./toasts.js";

/** @typedef {import("../api-types").Proposal} Proposal */
/** @typedef {import("../api-types").Proposals} Proposals */
/** @typedef {import("../api-types").SceneObject} SceneObject */

const SOON_MS = 400;

export class ProposalList extends LiveElement {
  project = "";
  #answers = new Answers();
  /** @type {Proposals} */
  #all = { state: "none", fraction: 0, items: [], dismissed: 0 };
  /** @type {string | null} */
  #current = null;
  /**
   * The object that the list is filtered by.
   * @type {{ id: number, name: string, kind: import("../lib/likeness.js").Kind } | null}
   */
  #like = null;
  #heading = h("h2", {}, "Proposals");
  #progress = h("progress", { max: 1, value: 0, "aria-label": "Looking for objects" });
  #note = h("p", { class: "muted", role: "status" });
  #list = h("ul", { class: "proposal-list" });
  #least = h(
    "select",
    { "aria-label": "Least confidence", title: "Confirm all from here up" },
    ...[95, 90, 80, 70, 50].map((percent) => h("option", { value: String(percent / 100) })),
  );
  #every = h("button", { type: "button" });
  #bulk = h("div", { class: "row" }, this.#every, h("span", { class: "muted" }, "at least"), this.#least);
  #leftOut = h("p", { class: "doubt", hidden: true });
  #restore = h("button", { type: "button", class: "quiet" });
  #others = h("button", { type: "button", class: "quiet", onClick: () => this.findLike(null) }, "All proposals");
  #timer = 0;
  /** @type {Set<string>} ids that are being confirmed or dismissed */
  #going = new Set();
  #saving = Promise.resolve();

  connected() {
    this.#least.value = "0.8";
    this.replaceChildren(
      h(
        "section",
        { class: "proposals", "aria-label": "Proposals" },
        this.#heading,
        this.#progress,
        this.#note,
        this.#others,
        this.#bulk,
        this.#leftOut,
        this.#list,
        this.#restore,
      ),
    );
    const { signal } = this;
    this.#least.addEventListener("change", () => this.#draw(), { signal });
    this.#every.addEventListener("click", () => this.confirmAll(), { signal });
    this.#restore.addEventListener(
      "click",
      () => this.#act(async () => this.#take(await restoreProposals(this.project))),
      {
        signal,
      },
    );
    live.addEventListener("proposals", (event) => this.#told(detailOf(event)), { signal });
    live.addEventListener("object", () => this.#soon(), { signal });
    live.addEventListener("hello", (event) => detailOf(event).reset && this.#soon(), { signal });
    signal.addEventListener("abort", () => clearTimeout(this.#timer));
    this.#draw();
    this.load();
  }

  async load() {
    if (!this.project) return;
    try {
      await this.#answers.take(getProposals(this.project, this.signal), (found) => this.#take(found));
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {number} frame */
  outlinesOn(frame) {
    return this.#items
      .filter((item) => item.frame === frame)
      .map((item) => ({
        points: item.outline,
        handle: item.handle,
        label: `${item.category} ${percent(item)}`,
        current: item.id === this.#current,
      }));
  }

  /** The proposal that clicks of a new object are on. @param {import("../api-types").PointIn[]} points */
  at(points) {
    const on = points.find(({ label }) => label === 1);
    return on && proposedAt(this.#all.items, on);
  }

  /** One-line hint of the available actions; null when nothing is highlighted. */
  get tip() {
    const chosen = this.#chosen;
    if (!this.#like || !chosen)
      return chosen && `Y makes this ${chosen.category} an object, X dismisses it, N goes on.`;
    const { name, kind } = this.#like;
    return `Like ${name}? Enter makes this a ${kind.category}, X dismisses it, N goes on, Esc ends.`;
  }

  /** Whether the list is filtered by likeness to an object. */
  get likeOne() {
    return this.#like !== null;
  }

  /**
   * Filter by likeness to an object, the most alike first, and highlight the first; null shows all.
   * @param {SceneObject | null} object
   */
  async findLike(object) {
    try {
      const fronts = object ? await getFoundFronts(this.project) : [];
      const kind =
        object &&
        kindOf(
          object.category,
          fronts.find((front) => front.object === object.id),
        );
      this.#like = object && kind && { id: object.id, name: object.name, kind };
      this.#show(object ? (this.#items[0] ?? null) : null);
      if (object) this.scrollIntoView({ block: "nearest" });
    } catch (error) {
      sayError(error);
    }
  }

  /** Proposals shown: all, or those like one object, sorted by likeness. */
  get #items() {
    return this.#like ? alike(this.#like.kind, this.#all.items) : this.#all.items;
  }

  /** @param {1 | -1} step */
  move(step) {
    this.#show(neighbour(this.#items, this.#current, step));
  }

  /** Confirm the highlighted proposal and go to the next; if none is highlighted, only show the first. */
  confirm() {
    if (!this.#chosen) return this.move(1);
    return this.#confirm([this.#chosen.id]);
  }

  dismiss() {
    const chosen = this.#chosen;
    if (!chosen) return this.move(1);
    this.#dismiss(chosen);
  }

  confirmAll() {
    const ids = surest(this.#items, Number(this.#least.value)).sure.map((item) => item.id);
    if (ids.length) this.#confirm(ids);
  }

  get #chosen() {
    return this.#items.find((item) => item.id === this.#current) ?? null;
  }

  /** @param {string[]} ids */
  #confirm(ids) {
    const category = this.#like?.kind.category;
    this.emit("confirming");
    this.#leave(ids, async () => {
      const made = await outbox.send(confirmProposals(this.project, ids, category));
      this.emit("objects-made", made);
      say(made.length === 1 ? `Confirmed ${made[0]?.name}` : `Confirmed ${counted(made.length, "proposal")}`);
    });
  }

  /** @param {Proposal} item */
  #dismiss(item) {
    this.#leave([item.id], async () => {
      await outbox.send(dismissProposals(this.project, [item.id]));
    });
  }

  /**
   * Remove proposals from the list and go to the next at once; changes are then stored one at a time.
   * @param {string[]} ids
   * @param {() => Promise<void>} change
   */
  #leave(ids, change) {
    const next = ids.length === 1 ? neighbour(this.#items, ids[0] ?? null, 1, new Set(ids)) : null;
    for (const id of ids) this.#going.add(id);
    this.#all = { ...this.#all, items: this.#all.items.filter((item) => !this.#going.has(item.id)) };
    this.#show(next);
    this.#act(change, ids);
  }

  /**
   * @param {() => Promise<void>} change
   * @param {string[]} ids
   */
  #act(change, ids = []) {
    this.#saving = this.#saving
      .then(change)
      .catch(sayError)
      .then(() => {
        for (const id of ids) this.#going.delete(id);
        return this.load();
      });
  }

  /** @param {Proposal | null} item */
  #show(item) {
    this.#current = item?.id ?? null;
    this.#draw();
    reveal(this.#list.querySelector(".current"));
    if (item) this.emit("show-frame", item.frame);
    this.emit("proposals-changed");
  }

  /** @param {Proposals} all */
  #take(all) {
    this.#all = { ...all, items: all.items.filter((item) => !this.#going.has(item.id)) };
    if (!this.#chosen) this.#current = null;
    this.#draw();
    this.emit("proposals-changed");
  }

  /** @param {{ fraction: number, changed: boolean }} message */
  #told({ fraction, changed }) {
    if (changed || this.#all.state === "none") return this.#soon();
    this.#all = { ...this.#all, fraction };
    this.#drawState();
  }

  /** Reload, debounced: many objects change while masks arrive. */
  #soon() {
    clearTimeout(this.#timer);
    this.#timer = window.setTimeout(() => this.load(), SOON_MS);
  }

  #draw() {
    this.#drawState();
    const items = this.#items;
    const { sure, leftOut } = surest(items, Number(this.#least.value));
    for (const option of this.#least.options)
      option.text = `${Math.round(100 * Number(option.value))} % ${this.#like ? "alike" : "sure"}`;
    this.#bulk.hidden = !items.length;
    this.#others.hidden = !this.#like;
    this.#every.textContent = sure.length ? `Confirm ${sure.length}` : "None";
    this.#every.disabled = sure.length === 0;
    this.#leftOut.hidden = !leftOut.length;
    this.#leftOut.textContent = `${counted(leftOut.length, "proposal")} left out, to be looked at one by one: ${leftOut.map(({ category, doubts }) => `${category} ${doubts[0]}`).join("; ")}.`;
    renew(this.#list, ...items.map((item) => this.#row(item)));
    this.#restore.hidden = this.#all.dismissed === 0;
    this.#restore.textContent = `Bring back ${this.#all.dismissed} dismissed`;
  }

  #drawState() {
    const { state, fraction } = this.#all;
    const items = this.#items;
    this.#heading.textContent = `${this.#like ? `Like ${this.#like.name}` : "Proposals"} (${items.length})`;
    this.#progress.hidden = state !== "running";
    this.#progress.value = fraction;
    this.#note.textContent =
      state === "running"
        ? `Looking for fronts and things… ${Math.round(100 * fraction)} %`
        : this.#like
          ? likeNote(this.#like, items.length)
          : items.length
            ? "Y confirms the highlighted one, X dismisses it, N and P move."
            : state === "done"
              ? "Nothing left to confirm. Click what is missing."
              : "They appear once the scan is prepared.";
  }

  /** @param {Proposal} item */
  #row(item) {
    const current = item.id === this.#current;
    const name = `${item.category} on frame ${item.frame}`;
    const about = `${percent(item)}${this.#like ? " alike" : ""} · ${size(item)}`;
    const pick = h(
      "button",
      {
        type: "button",
        class: "pick",
        "aria-pressed": String(current),
        "aria-label": `${item.category} ${about}, proposed on frame ${item.frame}`,
      },
      h("strong", {}, item.category),
      " ",
      h("span", { class: "muted" }, about),
      ...item.doubts.map((text) => h("span", { class: "doubt" }, text)),
    );
    pick.addEventListener("click", () => this.#show(item));
    const yes = h("button", { type: "button", class: "quiet", "aria-label": `Confirm the ${name}` }, icon("check"));
    yes.addEventListener("click", () => this.#confirm([item.id]));
    const no = h("button", { type: "button", class: "quiet", "aria-label": `Dismiss the ${name}` }, icon("cross"));
    no.addEventListener("click", () => this.#dismiss(item));
    pick.dataset.at = `pick:${item.id}`;
    yes.dataset.at = `confirm:${item.id}`;
    no.dataset.at = `dismiss:${item.id}`;
    return h("li", { class: current ? "current" : "" }, pick, yes, no);
  }
}

/** @param {{ name: string, kind: import("../lib/likeness.js").Kind }} like @param {number} count */
function likeNote({ name, kind }, count) {
  if (!count) return `No proposal is like ${name}. Click what is missing.`;
  const by = kind.sides ? "By category, size and handle." : "By category: it has no flat front to compare.";
  return `${by} Enter confirms the highlighted one as ${kind.category}, Shift+Enter all that are as similar, X dismisses, Esc ends.`;
}

/** @param {Proposal} item */
function percent(item) {
  return `${Math.round(100 * item.confidence)} %`;
}

/** @param {Proposal} item width × height, in centimetres */
function size(item) {
  const [width = 0, , height = 0] = item.size_m;
  return `${Math.round(100 * width)} × ${Math.round(100 * height)} cm`;
}
