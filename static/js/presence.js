/** Who else is at this project, and on which object: chips in the header. */

import { h, LiveElement } from "./dom.js";
import { together } from "./lib/together.js";
import { live } from "./live.js";
import { routeOf } from "./router.js";

/** @typedef {import("./lib/together.js").Here} Here */

export class Presence extends LiveElement {
  connected() {
    this.setAttribute("role", "status");
    this.setAttribute("aria-label", "Who else is here");
    live.addEventListener("presence", (event) => this.#show(/** @type {CustomEvent} */ (event).detail.people), {
      signal: this.signal,
    });
    for (const type of ["r2c2r-go", "r2c2r-remember", "popstate"])
      window.addEventListener(type, () => this.#stand(), { signal: this.signal });
    this.#stand();
  }

  #stand() {
    const { page, project, query } = routeOf(location);
    if (project === null) this.replaceChildren();
    const object = Number(query.get("object"));
    live.stand(page, Number.isInteger(object) && object > 0 ? object : null);
  }

  /** @param {Here[]} people */
  #show(people) {
    const chips = together(people, live.tab).map(({ who, where }) =>
      h("span", { class: "chip", title: `${who}: ${where}` }, who, " · ", where),
    );
    this.replaceChildren(...chips);
  }
}
