/** Who is signed in, and the way out; nothing for who opened the printed address. */

import { getSystem, signOut } from "../api.js";
import { h, LiveElement } from "../dom.js";
import { live } from "../live.js";
import { outbox } from "../outbox.js";
import { sayError } from "./toasts.js";

export class WhoIsIn extends LiveElement {
  connected() {
    live.addEventListener("you", () => this.#draw(), { signal: this.signal });
    this.#draw();
  }

  async #draw() {
    try {
      const { user, role, account } = await getSystem();
      outbox.begin(user);
      if (!account) return;
      const leave = h("button", { type: "button", class: "quiet", onClick: () => this.#leave() }, "Sign out");
      this.replaceChildren(h("a", { href: "/people", title: `${role}: accounts and your password` }, user), leave);
    } catch (error) {
      live.addEventListener("online", () => this.#draw(), { signal: this.signal, once: true });
      sayError(error);
    }
  }

  async #leave() {
    await signOut().catch(sayError);
    location.assign("/login");
  }
}
