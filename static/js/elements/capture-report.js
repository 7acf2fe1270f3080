/** Capture quality report: verdict, problems with advice, pictures of the scan, and plots over the frames. */

import { h, shape } from "../dom.js";
import { strips } from "../lib/strips.js";

/** @typedef {import("../api-types").CaptureFacts} CaptureFacts */
/** @typedef {import("../lib/strips.js").Strip} Strip */

const HEIGHT = 28;

/**
 * The verdict with its remarks, worst first.
 * @param {CaptureFacts} capture
 * @param {number} notices number of notices listed below the card
 */
export function verdictCard(capture, notices) {
  return h(
    "div",
    { class: "stack verdict" },
    h("p", {}, h("span", { class: `chip ${tone(capture.verdict)}` }, capture.verdict || "not examined")),
    capture.remarks.length
      ? h("ol", { class: "remarks" }, ...capture.remarks.map(remarkLine))
      : h(
          "p",
          { class: "muted" },
          notices
            ? "No problem is left; what was noted or corrected on reading is listed below."
            : "Poses, depth and colour agree; no problem was found.",
        ),
  );
}

/** @param {CaptureFacts["remarks"][number]} remark */
function remarkLine(remark) {
  return h(
    "li",
    { class: tone(remark.verdict) },
    h("span", {}, sentence(remark.text)),
    h("span", { class: "muted" }, sentence(remark.advice)),
  );
}

/**
 * Pictures of the fused scan, from above and from the camera's viewpoint.
 * @param {string} project
 * @param {string} version
 */
export function scanPictures(project, version) {
  /** @type {[string, string, string][]} */
  const sides = [
    ["plan", "From above", "The scan from above, with the camera's path"],
    ["view", "From where it was filmed", "The scan from where it was filmed, with the camera's path"],
  ];
  return h(
    "div",
    { class: "scan-pictures" },
    ...sides.map(([side, caption, alt]) => {
      const src = `/media/${encodeURIComponent(project)}/scan/${side}.png?v=${version}`;
      const image = h("img", { src, alt, width: 960, height: 640, loading: "lazy" });
      const figure = h("figure", {}, image, h("figcaption", { class: "muted" }, caption));
      image.addEventListener("error", () => figure.remove()); // projects imported by older versions have no pictures
      return figure;
    }),
    h(
      "p",
      { class: "muted path-key" },
      h("span", { class: "path-start" }),
      "the camera's path begins",
      h("span", { class: "path-end" }),
      "and ends",
    ),
  );
}

/**
 * Plots of sharpness, depth, brightness and disagreement over the frames.
 * @param {CaptureFacts} capture
 */
export function momentStrips(capture) {
  if (capture.moments.length < 2) return null;
  return h(
    "dl",
    { class: "strips" },
    ...strips(capture.moments).flatMap((strip) => [
      h("dt", {}, strip.name),
      h("dd", {}, plot(strip), h("span", { class: "muted" }, strip.summary)),
    ]),
  );
}

/**
 * Collapsed table of all measured figures.
 * @param {CaptureFacts} capture
 */
export function allFigures(capture) {
  if (!capture.figures.length) return null;
  return h(
    "details",
    {},
    h("summary", {}, "All figures"),
    h(
      "dl",
      { class: "facts" },
      ...capture.figures.flatMap(({ name, value }) => [h("dt", {}, name), h("dd", {}, value)]),
    ),
  );
}

/** @param {Strip} strip */
function plot(strip) {
  const bars = strip.bars.map((bar, k) => {
    const height = Math.max(bar.height * HEIGHT, 1);
    const place = { x: k + 0.1, width: 0.8, y: HEIGHT - height, height, ...(bar.off && { class: "off" }) };
    return shape("rect", place, shape("title", {}, `frame ${bar.frame}: ${bar.text}`));
  });
  return shape(
    "svg",
    {
      viewBox: `0 0 ${strip.bars.length} ${HEIGHT}`,
      preserveAspectRatio: "none",
      role: "img",
      "aria-label": `${strip.name} over the frames: ${strip.summary}`,
    },
    ...bars,
  );
}

/** @param {string} verdict */
function tone(verdict) {
  return verdict === "good" ? "good" : verdict === "unusable" ? "bad" : "warn";
}

/** @param {string} text */
function sentence(text) {
  return `${text.charAt(0).toUpperCase()}${text.slice(1)}.`;
}
