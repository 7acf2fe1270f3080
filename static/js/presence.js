/** Presence chips in the header: other people in this project, and the object each is on. */

import { listObjects } from "./api.js";
import { detailOf, h, LiveElement } from "./dom.js";
import { together } from "./lib/together.js";
import { live } from "./live.js";
import { routeOf } from "./router.js";

/** @typedef {import("./lib/together.js").Here} Here */

export class Presence extends LiveElement {
  /** @type {Here[]} */
  #people = [];
  /** Names of objects by id. @type {Map<number, string>} */
  #names = new Map();

  connected() {
    this.setAttribute("role", "status");
    this.setAttribute("aria-label", "Who else is here");
    live.addEventListener("presence", (event) => this.#show(/** @type {CustomEvent} */ (event).detail.people), {
      signal: this.signal,
    });
    const renamed = (/** @type {Event} */ event) => {
      const { object } = /** @type {{ object: { id: number, name: string } }} */ (detailOf(event));
      if (this.#names.get(object.id) === object.name) return;
      this.#names.set(object.id, object.name);
      this.#show(this.#people);
    };
    live.addEventListener("object", renamed, { signal: this.signal });
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

  /** Load the names of the project's objects. @param {string} project */
  async #learn(project) {
    const objects = await listObjects(project).catch(() => []);
    for (const { id, name } of objects) this.#names.set(id, name);
  }

  /** @param {Here[]} people */
  async #show(people) {
    this.#people = people;
    const { project } = routeOf(location);
    if (project !== null && people.some(({ object }) => object !== null && !this.#names.has(object)))
      await this.#learn(project);
    if (this.#people !== people) return; // others came or went meanwhile
    const chips = together(people, live.tab, this.#names).map(({ who, where }) =>
      h("span", { class: "chip", title: `${who}: ${where}` }, who, " · ", where),
    );
    this.replaceChildren(...chips);
  }
}
