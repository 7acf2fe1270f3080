/** Findings of the certificate, by object and by place; no DOM. */

/** @typedef {import("../api-types").Certificate} Certificate */
/** @typedef {import("../api-types").Finding} Finding */

/**
 * Findings of equal place and severity together, each message without the place's own name before it.
 * @param {Finding[]} findings
 * @returns {{ where: string, severity: string, messages: string[] }[]}
 */
export function byPlace(findings) {
  /** @type {Map<string, { where: string, severity: string, messages: string[] }>} */
  const places = new Map();
  for (const { where, severity, message } of findings) {
    const key = `${severity} ${where}`;
    const place = places.get(key) ?? { where, severity, messages: [] };
    const bare = message.startsWith(`${where}: `) ? message.slice(where.length + 2) : message;
    if (!place.messages.includes(bare)) place.messages.push(bare);
    places.set(key, place);
  }
  return [...places.values()];
}

/**
 * Findings located at an object, at several objects including it, or at a part of it: names of links and joints begin with that
 * of their object.
 * @param {Certificate | null} certificate
 * @param {string} name
 * @param {string[]} names of all objects
 */
export function findingsAbout(certificate, name, names) {
  return (certificate?.findings ?? []).filter(({ where }) =>
    where.split(", ").some((part) => owner(part, names) === name),
  );
}

/**
 * @param {string} where
 * @param {string[]} names
 */
function owner(where, names) {
  return names
    .filter((name) => where === name || where.startsWith(`${name}_`))
    .toSorted((a, b) => b.length - a.length)[0];
}
