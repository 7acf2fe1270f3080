/** Contents of a bundle for robotics: single objects, results of robot trials, and code for each simulator. */

import { h } from "../dom.js";
import { counted } from "../lib/format.js";
import { say, sayError } from "./toasts.js";

/** @typedef {import("../api-types").BundleInside} BundleInside */
/** @typedef {import("../api-types").Certificate} Certificate */
/** @typedef {import("../api-types").Bundle} Bundle */

/**
 * Card of objects to download one by one.
 * @param {BundleInside} inside
 * @param {Bundle} bundle
 */
export function assetCard(inside, bundle) {
  return h(
    "section",
    { class: "card stack" },
    h("h2", {}, "Each object alone"),
    inside.assets.length ? assetTable(inside) : h("p", { class: "muted" }, "This bundle has no separate objects."),
    ...(inside.robots.some((robot) => robot.map) ? [] : armLines(bundle)),
  );
}

/** Instructions to test a bundle with an arm, for bundles without a trial. @param {Bundle} bundle */
function armLines(bundle) {
  return [
    h("h3", {}, "Where an arm may stand"),
    h(
      "p",
      { class: "muted" },
      "Choose a Franka Panda on the Overview before a run, and it tries every joint. To test a downloaded bundle, with films (pip install 'r2c2r[arm]'):",
    ),
    copyable(`r2c2r check ${bundle.file_name} --arm --films films/`, "the line that lets an arm try it"),
  ];
}

/** @param {BundleInside} inside */
function assetTable(inside) {
  const rows = inside.assets.map(({ name, category, formats, url }) =>
    h(
      "tr",
      {},
      h("th", { scope: "row" }, name),
      h("td", {}, category),
      h("td", { class: "mono" }, formats.map((suffix) => suffix.slice(1)).join(", ")),
      h("td", {}, h("a", { href: url, download: "", "aria-label": `Download ${name} alone` }, "Download")),
    ),
  );
  return region("Objects to download alone", table(["Object", "Category", "Files", "Zip"], rows));
}

/** Keyframes that show the moments of a sheet of two rows of four, each for the same time. */
const MOMENTS = Array.from({ length: 8 }, (_, k) => ({
  translate: `${-25 * (k % 4)}% ${k < 4 ? 0 : -50}%`,
  offset: k / 8,
  easing: "step-end",
}));

/**
 * Card of one robot: its result for each grip, pictures, and base positions.
 * @param {BundleInside["robots"][number]} robot
 */
export function robotCard(robot) {
  if (robot.why) {
    return h("section", { class: "card stack" }, h("h2", {}, robot.name), h("p", {}, `Not tried: ${robot.why}`));
  }
  const rows = robot.grips.map((grip) =>
    h(
      "tr",
      {},
      h("td", {}, grip.picture ? film(grip.picture, `${robot.name} at ${grip.name}`) : "–"),
      h("th", { scope: "row" }, grip.name),
      h("td", {}, h("span", { class: `chip ${grip.passed ? "good" : "bad"}` }, grip.passed ? "done" : "not done")),
      h("td", {}, grip.method ?? "–"),
      h("td", { class: "number" }, grip.opened === null ? "–" : `${Math.round(100 * grip.opened)}\u00a0%`),
      h("td", { class: "number" }, grip.grip_n === null ? "–" : `${grip.grip_n}\u00a0N`),
      h("td", { class: "muted notes" }, grip.why || "–"),
    ),
  );
  const titles = ["Moments", "Where", "Done", "How", "Opened", "Grip", "Why not"];
  return h(
    "section",
    { class: "card stack" },
    h("h2", {}, robot.name),
    h("p", {}, `Opened and closed ${robot.joints_opened} of ${counted(robot.joints, "joint")} by friction alone.`),
    robot.map ? standing(robot, robot.map) : null,
    region(`What ${robot.name} did`, table(titles, rows)),
  );
}

/**
 * @param {BundleInside["robots"][number]} robot
 * @param {string} address
 */
function standing(robot, address) {
  const places = robot.places.map(({ x_m, y_m, lift_m, joints }) =>
    h("li", {}, `x ${x_m.toFixed(1)}, y ${y_m.toFixed(1)} m, lifted ${lift_m.toFixed(1)} m: ${joints.join(", ")}`),
  );
  return h(
    "div",
    { class: "split" },
    linked(address, sheet(address, "The floor plan with the places where it may stand")),
    h("div", {}, h("h3", {}, "Where to stand"), h("ol", {}, ...places)),
  );
}

/**
 * @param {BundleInside} inside
 * @param {Certificate | null} certificate
 */
export function simulatorCard(inside, certificate) {
  return h(
    "section",
    { class: "card stack" },
    h("h2", {}, "Load it in your simulator"),
    h("p", { class: "muted" }, "Unpack the bundle and run these in its folder."),
    ...inside.simulators.map((lines, k) => simulator(lines, certificate, k === 0)),
  );
}

/**
 * @param {BundleInside["simulators"][number]} lines
 * @param {Certificate | null} certificate
 * @param {boolean} open
 */
function simulator({ simulator: name, install, code, note, loader }, certificate, open) {
  const verdict = certificate?.loaders.find((result) => result.loader === loader);
  const tone = verdict?.state === "passed" ? "good" : verdict?.state === "failed" ? "bad" : "";
  const tried = verdict ? `${verdict.loader}: ${verdict.state}` : "not tested by the certificate";
  return h(
    "details",
    { class: "simulator", name: "simulator", open },
    h(
      "summary",
      { "data-at": `simulator:${name}` },
      name,
      " ",
      h("span", { class: `chip ${tone}`, title: verdict?.detail ?? "" }, tried),
    ),
    h("p", { class: "muted" }, install),
    copyable(code, `the lines for ${name}`),
    note ? h("p", { class: "muted" }, note) : null,
  );
}

/**
 * Code block with a copy button.
 * @param {string} text
 * @param {string} what
 */
function copyable(text, what) {
  const copy = h(
    "button",
    { type: "button", class: "quiet", "aria-label": `Copy ${what}`, "data-at": `copy:${what}` },
    "Copy",
  );
  copy.addEventListener("click", () => navigator.clipboard.writeText(text).then(() => say("Copied"), sayError));
  return h("div", { class: "copyable" }, h("pre", { tabIndex: 0, role: "region", "aria-label": what }, text), copy);
}

/**
 * Link with a picture to its full-size image.
 * @param {string} address
 * @param {HTMLElement} picture
 */
function linked(address, picture) {
  return h("a", { href: address, target: "_blank" }, picture);
}

/**
 * @param {string} address
 * @param {string} text
 */
function sheet(address, text) {
  return h("img", { src: address, alt: text, loading: "lazy", class: "sheet" });
}

/**
 * Contact sheet of eight moments with a button that shows them one after another.
 * @param {string} address
 * @param {string} text
 */
function film(address, text) {
  const moments = sheet(address, text);
  const frame = h("div", { class: "film" }, linked(address, moments));
  /** @type {Animation | undefined} */
  let shown;
  const play = h(
    "button",
    {
      class: "quiet",
      "aria-label": `Play ${text}`,
      "aria-pressed": "false",
      "data-at": `film:${address}`,
      onclick: () => {
        const playing = frame.classList.toggle("playing");
        play.setAttribute("aria-pressed", String(playing));
        shown?.cancel();
        if (playing) shown = moments.animate(MOMENTS, { duration: 600 * MOMENTS.length, iterations: Infinity });
      },
    },
    "Play",
  );
  return h("div", { class: "film-row" }, frame, play);
}

/**
 * @param {string[]} titles
 * @param {HTMLElement[]} rows
 */
function table(titles, rows) {
  const head = titles.map((title) => h("th", { scope: "col" }, title));
  return h("table", {}, h("thead", {}, h("tr", {}, ...head)), h("tbody", {}, ...rows));
}

/**
 * Scrollable region for wide content.
 * @param {string} label
 * @param {HTMLElement} content
 */
function region(label, content) {
  return h("div", { class: "scroll", tabIndex: 0, role: "region", "aria-label": label }, content);
}
