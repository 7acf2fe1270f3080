/** One line over the frame: what a click would do now. Those who have made a few objects know. */

import { h } from "../dom.js";

const KNOWN_FROM = 3; // objects

/** @typedef {{ pinning: boolean, proposed: string | null, name: string | undefined, objects: number }} Now */

export class Tip {
  element = h("div", { class: "tip" });

  /** @param {string} text */
  say(text) {
    this.element.hidden = false;
    this.element.textContent = text;
  }

  /** @param {Now} now */
  show(now) {
    this.say(textOf(now));
    this.element.hidden = !now.pinning && now.objects >= KNOWN_FROM;
  }
}

/** @param {Now} now */
function textOf({ pinning, proposed, name }) {
  if (pinning) return "Click where the comment belongs. Esc leaves it.";
  if (proposed) return proposed;
  if (name === undefined)
    return "Click a drawer, a door or a thing, or draw a box around it. The first click starts a new object.";
  return `Not what you expected? Left click adds to ${name}, right click takes away. Enter starts the next object.`;
}
