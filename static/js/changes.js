/**
 * Changes that must not be lost, as data: the outbox keeps each of them until the server has answered it.
 * An object without an id from the server yet is referred to as `{key}`, the key of the change that creates it.
 */

import { verdictOf } from "./lib/rebased.js";

/** @import {
 *   CandidateGroup, Comment, CommentIn, FrameIn, ObjectIn, ObjectPatch, OverridePatch, PointIn, PointPatch, Proposals, Reviewed, SceneObject, Undone, UndoRequest, VerdictIn
 * } from "./api-types" */

/**
 * `seen` holds the changed fields as the user saw them: on a conflict, only fields that disagree are asked about.
 * @template [T=unknown]
 * @typedef {{ method: string, path: string, json: Record<string, unknown>, seen?: Record<string, unknown>, answer?: T }} Change
 */
/** @typedef {number | string} Ref */

/** @param {string} project */
const at = (project) => `/api/projects/${encodeURIComponent(project)}`;
/** @param {string} project @param {Ref} object */
const on = (project, object) => `${at(project)}/objects/${object}`;
/** @param {object} json @returns {Record<string, unknown>} */
const body = (json) => ({ ...json });

/** @param {string} project @param {Partial<ObjectIn>} object @param {boolean} infer @returns {Change<SceneObject>} */
export const addObject = (project, object, infer = true) => ({
  method: "POST",
  path: `${at(project)}/objects?infer=${infer}`,
  json: body(object),
});
/** @param {string} project @param {SceneObject} seen @param {Partial<ObjectPatch>} wanted @returns {Change<SceneObject>} */
export const changeObject = (project, seen, wanted) => ({
  method: "PATCH",
  path: on(project, seen.id),
  json: { ...wanted, version: seen.version },
  seen: { name: seen.name, category: seen.category, assignee: seen.assignee },
});
/**
 * Change of a drawn front or its name. `version`: for a stored object, its version once earlier changes are stored.
 * @param {string} project
 * @param {Ref} object
 * @param {Partial<ObjectPatch>} wanted
 * @param {number | undefined} version
 * @param {Record<string, unknown>} seen
 * @returns {Change<SceneObject>}
 */
export const changeFront = (project, object, wanted, version, seen) => ({
  method: "PATCH",
  path: on(project, object),
  json: { ...wanted, ...(version === undefined ? {} : { version }) },
  seen,
});
/** @param {string} project @param {Ref} object @returns {Change<SceneObject>} */
export const deleteObject = (project, object) => ({ method: "DELETE", path: on(project, object), json: {} });
/** @param {string} project @param {number} object @param {number} frame @param {FrameIn["mask"]} mask null: not visible there @returns {Change<SceneObject>} */
export const setFrame = (project, object, frame, mask) => ({
  method: "PUT",
  path: `${on(project, object)}/frames/${frame}`,
  json: { mask },
});
/** @param {string} project @param {number} object @param {number} frame @returns {Change<SceneObject>} */
export const leaveFrame = (project, object, frame) => ({
  method: "DELETE",
  path: `${on(project, object)}/frames/${frame}`,
  json: {},
});
/** @param {string} project @param {Ref} object @param {PointIn} point @param {boolean} infer @returns {Change<SceneObject>} */
export const addPoint = (project, object, point, infer = true) => ({
  method: "POST",
  path: `${on(project, object)}/points?infer=${infer}`,
  json: body(point),
});
/** @param {string} project @param {Ref} object @param {PointIn[]} points @param {boolean} infer @returns {Change<SceneObject>} */
export const addPoints = (project, object, points, infer = true) => ({
  method: "POST",
  path: `${on(project, object)}/clicks?infer=${infer}`,
  json: { points },
});
/** @param {string} project @param {number} object @param {number} point @param {Partial<PointPatch>} patch @returns {Change<SceneObject>} */
export const changePoint = (project, object, point, patch) => ({
  method: "PATCH",
  path: `${on(project, object)}/points/${point}`,
  json: body(patch),
});
/** @param {string} project @param {number} object @param {number} point @returns {Change<SceneObject>} */
export const deletePoint = (project, object, point) => ({
  method: "DELETE",
  path: `${on(project, object)}/points/${point}`,
  json: {},
});
/** @param {string} project @param {Ref} object @returns {Change<SceneObject>} */
export const segmentObject = (project, object) => ({
  method: "POST",
  path: `${on(project, object)}/segment`,
  json: {},
});
/** @param {string} project @param {number} object @returns {Change<SceneObject>} */
export const cancelSegment = (project, object) => ({
  method: "POST",
  path: `${on(project, object)}/segment/cancel`,
  json: {},
});
/**
 * Undo or redo of a change. With `version`, the server refuses if another user has changed the object since.
 * @param {string} project
 * @param {"undo" | "redo"} which
 * @param {UndoRequest} wanted
 * @returns {Change<Undone>}
 */
export const undoRedo = (project, which, wanted) => ({
  method: "POST",
  path: `${at(project)}/${which}`,
  json: body(wanted),
});
/**
 * @param {string} project
 * @param {string[]} ids
 * @param {string} [category] for all of them; without it, as proposed
 * @returns {Change<SceneObject[]>}
 */
export const confirmProposals = (project, ids, category) => ({
  method: "POST",
  path: `${at(project)}/proposals/confirm`,
  json: { ids, category },
});
/** @param {string} project @param {string[]} ids @returns {Change<Proposals>} */
export const dismissProposals = (project, ids) => ({
  method: "POST",
  path: `${at(project)}/proposals/dismiss`,
  json: { ids },
});
/** @param {string} project @param {CandidateGroup} seen @param {VerdictIn} verdict @returns {Change<Reviewed>} */
export const giveVerdict = (project, seen, verdict) => ({
  method: "POST",
  path: `${on(project, seen.object)}/verdicts`,
  json: { ...verdict, version: seen.version },
  seen: { verdict: verdictOf(seen) },
});
/** @param {string} project @param {CandidateGroup} seen @param {Partial<OverridePatch>} patch @returns {Change<Reviewed>} */
export const changeOverride = (project, seen, patch) => ({
  method: "PATCH",
  path: `${on(project, seen.object)}/override`,
  json: { ...patch, version: seen.version },
  seen: body(seen.override),
});
/**
 * Correction of an object that a run made from the scan without clicks, addressed by its name in the scene.
 * @param {string} project
 * @param {{ run_name: string, override?: import("./api-types").OverrideData }} seen
 * @param {Partial<OverridePatch>} patch
 * @returns {Change<Reviewed>}
 */
export const changeMade = (project, seen, patch) => ({
  method: "PATCH",
  path: `${at(project)}/scene/${encodeURIComponent(seen.run_name)}/override`,
  json: { ...patch },
  seen: body(seen.override ?? {}),
});
/** @param {string} project @param {Partial<CommentIn>} comment @returns {Change<Comment>} */
export const addComment = (project, comment) => ({
  method: "POST",
  path: `${at(project)}/comments`,
  json: body(comment),
});
