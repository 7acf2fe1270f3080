/** One WebSocket per tab: job progress, masks, saved objects. Messages arrive as events named by their type. */

/** @typedef {{ type: string, seq?: number, [key: string]: unknown }} Message */

const SESSION_ENDED = 4401;

class Live extends EventTarget {
  /** @type {WebSocket | null} */
  #socket = null;
  /** @type {string | null} */
  #project = null;
  #page = "";
  /** @type {number | null} */
  #object = null;
  #epoch = "";
  #seq = 0;
  #wait = 500;

  /** Whether the server hears us. */
  get connected() {
    return this.#socket?.readyState === WebSocket.OPEN;
  }

  /** What the server calls this tab. */
  tab = "";

  /**
   * Look at a project; null for none.
   * @param {string | null} project
   */
  watch(project) {
    this.#project = project;
    if (!this.#socket) this.#open();
    else this.#tell();
  }

  /**
   * Be at a page and on an object, for the others to see.
   * @param {string} page
   * @param {number | null} object
   */
  stand(page, object) {
    if (page === this.#page && object === this.#object) return;
    this.#page = page;
    this.#object = object;
    this.#tell();
  }

  #tell() {
    const where = { type: "watch", project: this.#project, page: this.#page, object: this.#object };
    if (this.connected) this.#socket?.send(JSON.stringify(where));
  }

  #open() {
    const query = new URLSearchParams({ since: String(this.#seq), epoch: this.#epoch });
    if (this.#project) query.set("project", this.#project);
    const socket = new WebSocket(`${location.origin.replace(/^http/, "ws")}/api/live?${query}`);
    this.#socket = socket;
    socket.addEventListener("open", () => {
      this.#wait = 500;
      this.#tell();
      this.dispatchEvent(new Event("online"));
    });
    socket.addEventListener("message", (event) => this.#receive(JSON.parse(String(event.data))));
    socket.addEventListener("close", ({ code }) => {
      if (code === SESSION_ENDED)
        return location.assign(`/login?${new URLSearchParams({ next: location.pathname + location.search })}`);
      this.dispatchEvent(new Event("offline"));
      setTimeout(() => this.#open(), this.#wait);
      this.#wait = Math.min(this.#wait * 1.8, 8000);
    });
  }

  /** @param {Message} message */
  #receive(message) {
    if (message.type === "hello") {
      this.#epoch = String(message.epoch);
      this.tab = String(message.tab);
      if (message.reset || this.#seq === 0) this.#seq = Number(message.seq);
    }
    if (message.seq !== undefined) this.#seq = Math.max(this.#seq, message.seq);
    this.dispatchEvent(new CustomEvent(message.type, { detail: message }));
  }
}

export const live = new Live();
