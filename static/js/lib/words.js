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

/** Models whose outline is drawn over a photo. */
export const MODELS = { placed: "Generated mesh", primitive: "Before the fit", fitted: "After the fit" };
