/** Variants of bundles for training: count and seed, their cost, the job that makes them, and the existing sets. */

import { deleteVariants, listJobs, listVariants, makeVariants } from "../api.js";
import { detailOf, h, icon, LiveElement, renew } from "../dom.js";
import { Answers } from "../lib/answers.js";
import { bytes, counted } from "../lib/format.js";
import { variantsTake } from "../lib/variants.js";
import { live } from "../live.js";
import { JobPanel } from "./job-panel.js";
import { sayError } from "./toasts.js";

/** @typedef {import("../api-types").Job} Job */
/** @typedef {import("../api-types").Variants} Variants */
/** @typedef {import("../api-types").VariantSet} VariantSet */
/** @typedef {import("../api-types").VariantsOffer} VariantsOffer */

const WHAT =
  "Sizes, masses, friction, colours and poses are drawn at random; all variants share the bundle's meshes and textures.";

export class VariantSets extends LiveElement {
  project = "";
  #answers = new Answers();
  /** @type {Variants} */
  #all = { offer: null, sets: [] };
  #job = new JobPanel();
  #count = h("input", { type: "number", min: "1", step: "1", value: "100", required: true });
  #seed = h("input", { type: "number", min: "0", max: String(2 ** 31 - 1), step: "1", value: "0", required: true });
  #take = h("p", { class: "muted", role: "status" });
  #make = h("button", { type: "submit", class: "primary" }, "Make variants");
  #form = h(
    "form",
    { class: "row" },
    h("label", {}, h("span", { class: "muted" }, "How many"), this.#count),
    h("label", {}, h("span", { class: "muted" }, "Seed"), this.#seed),
    this.#make,
  );
  #none = h("p", { class: "muted" }, "This bundle has no scene to vary: run the project again.");
  #sets = h("ul", { class: "variant-sets", "aria-label": "Variants that were made" });

  connected() {
    const { signal } = this;
    this.replaceChildren(
      h(
        "section",
        { class: "card stack" },
        h("h2", {}, "Variants for training"),
        h("p", { class: "muted" }, WHAT),
        this.#form,
        this.#take,
        this.#none,
        this.#job,
        this.#sets,
      ),
    );
    this.#form.addEventListener("submit", (event) => (event.preventDefault(), this.#ask()), { signal });
    this.#form.addEventListener("input", () => this.#tell(), { signal });
    live.addEventListener("project", () => this.#load(), { signal });
    live.addEventListener("job", (event) => this.#hear(/** @type {{ job: Job }} */ (detailOf(event)).job), { signal });
    live.addEventListener("online", () => this.#load(), { signal });
    this.#load();
  }

  async #load() {
    try {
      await this.#answers.take(Promise.all([listVariants(this.project), listJobs(this.project)]), ([all, jobs]) => {
        this.#show(all);
        this.#follow(jobs.find((job) => job.kind === "vary") ?? null);
      });
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {Job} job */
  #hear(job) {
    if (job.project === this.project && job.kind === "vary") this.#follow(job);
  }

  /** Show a job until it is done; its result is then listed with the sets. @param {Job | null} job */
  #follow(job) {
    this.#job.job = job?.state === "done" ? null : job;
  }

  async #ask() {
    const { offer } = this.#all;
    if (!offer) return;
    try {
      this.#follow(await makeVariants(this.project, { version: offer.version, ...this.#wish() }));
    } catch (error) {
      sayError(error);
    }
  }

  #wish() {
    return { count: this.#count.valueAsNumber, seed: this.#seed.valueAsNumber };
  }

  /** @param {Variants} all */
  #show(all) {
    this.#all = all;
    this.#none.hidden = all.offer !== null;
    this.#form.hidden = this.#take.hidden = all.offer === null;
    this.#count.max = String(all.offer?.most ?? "");
    this.#tell();
    this.#sets.hidden = !all.sets.length;
    renew(this.#sets, ...all.sets.map((made) => this.#set(made)));
  }

  /** Show the cost of the requested variants. */
  #tell() {
    const { offer, sets } = this.#all;
    if (!offer) return;
    const { count, seed } = this.#wish();
    const most = `At most ${offer.most} at a time; r2c2r vary makes more on the bundle that you download.`;
    const made = sets.some((one) => one.version === offer.version && one.count === count && one.seed === seed);
    const { text, fits } = variantsTake(offer, this.#count.validity.valid ? count : 0);
    this.#make.disabled = made || !fits;
    this.#take.textContent = made
      ? `These variants are listed below: another seed gives others. ${most}`
      : `${text} ${most}`;
  }

  /** @param {VariantSet} made */
  #set(made) {
    const { name, version, count, seed, checked, failed } = made;
    const title = `${counted(count, "variant")} of bundle ${version}, seed ${seed}`;
    const remove = h("button", { type: "button", class: "quiet", "aria-label": `Delete ${title}` }, "Delete");
    remove.dataset.at = `delete:${name}`;
    remove.addEventListener("click", () => this.#delete(name));
    const take = `Download, ${bytes(made.size)}`;
    const link = h(
      "a",
      { class: "button", href: made.url, download: made.file_name, "aria-label": `${take}: ${title}` },
      icon("download"),
      take,
    );
    link.dataset.at = `download:${name}`;
    const passed = `${checked - failed.length} of ${checked} checked are certified`;
    const rejected = Object.entries(made.rejected).map(([why, times]) => `${times} × ${why}`);
    const wall = h("img", { src: made.wall, alt: `The first of ${title}`, loading: "lazy", class: "sheet" });
    return h(
      "li",
      { class: "stack" },
      h("h3", {}, title),
      h("div", { class: "row" }, h("span", { class: `chip ${failed.length ? "warn" : "good"}` }, passed), link, remove),
      failed.length ? h("p", {}, `Not certified: ${failed.join(", ")}; leave them out.`) : null,
      h("p", { class: "muted" }, `Draws rejected: ${rejected.join(", ") || "none"}.`),
      h("a", { href: made.wall, target: "_blank" }, wall),
    );
  }

  /** Delete a set; the same seed recreates it. @param {string} name */
  async #delete(name) {
    try {
      await this.#answers.take(deleteVariants(this.project, name), (all) => this.#show(all));
    } catch (error) {
      sayError(error);
    }
  }
}
