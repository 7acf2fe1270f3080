/** Actions of the review page for keys and the command palette, by their names in the keymap. */

/** Actions that do not repeat while a key is held down. */
export const ONE_A_PRESS = ["comment", "more", "accept", "reject", "mark-closed", "mark-open", "mark-stop", "unmark"];

/**
 * @param {object} doers
 * @param {import("./objects.js").ReviewObjects} doers.objects
 * @param {import("./decisions.js").Decisions} doers.decisions
 * @param {import("./centre.js").Centre} doers.centre
 * @param {() => void} doers.comment
 * @returns {import("../keyboard.js").Actions}
 */
export function actionsOf({ objects, decisions, centre, comment }) {
  const { bar, photos, compare, joints, mover } = centre;
  return {
    accept: () => decisions.accept(),
    reject: () => decisions.reject(),
    more: () => decisions.more(),
    undo: () => decisions.undoRedo("undo"),
    redo: () => decisions.undoRedo("redo"),
    comment,
    "next-object": () => objects.step(1),
    "previous-object": () => objects.step(-1),
    "next-photo": () => photos.move(1),
    "previous-photo": () => photos.move(-1),
    blink: () => photos.blink(true),
    "mark-closed": () => centre.mark((marks) => marks.closed()),
    "mark-open": () => centre.mark((marks) => marks.open()),
    "mark-stop": () => centre.mark((marks) => marks.stops()),
    unmark: () => centre.mark((marks) => marks.remove()),
    "turn-leaf": (key) => centre.mark((marks) => marks.step(key === "=" ? 1 : -1)),
    "next-leaf": () => centre.mark((marks) => marks.next()),
    sweep: () => joints.sweep(objects.group?.name ?? null),
    "frame-object": () => centre.look("object"),
    "frame-scene": () => centre.look("scene"),
    "look-front": () => centre.look("front"),
    "look-top": () => centre.look("top"),
    "look-left": () => centre.look("left"),
    "look-right": () => centre.look("right"),
    "look-run": () => centre.look("run"),
    "look-photo": () => centre.look("photo"),
    section: () => bar.clip.toggle(),
    measure: () => bar.toggleMeasure(),
    parallel: () => bar.toggleParallel(),
    "select-object": () => objects.number !== null && objects.toggleSelected(objects.object),
    "hide-object": () => objects.shownName && objects.hide(objects.shownName, !objects.hidden.has(objects.shownName)),
    "solo-object": () => objects.solo(),
    "view-candidate": () => bar.set("candidate"),
    "view-compare": () => bar.set("compare"),
    "spin-candidates": () => (bar.set("compare"), compare.spin()),
    "view-aligned": () => bar.set("aligned"),
    "view-scene": () => bar.set("scene"),
    "view-cloud": () => bar.set("cloud"),
    "view-photo": () => bar.set("photo"),
    "move-object": () => bar.move(!bar.moving),
    nudge: (key, fine) => centre.nudge(key, fine),
    "store-move": () => bar.moving && mover.store(),
    "drop-move": () => (bar.moving ? mover.drop() : photos.marks.drop()),
  };
}
