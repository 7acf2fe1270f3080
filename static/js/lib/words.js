/** Names of the pipeline's stages and models on every page, in standard terms; no DOM. */

/** @type {Record<string, string>} */
const STAGES = {
  ingest: "Read the recording",
  sample: "Render the sample",
  segment: "Segment the objects",
  generate: "Generate meshes",
  align: "Align to the scan",
  synthesize: "Build the articulated scene",
  warp: "Fit to the scan",
  export: "Export and certify",
  vary: "Make variants",
};

/** @param {string} stage name used by the server */
export const stageWord = (stage) => STAGES[stage] ?? stage;

/** What each stage of a run does. @type {[string, string][]} */
export const RUN = [
  ["segment", "each object's mask in every frame, its front and its size"],
  ["generate", "several meshes of each object, of which the best is chosen"],
  ["align", "that mesh is placed where the object stands in the scan"],
  ["synthesize", "bodies, doors and drawers with their joints; objects stand, and neighbours meet"],
  ["warp", "each mesh is fitted to the corners that were measured"],
  ["export", "files for simulators, and a test of each joint and of every loader"],
];

/** Models whose outline is drawn over a photo. */
export const MODELS = { placed: "Generated mesh", primitive: "Before the fit", fitted: "After the fit" };
