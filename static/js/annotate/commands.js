/** Actions of the Annotate page for keys and the command palette, by their names in the keymap. */

import { say } from "../elements/toasts.js";

/**
 * @typedef {object} Doers
 * @property {import("./scene-objects.js").SceneObjects} objects
 * @property {import("./masks.js").Masks} masks
 * @property {import("./edits.js").Edits} edits
 * @property {import("./player.js").Player} player
 * @property {import("./presses.js").Presses} presses
 * @property {import("./painter.js").Painter} painter
 * @property {import("./cropper.js").Cropper} cropper
 * @property {import("./objects-pane.js").ObjectsPane} pane
 * @property {import("./evidence-pane.js").EvidencePane} evidence
 * @property {import("./stage-tools.js").StageTools} tools
 * @property {import("../elements/frame-canvas.js").FrameCanvas} canvas
 * @property {import("../elements/frame-mosaic.js").FrameMosaic} mosaic
 * @property {import("./layout.js").Layout} layout
 */

/** Actions that do not repeat while their key is held down. */
export const ONE_A_PRESS = [
  "confirm-proposal",
  "dismiss-proposal",
  "confirm-all",
  "alike",
  "segment",
  "comment",
  "depth",
  "mosaic",
  "keep",
  "absent",
  "crop",
  "panels",
];

/**
 * @param {Doers} doers
 * @returns {import("../keyboard.js").Actions}
 */
export function actionsOf(doers) {
  return { ...moves(doers), ...changes(doers), ...looks(doers) };
}

/**
 * Navigation between frames.
 * @param {Doers} doers
 * @returns {import("../keyboard.js").Actions}
 */
function moves({ player, objects, masks }) {
  /** @param {1 | -1} direction */
  const seekPrompt = (direction) =>
    player.seekOneOf(new Set((objects.chosen?.points ?? []).map((point) => point.frame)), direction);
  /** @param {1 | -1} direction */
  const seekDoubtful = (direction) => {
    const lane = objects.current === null ? new Map() : masks.lane(objects.current);
    if (!player.seekDoubtful(lane, direction)) say("No doubtful frame that way.");
  };
  return {
    "next-frame": () => player.seek(player.position + 1),
    "previous-frame": () => player.seek(player.position - 1),
    "forward-ten": () => player.seek(player.position + 10),
    "back-ten": () => player.seek(player.position - 10),
    "first-frame": () => player.seek(0),
    "last-frame": () => player.seek(player.frames.list.length - 1),
    play: () => player.play(),
    "next-prompt": () => seekPrompt(1),
    "previous-prompt": () => seekPrompt(-1),
    "next-doubtful": () => seekDoubtful(1),
    "previous-doubtful": () => seekDoubtful(-1),
  };
}

/**
 * Edits: undo, painting, cropping, segmenting, proposals and comments.
 * @param {Doers} doers
 * @returns {import("../keyboard.js").Actions}
 */
function changes({ objects, edits, player, pane: { proposals, checklist }, presses, painter, cropper, canvas }) {
  const findAlike = () => {
    const { chosen } = objects;
    if (!chosen && !proposals.likeOne) return say("Choose an object first.");
    canvas.focus(); // Enter now applies to the matches, not to a focused button
    proposals.findLike(chosen);
  };
  const deleteLast = () => {
    const last = objects.chosen?.points.findLast((point) => point.frame === player.frame?.index);
    if (last) edits.removePoint(last.id);
  };
  return {
    undo: () => edits.undoRedo("undo", player.frame?.index),
    redo: () => edits.undoRedo("redo", player.frame?.index),
    "delete-point": deleteLast,
    lock: () => objects.chosen && edits.lock([objects.chosen]),
    brush: () => painter.use("brush"),
    eraser: () => painter.use("eraser"),
    lasso: () => painter.use("lasso"),
    polygon: () => painter.use("polygon"),
    "thinner-brush": () => painter.resize(0.75),
    "wider-brush": () => painter.resize(1.35),
    crop: () => cropper.use(),
    uncrop: () => cropper.remove(),
    keep: () => painter.keep(),
    absent: () => painter.absent(),
    segment: () => edits.segment(),
    "cancel-segment": () => edits.stopSegmenting(),
    "confirm-proposal": () => proposals.confirm(),
    "dismiss-proposal": () => proposals.dismiss(),
    "next-proposal": () => proposals.move(1),
    "previous-proposal": () => proposals.move(-1),
    alike: findAlike,
    "next-listed": () => checklist.step(),
    "confirm-all": () => proposals.confirmAll(),
    comment: () => (presses.pinning = !presses.pinning),
  };
}

/**
 * Selection and display of objects, frames and panels.
 * @param {Doers} doers
 * @returns {import("../keyboard.js").Actions}
 */
function looks({ objects, masks, player, canvas, tools, evidence, mosaic, layout }) {
  const openMosaic = () => {
    const object = objects.chosen;
    if (!object) return say("Choose an object first.");
    const { id, name } = object;
    const { frames } = player;
    const looked = { id, name, colour: objects.colour(object), lane: masks.lane(id) };
    mosaic.open(looked, frames.list, (frame, width) => frames.url(frame, width));
  };
  return {
    "pick-number": (key) => objects.choose(objects.sorted[Number(key) - 1]?.id ?? objects.current),
    finish: () => objects.choose(null),
    hide: () => objects.current !== null && objects.hide([objects.current]),
    solo: () => objects.solo(),
    raw: () => canvas.showRaw(true),
    depth: () => player.switchDepth(),
    mosaic: openMosaic,
    fit: () => canvas.fit(),
    sign: () => tools.switchSign(),
    panels: () => layout.fold(),
    evidence: () => (evidence.open = !evidence.open),
    crosshair: () => canvas.showCrosshair(!canvas.crosshair),
  };
}

/**
 * Extra commands of the palette: a frame by its number, an object, a category, an assignee.
 * @param {string} typed
 * @param {Pick<Doers, "player" | "objects">} doers
 * @param {string[]} categories
 * @param {(category: string) => void} categorise
 * @param {{ names: string[], assign: (name: string | null) => void }} people possible assignees of the changed objects
 * @returns {import("../lib/commands.js").Command[]}
 */
export function offers(typed, { player, objects }, categories, categorise, { names, assign }) {
  const position = player.frames.positionOf(Number(typed || Number.NaN));
  const frame = position < 0 ? [] : [{ text: `${typed.trim()}: go to that frame`, run: () => player.seek(position) }];
  return [
    ...frame,
    ...objects.sorted.map(({ id, name }) => ({ text: `Object ${name}`, run: () => objects.choose(id) })),
    ...(objects.changed.length && names.length ? [...names, null] : []).map((name) => ({
      text: `Assign to ${name ?? "nobody"}`,
      run: () => assign(name),
    })),
    ...categories.map((name) => ({ text: `Category ${name}`, run: () => categorise(name) })),
  ];
}
