/** Formatting of numbers, times and names. */

/** @param {number} bytes */
export function bytes(bytes) {
  const units = ["B", "KB", "MB", "GB", "TB"];
  let value = bytes;
  let unit = 0;
  while (value >= 1000 && unit < units.length - 1) {
    value /= 1000;
    unit += 1;
  }
  return `${value >= 100 || unit === 0 ? Math.round(value) : value.toFixed(1)} ${units[unit]}`;
}

/** @param {number} seconds */
export function duration(seconds) {
  if (seconds < 60) return `${Math.max(1, Math.round(seconds))} s`;
  if (seconds < 3600) return `${Math.floor(seconds / 60)} min ${Math.round(seconds % 60)} s`;
  return `${Math.floor(seconds / 3600)} h ${Math.round((seconds % 3600) / 60)} min`;
}

/**
 * @param {number} then seconds since 1970
 * @param {number} now seconds since 1970
 */
export function ago(then, now) {
  const seconds = now - then;
  if (seconds < 45) return "just now";
  if (seconds < 3600) return `${Math.max(1, Math.round(seconds / 60))} min ago`;
  if (seconds < 86400) return `${Math.round(seconds / 3600)} h ago`;
  return `${Math.round(seconds / 86400)} days ago`;
}

/**
 * @param {number} count
 * @param {string} noun
 */
export function counted(count, noun) {
  return `${count} ${noun}${count === 1 ? "" : "s"}`;
}

/** Side lengths of a box as text. @param {number[]} lengths */
export function sides(lengths) {
  return lengths.map((length) => String(Number(length.toPrecision(3)))).join(" × ");
}

/** @param {number} metres */
export function centimetres(metres) {
  return (100 * metres).toFixed(1);
}

/**
 * A joint's position as text.
 * @param {"revolute" | "prismatic"} type
 * @param {number} value rad or m
 */
export function jointValue(type, value) {
  return type === "revolute" ? `${Math.round((value * 180) / Math.PI)}°` : `${(100 * value).toFixed(0)} cm`;
}

/** Name that simulators accept: accents are removed, other special characters become underscores. @param {string} typed */
export function usableName(typed) {
  const plain = typed.trim().normalize("NFKD").replaceAll(/\p{M}/gu, "");
  const joined = plain.replaceAll(/\W+/g, "_").replaceAll(/^_|_$/g, "");
  const refused = /^(\d|(con|prn|aux|nul|com\d|lpt\d)$)/i; // by simulators; by Windows, which reserves these for devices
  return refused.test(joined) ? `item_${joined}` : joined;
}
