/** Key bindings of all pages, used by the pages, by the `?` overlay and by a test for clashes. */

/** @typedef {{ keys: string[], action: string, text: string, page: "annotate" | "elevation" | "review" | "all" }} Binding */

/** @type {Binding[]} */
export const KEYMAP = [
  { keys: ["?"], action: "help", text: "Show or hide this list", page: "all" },
  { keys: ["Ctrl+k"], action: "palette", text: "Find a command, an object or a frame", page: "all" },
  { keys: ["Ctrl+z"], action: "undo", text: "Undo", page: "all" },
  { keys: ["Ctrl+Shift+z", "Ctrl+y"], action: "redo", text: "Redo", page: "all" },
  { keys: ["ArrowRight", "f"], action: "next-frame", text: "Next frame", page: "annotate" },
  { keys: ["ArrowLeft", "d"], action: "previous-frame", text: "Previous frame", page: "annotate" },
  { keys: ["Shift+ArrowRight", "v"], action: "forward-ten", text: "Ten frames on", page: "annotate" },
  { keys: ["Shift+ArrowLeft", "c"], action: "back-ten", text: "Ten frames back", page: "annotate" },
  { keys: ["Home"], action: "first-frame", text: "First frame", page: "annotate" },
  { keys: ["End"], action: "last-frame", text: "Last frame", page: "annotate" },
  { keys: ["Space"], action: "play", text: "Play or pause; held, a drag moves the picture", page: "annotate" },
  { keys: ["]"], action: "next-prompt", text: "Next frame with a click of this object", page: "annotate" },
  { keys: ["["], action: "previous-prompt", text: "Previous frame with a click of this object", page: "annotate" },
  { keys: ["Enter"], action: "finish", text: "Finish this object; the next click starts a new one", page: "annotate" },
  {
    keys: ["Delete", "Backspace"],
    action: "delete-point",
    text: "Remove the last click on this frame",
    page: "annotate",
  },
  { keys: ["b"], action: "brush", text: "Paint this object's mask in this frame", page: "annotate" },
  { keys: ["Shift+b"], action: "eraser", text: "Erase from its mask in this frame", page: "annotate" },
  { keys: ["l"], action: "lasso", text: "Draw around what belongs to it", page: "annotate" },
  { keys: ["o"], action: "polygon", text: "Click the corners of what belongs to it; Enter closes", page: "annotate" },
  { keys: ["q"], action: "thinner-brush", text: "Thinner brush", page: "annotate" },
  { keys: ["u"], action: "wider-brush", text: "Wider brush", page: "annotate" },
  { keys: ["w"], action: "keep", text: "Its mask in this frame is right: keep it", page: "annotate" },
  { keys: ["a"], action: "absent", text: "It is not visible in this frame; again restores its mask", page: "annotate" },
  {
    keys: ["s"],
    action: "crop",
    text: "Crop box of this thing: what lies outside does not belong to it",
    page: "annotate",
  },
  { keys: ["Shift+s"], action: "uncrop", text: "Remove its crop box", page: "annotate" },
  { keys: ["h"], action: "hide", text: "Hide or show this object's mask", page: "annotate" },
  { keys: ["Shift+h"], action: "solo", text: "Show this object's mask alone", page: "annotate" },
  { keys: ["Shift+l"], action: "lock", text: "Lock this object against changes, or unlock it", page: "annotate" },
  { keys: ["t"], action: "raw", text: "Hold: the frame without masks", page: "annotate" },
  { keys: ["r"], action: "sign", text: "A click adds, or takes away", page: "annotate" },
  { keys: ["e"], action: "evidence", text: "Depth, shape and comments, on a narrow screen", page: "annotate" },
  { keys: ["\\"], action: "panels", text: "The picture alone with its tools, or everything again", page: "annotate" },
  { keys: ["0"], action: "fit", text: "Fit the frame to the window", page: "annotate" },
  {
    keys: ["1", "2", "3", "4", "5", "6", "7", "8", "9"],
    action: "pick-number",
    text: "Choose the object of that number",
    page: "annotate",
  },
  { keys: ["."], action: "next-doubtful", text: "Next frame where this object's mask is doubtful", page: "annotate" },
  { keys: [","], action: "previous-doubtful", text: "Previous frame where it is doubtful", page: "annotate" },
  { keys: ["g"], action: "segment", text: "Find this object in all frames again", page: "annotate" },
  {
    keys: ["Shift+g"],
    action: "cancel-segment",
    text: "Stop finding it; the masks found so far stay",
    page: "annotate",
  },
  { keys: ["m"], action: "mosaic", text: "This object on many frames, worst first", page: "annotate" },
  { keys: ["z"], action: "depth", text: "Depth instead of colour", page: "annotate" },
  { keys: ["i"], action: "comment", text: "Pin a comment: the next click says where", page: "annotate" },
  {
    keys: ["k"],
    action: "crosshair",
    text: "Place clicks by keyboard: arrows move, + adds, - subtracts, Esc ends",
    page: "annotate",
  },
  {
    keys: ["y"],
    action: "confirm-proposal",
    text: "Confirm the highlighted proposal and go to the next",
    page: "annotate",
  },
  { keys: ["x"], action: "dismiss-proposal", text: "Dismiss the highlighted proposal", page: "annotate" },
  { keys: ["n", "ArrowDown"], action: "next-proposal", text: "Next proposal", page: "annotate" },
  { keys: ["p", "ArrowUp"], action: "previous-proposal", text: "Previous proposal", page: "annotate" },
  {
    keys: ["Shift+y"],
    action: "confirm-all",
    text: "Confirm all proposals from the chosen confidence up",
    page: "annotate",
  },
  {
    keys: ["Shift+n"],
    action: "next-listed",
    text: "The next click makes the next object of the list",
    page: "annotate",
  },
  {
    keys: ["j"],
    action: "alike",
    text: "Find the ones like this object; then Enter confirms one, Shift+Enter all, Esc ends",
    page: "annotate",
  },
  { keys: ["q"], action: "ask-seam", text: "Ask about the next edge that is hard to see", page: "elevation" },
  { keys: ["y"], action: "is-seam", text: "Yes: there is a seam at the edge asked about", page: "elevation" },
  { keys: ["x"], action: "no-seam", text: "No: the front goes on beyond that edge", page: "elevation" },
  { keys: ["b"], action: "front-here", text: "A new front at the pointer, else in the middle", page: "elevation" },
  { keys: ["s"], action: "seam", text: "Split the front by a vertical seam at the pointer", page: "elevation" },
  { keys: ["Shift+s"], action: "level-seam", text: "Split it by a horizontal seam at the pointer", page: "elevation" },
  {
    keys: ["d"],
    action: "divide",
    text: "Divide its width: 3 parts, or 600 450 600 mm; / 3 leaves 3 mm between",
    page: "elevation",
  },
  { keys: ["Shift+d"], action: "level-divide", text: "Divide its height in the same way", page: "elevation" },
  { keys: ["r"], action: "repeat", text: "The same front again, to the right", page: "elevation" },
  { keys: ["Shift+r"], action: "repeat-below", text: "The same front again, below", page: "elevation" },
  { keys: ["Ctrl+a"], action: "choose-all", text: "Choose all fronts of this plane", page: "elevation" },
  {
    keys: ["t"],
    action: "front-name",
    text: "Type its name; several chosen fronts are numbered from left to right, top to bottom",
    page: "elevation",
  },
  {
    keys: ["m"],
    action: "merge",
    text: "Merge the chosen fronts; Shift-click or Shift-drag chooses several",
    page: "elevation",
  },
  { keys: ["Delete", "Backspace"], action: "delete-front", text: "Delete the chosen fronts", page: "elevation" },
  { keys: ["w"], action: "width", text: "Type the front's width in millimetres", page: "elevation" },
  { keys: ["h"], action: "height", text: "Type its height in millimetres", page: "elevation" },
  { keys: ["k"], action: "handle", text: "Place its handle at the pointer", page: "elevation" },
  { keys: ["Shift+k"], action: "no-handle", text: "It has no handle", page: "elevation" },
  {
    keys: ["c"],
    action: "copy-handle",
    text: "Copy handle and hinge of the front chosen last to the other chosen ones",
    page: "elevation",
  },
  {
    keys: ["j"],
    action: "hinge",
    text: "Hinge it on, or slide it to, the side nearest to the pointer; again: inferred",
    page: "elevation",
  },
  {
    keys: ["1", "2", "3", "4", "5", "6", "7"],
    action: "front-category",
    text: "Set its category, by its number in the list",
    page: "elevation",
  },
  {
    keys: ["Left", "Right", "Up", "Down"].flatMap((way) => [`Arrow${way}`, `Shift+Arrow${way}`]),
    action: "nudge-front",
    text: "Move the front, or its chosen edge, by 1 mm; with Shift by 10 mm",
    page: "elevation",
  },
  {
    keys: ["e"],
    action: "next-edge",
    text: "Choose the next edge for the arrows, or the whole front",
    page: "elevation",
  },
  {
    keys: ["n"],
    action: "next-front",
    text: "Next front; Ctrl Enter in a field: its field of the next front",
    page: "elevation",
  },
  { keys: ["p"], action: "previous-front", text: "Previous front", page: "elevation" },
  { keys: ["a"], action: "adopt-cut", text: "Turn the cut panels without a front into fronts", page: "elevation" },
  { keys: ["]"], action: "next-plane", text: "Next plane of the scan", page: "elevation" },
  { keys: ["["], action: "previous-plane", text: "Previous plane", page: "elevation" },
  { keys: ["0"], action: "fit-plane", text: "Fit the plane to the window", page: "elevation" },
  { keys: ["="], action: "zoom-in", text: "Larger", page: "elevation" },
  { keys: ["-"], action: "zoom-out", text: "Smaller", page: "elevation" },
  { keys: ["Escape"], action: "leave-front", text: "Leave the tool, then deselect", page: "elevation" },
  { keys: ["y"], action: "accept", text: "Accept this candidate", page: "review" },
  { keys: ["x"], action: "reject", text: "Reject this candidate", page: "review" },
  { keys: ["g"], action: "more", text: "Make more candidates of this object", page: "review" },
  { keys: ["n"], action: "next-object", text: "Next object", page: "review" },
  { keys: ["p"], action: "previous-object", text: "Previous object", page: "review" },
  { keys: ["c"], action: "comment", text: "Comment on this object", page: "review" },
  { keys: ["b"], action: "blink", text: "Hold: the photo without the mesh over it", page: "review" },
  { keys: ["o"], action: "sweep", text: "Open and close the joints of this object", page: "review" },
  { keys: ["."], action: "next-photo", text: "Next photo of this object", page: "review" },
  { keys: [","], action: "previous-photo", text: "Previous photo of this object", page: "review" },
  { keys: ["Shift+c"], action: "mark-closed", text: "Mark it as closed here", page: "review" },
  { keys: ["-", "="], action: "turn-leaf", text: "Close or open the leaf by 2° or 1 cm", page: "review" },
  { keys: ["Shift+o"], action: "mark-open", text: "Mark it as open here", page: "review" },
  { keys: ["Shift+s"], action: "mark-stop", text: "Mark it as stopping here", page: "review" },
  { keys: ["Shift+x"], action: "unmark", text: "Remove its mark here", page: "review" },
  { keys: ["Shift+n"], action: "next-leaf", text: "Choose its next leaf for these keys", page: "review" },
  { keys: ["v"], action: "move-object", text: "Move or resize the object", page: "review" },
  {
    keys: ["j", "l", "i", "k", "u", "m", "Shift+j", "Shift+l", "Shift+i", "Shift+k", "Shift+u", "Shift+m"],
    action: "nudge",
    text: "Move the object 5 mm left, right, up, down, to the front, to the back; with Shift 1 mm",
    page: "review",
  },
  { keys: ["[", "]"], action: "nudge", text: "Turn the object by a degree", page: "review" },
  { keys: ["Enter"], action: "store-move", text: "Apply the moved position", page: "review" },
  { keys: ["Escape"], action: "drop-move", text: "Reset what was moved or turned", page: "review" },
  { keys: ["f"], action: "frame-object", text: "Aim the 3D view at the chosen object", page: "review" },
  { keys: ["Shift+f"], action: "frame-scene", text: "Show the whole scene", page: "review" },
  {
    keys: ["/"],
    action: "select-object",
    text: "Add the chosen object to the selection, or remove it",
    page: "review",
  },
  { keys: ["6"], action: "look-front", text: "Look at the scene from the front", page: "review" },
  { keys: ["7"], action: "look-top", text: "Look at it from above", page: "review" },
  { keys: ["8"], action: "look-left", text: "Look at it from the left", page: "review" },
  { keys: ["9"], action: "look-right", text: "Look at it from the right", page: "review" },
  {
    keys: ["Shift+b"],
    action: "look-run",
    text: "Look at the front of the run that the object stands in",
    page: "review",
  },
  { keys: ["Shift+p"], action: "look-photo", text: "Look from where its photo was taken", page: "review" },
  { keys: ["z"], action: "section", text: "Cut the scene and the scan by a box, to look inside", page: "review" },
  { keys: ["0"], action: "parallel", text: "Parallel or perspective projection", page: "review" },
  { keys: ["t"], action: "measure", text: "Measure between two points that are clicked", page: "review" },
  { keys: ["h"], action: "hide-object", text: "Hide the chosen object in the scene, or show it", page: "review" },
  { keys: ["Shift+h"], action: "solo-object", text: "Show it alone, or all again", page: "review" },
  { keys: ["1"], action: "view-candidate", text: "Show the candidate alone", page: "review" },
  { keys: ["r"], action: "view-compare", text: "Compare all candidates side by side", page: "review" },
  { keys: ["Shift+r"], action: "spin-candidates", text: "Turn them all by themselves, or stop", page: "review" },
  { keys: ["2"], action: "view-aligned", text: "Show the mesh over the scan", page: "review" },
  { keys: ["3"], action: "view-scene", text: "Show the finished scene", page: "review" },
  { keys: ["4"], action: "view-cloud", text: "Show the scan", page: "review" },
  { keys: ["5"], action: "view-photo", text: "Show the mesh over the photos", page: "review" },
];

/**
 * The action of a key press on a page, or null.
 * @param {{ key: string, ctrlKey: boolean, metaKey: boolean, shiftKey: boolean, altKey: boolean }} event
 * @param {string} page
 * @param {boolean} [plain] whether single letters are commands; users who dictate or press keys by accident turn that off
 */
export function actionOf(event, page, plain = true) {
  if (event.altKey) return null;
  const name = nameOf(event);
  if (!plain && name.length === 1) return null;
  const found = KEYMAP.find(
    (binding) => (binding.page === page || binding.page === "all") && binding.keys.includes(name),
  );
  return found ? found.action : null;
}

/** @param {{ key: string, ctrlKey: boolean, metaKey: boolean, shiftKey: boolean }} event */
function nameOf(event) {
  const key = event.key === " " ? "Space" : event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const control = event.ctrlKey || event.metaKey ? "Ctrl+" : "";
  // A shifted sign such as ? already implies Shift; letters and named keys do not.
  const shift = event.shiftKey && (key.length > 1 || /[a-z]/.test(key)) ? "Shift+" : "";
  return control + shift + key;
}

/** @type {Record<string, string>} */
const SIGNS = { ArrowRight: "→", ArrowLeft: "←", ArrowUp: "↑", ArrowDown: "↓", Escape: "Esc", Delete: "Del" };

/**
 * A binding's keys for display: arrows as symbols, a row of digits as a range, a key and its Shift variant as one.
 * @param {string[]} keys
 */
export function printed(keys) {
  if (keys.length > 2 && keys.every((key) => /^\d$/.test(key))) return [`${keys[0]} – ${keys.at(-1)}`];
  return keys
    .filter((key) => !(key.startsWith("Shift+") && keys.includes(key.slice("Shift+".length))))
    .map((key) =>
      key
        .split("+")
        .map((part) => SIGNS[part] ?? (part.length === 1 ? part.toUpperCase() : part))
        .join(" "),
    );
}

/** Keys bound to two actions on one page. */
export function clashes() {
  /** @type {string[]} */
  const found = [];
  for (const page of ["annotate", "elevation", "review"]) {
    /** @type {Map<string, string>} */
    const taken = new Map();
    for (const binding of KEYMAP.filter((b) => b.page === page || b.page === "all")) {
      for (const key of binding.keys) {
        const other = taken.get(key);
        if (other !== undefined) found.push(`${page}: ${key} is ${other} and ${binding.action}`);
        taken.set(key, binding.action);
      }
    }
  }
  return found;
}
