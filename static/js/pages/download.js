/** The bundle: formats, certificate, versions with checksums. */

import { ApiError, getCertificate, listBundles } from "../api.js";
import { h, icon, LiveElement } from "../dom.js";
import { certificateCard } from "../elements/results.js";
import { sayError } from "../elements/toasts.js";
import { bytes } from "../lib/format.js";
import { live } from "../live.js";

/** @typedef {import("../api-types").Bundle} Bundle */

const CONTENT = [
  ["scene.urdf", "URDF for ROS, PyBullet, SAPIEN, MuJoCo and Isaac's importer"],
  ["scene.xml", "MJCF with textures, for MuJoCo"],
  ["scene.usda", "USD with physics, for Isaac Sim and Omniverse"],
  ["scene.glb", "the scene for the web and for editors"],
  ["meshes/", "textured OBJ visuals and convex colliders, relative paths"],
  ["manifest.json", "every dimension and joint with where it came from"],
  ["review.html", "the scene to open and turn, in any browser, without a server"],
  ["report.html", "certificate and accuracy, for a person"],
];

export class DownloadPage extends LiveElement {
  project = "";
  #body = h("div", { class: "page stack" });

  connected() {
    this.replaceChildren(this.#body);
    live.addEventListener("project", () => this.#load(), { signal: this.signal });
    this.#load();
  }

  async #load() {
    try {
      const bundles = await listBundles(this.project);
      const newest = bundles[0];
      if (!newest) return this.#empty();
      const certificate = await getCertificate(this.project).catch((error) => {
        if (error instanceof ApiError && error.status === 409) return null;
        throw error;
      });
      this.#body.replaceChildren(
        h("header", {}, h("h1", {}, "Download"), button(newest)),
        newest.current
          ? ""
          : h("p", { class: "chip warn" }, "Something was changed since this bundle was made: run again."),
        h("div", { class: "split" }, content(this.project), certificate ? certificateCard(certificate) : ""),
        versions(bundles),
      );
    } catch (error) {
      sayError(error);
    }
  }

  #empty() {
    this.#body.replaceChildren(
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
}

/** @param {Bundle} bundle */
function button(bundle) {
  const link = h("a", { class: "button primary", href: bundle.url, download: bundle.file_name });
  link.append(icon("download"), `Bundle ${bundle.version}, ${bytes(bundle.size)}`);
  return link;
}

/** @param {string} project */
function content(project) {
  const report = h("a", { href: `/media/${project}/report.html`, target: "_blank" }, "Open the report");
  const scene = h("a", { href: `/media/${project}/review.html`, target: "_blank" }, "Open the scene in 3D");
  return h(
    "section",
    { class: "card stack" },
    h("h2", {}, "What is inside"),
    h(
      "dl",
      { class: "facts" },
      ...CONTENT.flatMap(([name, text]) => [h("dt", {}, h("code", {}, name ?? "")), h("dd", {}, text ?? "")]),
    ),
    h("p", { class: "row" }, report, scene),
  );
}

/** @param {Bundle[]} bundles */
function versions(bundles) {
  const rows = bundles.map((bundle) =>
    h(
      "tr",
      {},
      h("td", {}, h("a", { href: bundle.url, download: bundle.file_name }, `version ${bundle.version}`)),
      h("td", {}, new Date(bundle.created * 1000).toLocaleString()),
      h("td", {}, bundle.passed === null ? "–" : bundle.passed ? "certified" : "with findings"),
      h("td", { class: "number" }, bytes(bundle.size)),
      h("td", { class: "mono", title: bundle.sha256 }, `${bundle.sha256.slice(0, 16)}…`),
    ),
  );
  const titles = ["Bundle", "Made", "Certificate", "Size", "SHA-256"];
  return h(
    "section",
    { class: "card stack" },
    h("h2", {}, "Versions"),
    h(
      "table",
      {},
      h("thead", {}, h("tr", {}, ...titles.map((title) => h("th", { scope: "col" }, title)))),
      h("tbody", {}, ...rows),
    ),
  );
}
