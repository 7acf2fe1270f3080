/** Findings of the certificate about one object; no DOM. */

/** @typedef {import("../api-types").Certificate} Certificate */

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
