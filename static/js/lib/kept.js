/** Storage of changes in the browser until the server has answered them, one item per change: tabs cannot overwrite others'. */

/** @typedef {import("../changes.js").Change} Change */
/** @typedef {Change & { key: string, user: string, tab: string, at: number }} Kept with its user, tab and time */
/** @typedef {Pick<Storage, "getItem" | "setItem" | "removeItem" | "key" | "length">} Store */

const PREFIX = "r2c2r-change-";

/** Whether an item of the storage is a change. @param {string | null} name */
export function isChange(name) {
  return Boolean(name?.startsWith(PREFIX));
}

/**
 * @param {Store} store
 * @param {Kept} change
 * @returns {boolean} whether it was stored
 */
export function keep(store, change) {
  try {
    store.setItem(nameOf(change), JSON.stringify(change));
    return true;
  } catch {
    return false; // storage full or disabled
  }
}

/**
 * @param {Store} store
 * @param {Kept} change
 */
export function forget(store, change) {
  store.removeItem(nameOf(change));
}

/**
 * Waiting changes of a user, in the order they were made; unreadable ones are skipped.
 * @param {Store} store
 * @param {string} user
 * @returns {Kept[]}
 */
export function keptBy(store, user) {
  const names = Array.from({ length: store.length }, (_, k) => store.key(k)).filter(isChange);
  return names
    .toSorted()
    .map((name) => parsed(store.getItem(name ?? "")))
    .filter((change) => change?.user === user)
    .filter((change) => change !== null);
}

/**
 * Change with the id of its object in place of `{key}`, once the server has created the object.
 * @template {Change} C
 * @param {C} change
 * @param {string} key of the change that made the object
 * @param {number} id of the object
 * @returns {C}
 */
export function named(change, key, id) {
  return change.path.includes(`{${key}}`) ? { ...change, path: change.path.replace(`{${key}}`, String(id)) } : change;
}

/** @param {Kept} change */
function nameOf({ at, key }) {
  return `${PREFIX}${String(at).padStart(16, "0")}-${key}`;
}

/**
 * @param {string | null} text
 * @returns {Kept | null}
 */
function parsed(text) {
  try {
    const change = JSON.parse(text ?? "");
    return typeof change.path === "string" && typeof change.key === "string" ? change : null;
  } catch {
    return null;
  }
}
