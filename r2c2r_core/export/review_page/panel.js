// @ts-check
/** The panel beside the picture: verdict, a slider a joint, findings. */

/** @typedef {import("./scene.d.ts").Joint} Joint */

/**
 * @typedef {object} Wishes
 * @property {(body: number, value: number) => void} put
 * @property {(goalOf: (joint: Joint) => number) => void} sendAll
 * @property {(object: string | null) => void} flyTo
 * @property {(shown: boolean) => void} showColliders
 */

/** @param {string} id */
export function byId(id) {
  return /** @type {HTMLElement} */ (document.getElementById(id));
}

/**
 * Fill the panel; what is returned shows joint positions on it.
 * @param {import("./scene.d.ts").Scene} scene
 * @param {Wishes} wishes
 * @returns {(positions: number[]) => void}
 */
export function buildPanel(scene, wishes) {
  const verdict = byId("verdict");
  byId("name").textContent = scene.name;
  verdict.textContent = `Certificate ${scene.passed ? "passed" : "failed"}`;
  verdict.className = scene.passed ? "good" : "bad";
  const rows = scene.bodies.flatMap((body, k) =>
    body.joint ? [jointRow(body.joint, k, wishes)] : [],
  );
  byId("joints").append(...rows.map((row) => row.element));
  if (!rows.length) byId("joints").textContent = "Nothing in this scene opens.";
  const head = document.createElement("h2");
  head.textContent = scene.findings.length ? "Findings" : "No findings";
  const findings = scene.findings.map((one) => findingButton(one, wishes));
  byId("findings").append(head, ...findings);
  byId("open").addEventListener("click", () =>
    wishes.sendAll((joint) => joint.upper),
  );
  byId("close").addEventListener("click", () =>
    wishes.sendAll((joint) => joint.lower),
  );
  byId("home").addEventListener("click", () => wishes.flyTo(null));
  byId("colliders").addEventListener("change", (event) => {
    const box = /** @type {HTMLInputElement} */ (event.target);
    wishes.showColliders(box.checked);
  });
  return (positions) => rows.forEach((row) => row.show(positions));
}

/**
 * @param {Joint} joint
 * @param {number} body
 * @param {Wishes} wishes
 */
function jointRow(joint, body, wishes) {
  const output = document.createElement("output");
  const slider = document.createElement("input");
  const range = { min: joint.lower, max: joint.upper, step: "any", value: 0 };
  Object.assign(slider, { type: "range", ...range });
  slider.addEventListener("input", () =>
    wishes.put(body, Number(slider.value)),
  );
  slider.setAttribute("aria-label", joint.name);
  const element = document.createElement("div");
  element.className = "joint";
  element.append(joint.name, output, slider);
  /** @param {number[]} positions */
  const show = (positions) => {
    const value = positions[body] ?? 0;
    slider.value = String(value);
    output.textContent =
      joint.kind === "revolute"
        ? `${Math.round((value * 180) / Math.PI)}°`
        : `${Math.round(value * 1000)} mm`;
  };
  return { element, show };
}

/**
 * @param {import("./scene.d.ts").Finding} finding
 * @param {Wishes} wishes
 */
function findingButton({ severity, message, object }, wishes) {
  const button = document.createElement("button");
  button.type = "button";
  button.className = `finding ${severity}`;
  button.textContent = message;
  button.disabled = object === null;
  button.addEventListener("click", () => wishes.flyTo(object));
  return button;
}
