/** WebSocket of the tab for job progress, masks and saved objects. Dispatches each message as an event named by its type. */

/** @typedef {{ type: string, seq?: number, [key: string]: unknown }} Message */

const SESSION_ENDED = 4401;
const TOO_MANY_TABS = 4429;
const CROWDED_MS = 15_000; // until a tab refused as one too many tries again

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

  /** Whether the connection is open. */
  get connected() {
    return this.#socket?.readyState === WebSocket.OPEN;
  }

  /** Reason why the server refuses a connection to this tab; empty if it does not, or does not answer. */
  refusal = "";

  /** Id that the server gave this tab. */
  tab = "";

  /**
   * Subscribe to a project; null for none.
   * @param {string | null} project
   */
  watch(project) {
    this.#project = project;
    if (!this.#socket) this.#open();
    else this.#tell();
  }

  /**
   * Report the page and the object that this user is on, for others to see.
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
      this.#tell();
    });
    socket.addEventListener("message", (event) => this.#receive(JSON.parse(String(event.data))));
    socket.addEventListener("close", ({ code, reason }) => {
      if (code === SESSION_ENDED)
        return location.assign(`/login?${new URLSearchParams({ next: location.pathname + location.search })}`);
      this.refusal = code === TOO_MANY_TABS ? reason : "";
      if (this.refusal) this.#wait = CROWDED_MS;
      this.dispatchEvent(new Event("offline"));
      setTimeout(() => this.#open(), this.#wait);
      this.#wait = Math.min(this.#wait * 1.8, 8000);
    });
  }

  /** @param {Message} message */
  #receive(message) {
    if (message.type === "hello") {
      this.#wait = 500;
      this.refusal = "";
      this.#epoch = String(message.epoch);
      this.tab = String(message.tab);
      if (message.reset || this.#seq === 0) this.#seq = Number(message.seq);
    }
    if (message.seq !== undefined) this.#seq = Math.max(this.#seq, message.seq);
    if (message.type === "hello") this.dispatchEvent(new Event("online"));
    this.dispatchEvent(new CustomEvent(message.type, { detail: message }));
  }
}

export const live = new Live();
