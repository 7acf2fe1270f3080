/** Download page: formats of the bundle, certificate, versions with checksums. */

import {
  ApiError,
  bundleInside,
  checkBundle,
  compareBundles,
  getCertificate,
  getSystem,
  listBundles,
  listJobs,
} from "../api.js";
import { detailOf, h, icon, LiveElement, spinner } from "../dom.js";
import { assetCard, robotCard, simulatorCard } from "../elements/bundle-inside.js";
import { certificateCard } from "../elements/results.js";
import { say, sayError } from "../elements/toasts.js";
import { VariantSets } from "../elements/variant-sets.js";
import { Answers } from "../lib/answers.js";
import { bytes, counted } from "../lib/format.js";
import { live } from "../live.js";

/** @typedef {import("../api-types").Bundle} Bundle */

const CONTENT = [
  ["assets/", "a complete folder for each object: its files in each format, textured OBJ visuals and convex colliders"],
  ["manifest.json", "every dimension and joint with where it came from"],
  ["review.html", "the scene to open and turn, in any browser, without a server"],
  ["report.html", "certificate and accuracy, for a person"],
];

export class DownloadPage extends LiveElement {
  project = "";
  #answers = new Answers();
  #variants = new VariantSets();
  #run = ""; // state of the newest run that was heard of

  connected() {
    this.#variants.project = this.project;
    this.#variants.hidden = true;
    this.replaceChildren(h("div", { class: "page stack" }, spinner("Loading the bundle…"), this.#variants));
    live.addEventListener("project", () => this.#load(), { signal: this.signal });
    live.addEventListener("job", (event) => this.#hear(detailOf(event).job), { signal: this.signal });
    this.#load();
  }

  /** Load again when a run begins or ends. @param {import("../api-types").Job} job */
  #hear({ project, kind, state }) {
    if (project !== this.project || kind !== "run" || state === this.#run) return;
    this.#run = state;
    this.#load();
  }

  async #load() {
    try {
      await this.#answers.take(everything(this.project), (all) => this.#draw(all));
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {Awaited<ReturnType<typeof everything>>} all */
  #draw({ bundles, formats, certificate, inside, running }) {
    const newest = bundles[0];
    if (!newest) return this.#empty();
    this.#variants.hidden = false;
    this.#around(
      h(
        "header",
        {},
        h("h1", {}, "Download"),
        h("a", { class: "button", href: `/p/${this.project}/review` }, "Review"),
      ),
      newest.current
        ? ""
        : h(
            "p",
            { class: "chip warn" },
            `Something was changed since this bundle was made: ${running ? "the next one is being computed" : "run again"}.`,
          ),
      h("div", { class: "split" }, this.#choice(newest, formats), certificate ? certificateCard(certificate) : ""),
      inside ? h("div", { class: "split" }, simulatorCard(inside, certificate), assetCard(inside, newest)) : "",
    );
    this.#variants.after(...(inside?.robots ?? []).map(robotCard), this.#versions(bundles));
  }

  /**
   * Redraw the page except the variants, where the user may be typing. Unfolded details and the keyboard focus are kept.
   * @param {...(Node | string)} before content above the variants
   */
  #around(...before) {
    /** @param {string} which @returns {HTMLElement | null} */
    const one = (which) => this.querySelector(which);
    const [unfolded, at] = ["details[open] > [data-at]", "[data-at]:focus"].map(
      (which) => one(which)?.dataset.at ?? "",
    );
    for (const child of [...(this.#variants.parentElement?.childNodes ?? [])])
      if (child !== this.#variants) child.remove();
    this.#variants.before(...before);
    const details = one(`[data-at="${CSS.escape(unfolded ?? "")}"]`)?.parentElement;
    if (details instanceof HTMLDetailsElement) details.open = true;
    one(`[data-at="${CSS.escape(at ?? "")}"]`)?.focus({ preventScroll: true });
  }

  #empty() {
    this.#around(
      h("header", {}, h("h1", {}, "Download")),
      h(
        "section",
        { class: "card empty" },
        h("h2", {}, "No bundle yet"),
        h("p", { class: "muted" }, "The bundle is written at the end of a run."),
        h("a", { class: "button primary", href: `/p/${this.project}/run` }, "Go to Run"),
      ),
    );
  }

  /**
   * Choice of formats, and the download button.
   * @param {Bundle} bundle
   * @param {import("../api-types").BundleFormat[]} formats
   */
  #choice(bundle, formats) {
    const boxes = formats.map(({ name }) => h("input", { type: "checkbox", value: name, checked: true }));
    const link = h(
      "a",
      { class: "button primary", download: "" },
      icon("download"),
      `Bundle ${bundle.version}, ${bytes(bundle.size)}`,
    );
    const draw = () => {
      const chosen = boxes.filter((box) => box.checked).map((box) => ["formats", box.value]);
      const all = chosen.length === boxes.length;
      link.href = all ? bundle.url : `${bundle.url}?${new URLSearchParams(chosen)}`;
      link.toggleAttribute("inert", !chosen.length);
      link.lastChild?.replaceWith(
        all ? `Bundle ${bundle.version}, ${bytes(bundle.size)}` : `Bundle ${bundle.version}, chosen formats`,
      );
    };
    for (const box of boxes) box.addEventListener("change", draw);
    draw();
    const lines = formats.map(({ file, opened_by }, k) =>
      h("label", { class: "row" }, boxes[k], h("code", {}, file), h("span", { class: "muted" }, opened_by)),
    );
    return h(
      "section",
      { class: "card stack" },
      h("h2", {}, "What is inside"),
      h("fieldset", { class: "choices" }, h("legend", {}, "Formats"), ...lines),
      h(
        "dl",
        { class: "facts" },
        ...CONTENT.flatMap(([name, text]) => [h("dt", {}, h("code", {}, name ?? "")), h("dd", {}, text ?? "")]),
      ),
      h("p", { class: "row" }, link, ...looks(this.project)),
      this.#check(bundle),
    );
  }

  /** Button that runs the linter and checks the checksum. @param {Bundle} bundle */
  #check(bundle) {
    const said = h("div", { role: "status" });
    const ask = h("button", { type: "button" }, "Check it now");
    ask.addEventListener("click", async () => {
      said.replaceChildren("Reading every file…");
      try {
        const { intact, findings } = await checkBundle(this.project, bundle.version);
        const errors = findings.filter((finding) => finding.severity === "error");
        said.replaceChildren(
          h(
            "span",
            { class: `chip ${intact ? "good" : "bad"}` },
            intact ? "bytes as certified" : "bytes changed since",
          ),
          h(
            "span",
            { class: `chip ${errors.length ? "bad" : "good"}` },
            errors.length ? counted(errors.length, "error") : "lint passed",
          ),
          ...findings.map(({ where, message }) => h("p", { class: "muted" }, `${where}: ${message}`)),
        );
      } catch (error) {
        said.replaceChildren();
        sayError(error);
      }
    });
    return h("div", { class: "row" }, ask, said);
  }

  /** @param {Bundle[]} bundles newest first */
  #versions(bundles) {
    const rows = bundles.map((bundle, k) => this.#row(bundle, bundles[k + 1]));
    const titles = ["Bundle", "Made", "Certificate", "Size", "SHA-256", "Since the version before"];
    return h(
      "section",
      { class: "card stack scroll" },
      h("h2", {}, "Versions"),
      h(
        "table",
        {},
        h("thead", {}, h("tr", {}, ...titles.map((title) => h("th", { scope: "col" }, title)))),
        h("tbody", {}, ...rows),
      ),
    );
  }

  /**
   * @param {Bundle} bundle
   * @param {Bundle | undefined} before
   */
  #row(bundle, before) {
    const changes = h(
      "td",
      {},
      before ? h("button", { type: "button", class: "quiet" }, "What changed?") : "the first",
    );
    changes.querySelector("button")?.addEventListener("click", async () => {
      try {
        const found = await compareBundles(this.project, bundle.version, before?.version ?? bundle.version);
        const lines = found.map(({ object, text }) => h("li", {}, object ? h("strong", {}, object) : "", ` ${text}`));
        changes.replaceChildren(lines.length ? h("ul", { class: "plain" }, ...lines) : "no visible change");
      } catch (error) {
        sayError(error);
      }
    });
    const copy = h(
      "button",
      { type: "button", class: "quiet", "aria-label": `Copy the checksum of version ${bundle.version}` },
      "Copy",
    );
    copy.addEventListener("click", () =>
      navigator.clipboard.writeText(bundle.sha256).then(() => say("Checksum copied"), sayError),
    );
    return h(
      "tr",
      {},
      h("td", {}, h("a", { href: bundle.url, download: bundle.file_name }, `version ${bundle.version}`)),
      h("td", {}, new Date(bundle.created * 1000).toLocaleString()),
      h("td", {}, bundle.passed === null ? "–" : bundle.passed ? "certified" : "with findings"),
      h("td", { class: "number" }, bytes(bundle.size)),
      h("td", { class: "mono", title: bundle.sha256 }, `${bundle.sha256.slice(0, 16)}… `, copy),
      changes,
    );
  }
}

/** Data of the page; there is no certificate before the first run is done. @param {string} project */
async function everything(project) {
  const [bundles, { formats }, jobs] = await Promise.all([listBundles(project), getSystem(), listJobs(project)]);
  const running = jobs.some(({ kind, state }) => kind === "run" && ["queued", "running"].includes(state));
  const newest = bundles[0];
  if (!newest) return { bundles, formats, running, certificate: null, inside: null };
  const [certificate, inside] = await Promise.all([
    getCertificate(project).catch((error) => {
      if (error instanceof ApiError && error.status === 409) return null;
      throw error;
    }),
    bundleInside(project, newest.version),
  ]);
  return { bundles, formats, running, certificate, inside };
}

/** @param {string} project */
function looks(project) {
  return [
    h("a", { href: `/media/${project}/report.html`, target: "_blank" }, "Open the report"),
    h("a", { href: `/media/${project}/review.html`, target: "_blank" }, "Open the scene in 3D"),
  ];
}
