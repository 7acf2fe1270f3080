/** Similarity of proposals to an object, by category, size and kind of handle; no DOM. */

/** @typedef {import("../api-types").Proposal} Proposal */
/** @typedef {import("../api-types").FoundFront} FoundFront */
/** @typedef {"upright" | "level" | "none"} HandleKind */
/**
 * Features of an object; `sides` are width and height; null where not known.
 * @typedef {{ category: string, sides: [number, number] | null, handle: HandleKind | null }} Kind
 */

const LEAST = 0.4; // minimum likeness: one side at 40 % of its length, all else equal
const OTHER_CATEGORY = 0.5;
const OTHER_HANDLE = 0.6;

/**
 * Features that proposals are compared with.
 * @param {string} category
 * @param {FoundFront | undefined} front undefined: it has no flat front, or its masks are not done
 * @returns {Kind}
 */
export function kindOf(category, front) {
  if (!front) return { category, sides: null, handle: null };
  const [first = [], second = [], , last = []] = front.corners_m;
  const { handle } = front;
  const wide = handle && handle.right_m - handle.left_m;
  const high = handle && handle.top_m - handle.bottom_m;
  return {
    category,
    sides: [distance(first, second), distance(first, last)],
    handle: wide === null || high === null ? "none" : high > wide ? "upright" : "level",
  };
}

/**
 * Similar proposals, most similar first, each with its likeness, 0 to 1, as its confidence. Without a flat front, only the
 * category is compared.
 * @param {Kind} kind
 * @param {Proposal[]} items
 * @returns {Proposal[]}
 */
export function alike(kind, items) {
  return items
    .map((item) => ({ ...item, confidence: likeness(kind, item) }))
    .filter((item) => item.confidence >= LEAST)
    .toSorted((a, b) => b.confidence - a.confidence);
}

/** @param {Kind} kind @param {Proposal} item */
function likeness({ category, sides, handle }, item) {
  const same = item.category === category;
  if (!sides) return same ? 1 : 0;
  if (item.kind === "thing") return 0;
  const [width = 0, , height = 0] = item.size_m;
  const size = ratio(sides[0], width) * ratio(sides[1], height);
  return size * (same ? 1 : OTHER_CATEGORY) * (handle === handleOf(item) ? 1 : OTHER_HANDLE);
}

/** Kind of handle by its orientation in the image. @param {Proposal} item @returns {HandleKind} */
function handleOf({ handle }) {
  if (!handle.length) return "none";
  const [wide, high] = [0, 1].map((axis) => {
    const along = handle.map((corner) => corner[axis] ?? 0);
    return Math.max(...along) - Math.min(...along);
  });
  return (high ?? 0) > (wide ?? 0) ? "upright" : "level";
}

/** @param {number} a @param {number} b */
const ratio = (a, b) => (Math.max(a, b) > 0 ? Math.min(a, b) / Math.max(a, b) : 0);

/** @param {number[]} a @param {number[]} b */
const distance = (a, b) => Math.hypot(...a.map((value, k) => value - (b[k] ?? 0)));
