/** WebSocket of the tab for job progress, masks and saved objects. Dispatches each message as an event named by its type. */

/** @typedef {{ type: string, seq?: number, [key: string]: unknown }} Message */

const SESSION_ENDED = 4401;
const TOO_MANY_TABS = 4429;
const CROWDED_MS = 15_000; // until a tab refused as one too many tries again
const ANSWER_MS = 5_000; // that the server has to answer a request, when no connection opens
const BLOCKED =
  "a proxy before the server does not pass WebSockets (Upgrade); until it does, pages are refreshed every few seconds";
const REFRESHED = ["online", "projects", "project"]; // the events on which pages load again

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
  #blocked = 0; // connections in a row that did not open although requests were answered

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
      this.refusal = code === TOO_MANY_TABS ? reason : this.#reason();
      if (code === TOO_MANY_TABS) this.#wait = CROWDED_MS;
      else this.#ask();
      this.dispatchEvent(new Event("offline"));
      setTimeout(() => this.#open(), this.#wait);
      this.#wait = Math.min(this.#wait * 1.8, 8000);
    });
  }

  /** Reason why no connection opens; one may fail by chance, as while the server starts. */
  #reason() {
    return this.#blocked > 1 ? BLOCKED : "";
  }

  /** Ask the server whether it answers requests: then a proxy blocks the connection, and pages load again in its place. */
  async #ask() {
    const limit = AbortSignal.timeout(ANSWER_MS);
    const answers = await fetch("/healthz", { signal: limit })
      .then(async (response) => response.ok && (await response.json()).state === "ok")
      .catch(() => false); // a proxy's own page is no answer
    this.#blocked = answers ? this.#blocked + 1 : 0;
    if (this.connected) return;
    this.refusal = this.#reason();
    for (const type of this.refusal ? ["offline", ...REFRESHED] : ["offline"]) this.dispatchEvent(new Event(type));
  }

  /** @param {Message} message */
  #receive(message) {
    if (message.type === "hello") {
      this.#wait = 500;
      this.refusal = "";
      this.#blocked = 0;
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
