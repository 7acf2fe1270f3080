/** Actions of the elevation page for keys and the command palette, by their names in the keymap. */

import * as rows from "../lib/front-rows.js";
import { drawnOf } from "./fronts.js";

/** Actions that do not repeat while a key is held down. */
export const ONE_A_PRESS = ["copy-handle", "front-here", "seam", "level-seam", "merge", "is-seam", "no-seam"];

/**
 * @param {object} doers
 * @param {import("./plane-view.js").PlaneView} doers.view
 * @param {import("./fronts.js").Fronts} doers.fronts
 * @param {import("./edits.js").FrontEdits} doers.edits
 * @param {import("./seam-questions.js").SeamQuestions} doers.seams
 * @param {import("./front-pane.js").FrontPane} doers.pane
 * @param {import("../elements/elevation-canvas.js").ElevationCanvas} doers.canvas
 * @param {import("./front-tools.js").FrontTools} doers.tools
 * @param {(way: 1 | -1) => void} doers.nextPlane
 * @returns {import("../keyboard.js").Actions}
 */
export function actionsOf({ view, fronts, edits, seams, pane, canvas, tools, nextPlane }) {
  return {
    undo: () => fronts.step("undo"),
    redo: () => fronts.step("redo"),
    "ask-seam": () => seams.ask(),
    "is-seam": () => seams.answer(true),
    "no-seam": () => seams.answer(false),
    "front-here": () => edits.addByKey(),
    seam: () => edits.split("upright"),
    "level-seam": () => edits.split("level"),
    merge: () => edits.merge(),
    divide: () => pane.type("across"),
    "level-divide": () => pane.type("down"),
    repeat: () => edits.repeat("upright"),
    "repeat-below": () => edits.repeat("level"),
    "choose-all": () => fronts.chooseAll(rows.inOrder(view.here).map(({ key }) => key)),
    "front-name": () => pane.type("name"),
    "delete-front": () => edits.remove(),
    width: () => pane.type("width"),
    height: () => pane.type("height"),
    handle: () => canvas.pointer && edits.setHandle(canvas.pointer),
    "no-handle": () => edits.change((front) => ({ front: { ...drawnOf(front), handle: "none" } })),
    "copy-handle": () => edits.copyToOthers(),
    hinge: () => (canvas.pointer && view.at(canvas.pointer) ? edits.setHinge(canvas.pointer) : edits.turnHinge()),
    "nudge-front": (key, shift) => edits.nudge(key, shift),
    "next-edge": () => edits.nextEdge(),
    "next-front": () => edits.next(1),
    "previous-front": () => edits.next(-1),
    "next-plane": () => nextPlane(1),
    "previous-plane": () => nextPlane(-1),
    "adopt-cut": () => edits.adopt(),
    "front-category": (key) => pane.pickCategory(Number(key)),
    "fit-plane": () => canvas.fit(),
    "zoom-in": () => canvas.zoomBy(1.25),
    "zoom-out": () => canvas.zoomBy(0.8),
    "leave-front": () => (tools.chosen ? tools.use(tools.chosen) : edits.pick(null, null, false)),
  };
}
