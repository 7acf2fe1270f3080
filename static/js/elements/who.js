/** Signed-in user, inbox and sign-out button; empty for the printed address, which has no account. */

import { getInbox, getSystem, signOut } from "../api.js";
import { h, LiveElement } from "../dom.js";
import { Answers } from "../lib/answers.js";
import { live } from "../live.js";
import { outbox } from "../outbox.js";
import { sayError } from "./toasts.js";

export class WhoIsIn extends LiveElement {
  #answers = new Answers();
  #inbox = h("a", { href: "/inbox" }, "Inbox");

  connected() {
    live.addEventListener("projects", () => this.#inbox.isConnected && this.#count(), { signal: this.signal });
    live.addEventListener("you", () => this.#draw(), { signal: this.signal });
    this.#draw();
  }

  async #draw() {
    try {
      const { user, role, account, sign_out } = await getSystem();
      outbox.begin(user);
      if (!account) return;
      const leave = h("button", { type: "button", class: "quiet", onClick: () => this.#leave(sign_out) }, "Sign out");
      this.replaceChildren(
        this.#inbox,
        h("a", { href: "/people", title: `${role}: ${role === "admin" ? "people and " : ""}your account` }, user),
        sign_out ? leave : "",
      );
      this.#count();
    } catch (error) {
      live.addEventListener("online", () => this.#draw(), { signal: this.signal, once: true });
      sayError(error);
    }
  }

  /** Update the number of items in the inbox. */
  async #count() {
    try {
      await this.#answers.take(getInbox(this.signal), ({ returned, assigned, objects, mentions }) => {
        const waiting = returned.length + assigned.length + objects.length + mentions.length;
        this.#inbox.replaceChildren("Inbox", ...(waiting ? [" ", h("span", { class: "chip" }, `${waiting}`)] : []));
      });
    } catch (error) {
      sayError(error);
    }
  }

  /** @param {string | null} next page to open afterwards */
  async #leave(next) {
    await signOut().catch(sayError);
    location.assign(next ?? "/login");
  }
}
