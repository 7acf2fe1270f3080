/** One-line hint over the frame on what a click does now; hidden once a few objects exist. */

import { h } from "../dom.js";

const KNOWN_FROM = 3; // objects

/** @typedef {{ cropping: boolean, pinning: boolean, proposed: string | null, name: string | undefined, objects: number }} Now */

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
    this.element.hidden = !now.cropping && !now.pinning && now.objects >= KNOWN_FROM;
  }
}

/** @param {Now} now */
function textOf({ cropping, pinning, proposed, name }) {
  if (cropping)
    return "Drag a side of the box, or choose one and press arrow keys; Esc ends. What lies outside does not belong to the object.";
  if (pinning) return "Click where the comment belongs. Esc cancels.";
  if (proposed) return proposed;
  if (name === undefined)
    return "Click a drawer, a door or a thing, or draw a box around it. The first click starts a new object.";
  return `Not what you expected? Left click adds to ${name}, right click takes away. Enter starts the next object.`;
}
