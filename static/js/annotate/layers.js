/** Overlays of a frame and lanes of the film strip, computed from the objects and their masks. */

import { rgbOf } from "../lib/masks.js";

/** @typedef {import("./scene-objects.js").SceneObjects} SceneObjects */
/** @typedef {import("./masks.js").Masks} Masks */
/** @typedef {import("../api-types").PointIn} PointIn */

/** Marker of a click that is not stored yet: it has no object, so it cannot be moved or removed. */
const COMING = { id: -1, colour: "#c8ccd4", number: 0, object: -1, current: false };

/**
 * Markers of the clicks on a frame, including those not stored yet.
 * @param {SceneObjects} objects
 * @param {PointIn[]} coming
 * @param {number | undefined} frame
 */
export function markersOn(objects, coming, frame) {
  const stored = objects.sorted.flatMap((object, k) =>
    object.points
      .filter((point) => point.frame === frame && !objects.isHidden(object.id))
      .map((point) => ({
        ...point,
        colour: objects.colour(object),
        number: k + 1,
        object: object.id,
        current: object.id === objects.current,
      })),
  );
  const shown = coming.filter((point) => point.frame === frame);
  return [...stored, ...shown.map((point) => ({ ...point, label: point.label ?? 1, ...COMING }))];
}

/**
 * @param {SceneObjects} objects
 * @param {Masks} masks
 * @param {number} frame
 */
export function masksOn(objects, masks, frame) {
  return objects.sorted.flatMap((object, k) => {
    const mask = masks.on(object.id, frame)?.mask;
    if (!mask || objects.isHidden(object.id)) return [];
    const { id, name } = object;
    return [
      { object: id, number: k + 1, name, colour: rgbOf(objects.colour(object)), mask, current: id === objects.current },
    ];
  });
}

/**
 * @param {SceneObjects} objects
 * @param {Masks} masks
 * @param {import("../api-types").Opening[]} openings
 */
export function lanesOf(objects, masks, openings) {
  return objects.sorted.map((object, k) => ({
    id: object.id,
    number: k + 1,
    colour: objects.colour(object),
    name: object.name,
    frames: masks.lane(object.id),
    openings: openings.filter((opening) => opening.object === object.id),
    prompts: new Set(object.points.map((point) => point.frame)),
    current: object.id === objects.current,
  }));
}
