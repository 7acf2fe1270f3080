/** Store a name or a category; when somebody else changed the object meanwhile, ask only about what really disagrees. */

import { ApiError, changeObject } from "../api.js";
import { askToMerge } from "../elements/merge-dialog.js";
import { disagreements } from "../lib/merge.js";

/** @typedef {import("../api-types").SceneObject} SceneObject */
/** @typedef {{ name?: string, category?: string }} Fields */

const LABELS = { name: "Name", category: "Category" };

/**
 * @param {string} project
 * @param {SceneObject} seen what was on the screen when the person changed it
 * @param {Fields} wanted
 * @returns {Promise<SceneObject>} what is stored in the end
 */
export async function saveFields(project, seen, wanted) {
  try {
    return await changeObject(project, seen.id, { ...wanted, version: seen.version });
  } catch (error) {
    if (!(error instanceof ApiError) || error.kind !== "conflict" || !error.current) throw error;
    const stored = /** @type {SceneObject} */ (error.current);
    const kept = await merged(seen, wanted, stored);
    return Object.keys(kept).length ? saveFields(project, stored, kept) : stored;
  }
}

/**
 * @param {SceneObject} seen
 * @param {Fields} wanted
 * @param {SceneObject} stored
 * @returns {Promise<Fields>} what is still to be stored
 */
async function merged(seen, wanted, stored) {
  const names = /** @type {(keyof Fields)[]} */ (disagreements({ ...seen }, wanted, { ...stored }));
  if (!names.length) return wanted;
  const fields = names.map((name) => ({ name, label: LABELS[name], mine: wanted[name] ?? "", theirs: stored[name] }));
  const mine = await askToMerge(`${stored.name} was changed twice`, fields);
  return Object.fromEntries(
    Object.entries(wanted).filter(([name]) => mine?.has(name) || !names.includes(/** @type {keyof Fields} */ (name))),
  );
}
