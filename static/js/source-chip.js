/** Chip for the source of a number, with a word and a sign of its own for each source, so that none relies on colour alone. */

import { h } from "./dom.js";

/** @type {Record<string, { word: string, sign: string, title: string }>} */
const KINDS = {
  measured: { word: "measured", sign: "●", title: "seen in the recording" },
  at_least: { word: "at least", sign: "≥", title: "the widest opening that was seen; it may open further" },
  inferred: { word: "inferred", sign: "◐", title: "inferred from something else that was seen" },
  default: { word: "default", sign: "○", title: "not seen: the usual value of its category" },
  person: { word: "set by a person", sign: "✎", title: "set by a person" },
};

/**
 * @param {string} source
 * @param {{ of?: string, title?: string }} [about] of: name of the value, shown before the source
 */
export function sourceChip(source, { of = "", title = "" } = {}) {
  const { word, sign, title: meaning } = KINDS[source] ?? { word: source.replaceAll("_", " "), sign: "", title: "" };
  const text = [of && `${of}:`, sign, word].filter(Boolean).join(" ");
  return h("span", { class: `chip source ${source}`, title: title || meaning }, text);
}

/** Word for a source. @param {string} source */
export const sourceWord = (source) => KINDS[source]?.word ?? source.replaceAll("_", " ");
