import assert from "node:assert/strict";
import { beforeEach, mock, test } from "node:test";

/** A connection that a proxy refuses to open. */
class Refused extends EventTarget {
  static OPEN = 1;
  readyState = 3;

  constructor() {
    super();
    sockets.push(this);
  }

  /** @param {number} code */
  refuse(code = 1006) {
    this.dispatchEvent(
      Object.assign(new Event("close"), { code, reason: "too many tabs" }),
    );
  }
}

/** @type {Refused[]} */
const sockets = [];
/** @type {() => Promise<Response>} */
let answer = () => Promise.reject(new TypeError("Failed to fetch"));
mock.timers.enable({ apis: ["setTimeout"] });
Object.assign(globalThis, {
  WebSocket: Refused,
  location: new URL("http://kitchens.example/"),
  fetch: () => answer(),
});
const { live } = await import("../../static/js/live.js");
live.watch(null);

/** The last connection is refused, and the next one tried. */
async function refused(code = 1006) {
  /** @type {string[]} */
  const heard = [];
  const hear = (/** @type {Event} */ event) => heard.push(event.type);
  for (const type of ["offline", "online", "project"])
    live.addEventListener(type, hear);
  sockets.at(-1)?.refuse(code);
  await new Promise((resolve) => setImmediate(resolve));
  for (const type of ["offline", "online", "project"])
    live.removeEventListener(type, hear);
  mock.timers.tick(20_000);
  return heard;
}

beforeEach(() => {
  answer = () => Promise.reject(new TypeError("Failed to fetch"));
});

test("a connection that does not open is called blocked only while requests are answered", async () => {
  await refused();
  assert.equal(live.refusal, "");
  answer = () => Promise.resolve(new Response('{"state": "ok"}'));
  await refused(); // may be chance: the server has just started
  assert.equal(live.refusal, "");
  const heard = await refused();
  assert.match(live.refusal, /proxy.*WebSockets/);
  assert.deepEqual(heard.slice(-2), ["online", "project"]); // pages load again
  answer = () =>
    Promise.resolve(new Response("<h1>502 Bad Gateway</h1>", { status: 502 }));
  assert.deepEqual(await refused(), ["offline", "offline"]);
  assert.equal(live.refusal, "");
});

test("a tab that is one too many keeps the server's reason", async () => {
  await refused(4429);
  assert.equal(live.refusal, "too many tabs");
});
