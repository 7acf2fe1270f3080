import assert from "node:assert/strict";
import test from "node:test";

const kept = new Map();
/** Listeners to the storage events of the browser. */
const listeners = [];
globalThis.addEventListener = (type, act) =>
  type === "storage" && listeners.push(act);
globalThis.localStorage = {
  get length() {
    return kept.size;
  },
  key: (k) => [...kept.keys()][k] ?? null,
  getItem: (name) => kept.get(name) ?? null,
  setItem: (name, text) => kept.set(name, text),
  removeItem: (name) => kept.delete(name),
};
const { Outbox, outbox } = await import("../../static/js/outbox.js");
const { Tabs } = await import("../../static/js/lib/tabs.js");
const { live } = await import("../../static/js/live.js");

/** Mock server that gives these responses in order; undefined: a lost connection. */
function serve(...answers) {
  const asked = [];
  globalThis.fetch = async (path, { headers, body }) => {
    asked.push({
      path,
      key: headers["Idempotency-Key"],
      body: JSON.parse(body),
    });
    const answer = answers.shift();
    if (answer === undefined) {
      setTimeout(() => live.dispatchEvent(new Event("online")));
      throw new TypeError("no network");
    }
    return new Response(JSON.stringify(answer.body), {
      status: answer.status ?? 200,
    });
  };
  return asked;
}

const change = (path, json = {}) => ({ method: "POST", path, json });

test("a change without a response is sent again with the same key, and stays stored until it is answered", async () => {
  const asked = serve(
    undefined,
    undefined,
    { body: { id: 1 } },
    { body: { id: 2 } },
  );
  const both = Promise.all([
    outbox.send(change("/a")),
    outbox.send(change("/b")),
  ]);
  assert.equal(kept.size, 2);
  assert.deepEqual(await both, [{ id: 1 }, { id: 2 }]);
  assert.deepEqual(
    asked.map(({ path }) => path),
    ["/a", "/a", "/a", "/b"],
  );
  const [first, again, once, other] = asked.map(({ key }) => key);
  assert.ok(first && first === again && again === once && once !== other);
  assert.equal(kept.size, 0);
});

test("a change is sent again with the same key while the server is busy or its disk is full", async () => {
  const busy = {
    status: 503,
    body: {
      kind: "environment",
      message: "the database does not answer",
      hint: "",
    },
  };
  const full = {
    status: 507,
    body: { kind: "no-space", message: "the disk is full", hint: "" },
  };
  const asked = serve(busy, full, { body: { id: 3 } });
  const wake = setInterval(() => live.dispatchEvent(new Event("online")));
  assert.deepEqual(await outbox.send(change("/a")), { id: 3 });
  clearInterval(wake);
  assert.equal(new Set(asked.map(({ key }) => key)).size, 1);
});

test("a click on an object still being created is sent to the id that the object gets", async () => {
  const asked = serve({ body: { id: 41 } }, { body: {} });
  const made = outbox.send(change("/objects"), "k1");
  const clicked = outbox.send(change("/objects/{k1}/points"));
  await Promise.all([made, clicked]);
  assert.deepEqual(
    asked.map(({ path }) => path),
    ["/objects", "/objects/41/points"],
  );
});

test("changes left by an earlier visit are sent for the same user only; a refusal is reported and final", async () => {
  const left = (key, user, at) =>
    JSON.stringify({ ...change(`/${key}`), key, user, at });
  kept.set("r2c2r-change-0000000000000001-x", left("x", "ann", 1));
  kept.set("r2c2r-change-0000000000000002-y", left("y", "bea", 2));
  const asked = serve({
    status: 422,
    body: { kind: "input", message: "no", hint: "" },
  });
  const refused = new Promise((resolve) =>
    outbox.addEventListener("refused", ({ detail }) => resolve(detail.message)),
  );
  outbox.begin("ann");
  assert.equal(await refused, "no");
  assert.deepEqual(
    asked.map(({ path, key }) => [path, key]),
    [["/x", "x"]],
  );
  assert.deepEqual([...kept.keys()], ["r2c2r-change-0000000000000002-y"]);
  kept.clear();
});

test("a change in conflict with another user's is merged and sent with a new key", async () => {
  const conflict = {
    status: 409,
    body: {
      kind: "conflict",
      message: "changed",
      hint: "",
      current: { version: 8 },
    },
  };
  const asked = serve(conflict, { body: { version: 9 } });
  outbox.merge = async (old, stored) => ({
    ...old,
    json: { ...old.json, version: stored.version },
  });
  const answer = await outbox.send({
    ...change("/a", { name: "mug", version: 7 }),
    seen: { name: "cup" },
  });
  assert.deepEqual(answer, { version: 9 });
  assert.deepEqual(
    asked.map(({ body }) => body.version),
    [7, 8],
  );
  assert.notEqual(asked[0].key, asked[1].key);
});

test("a second verdict given before the first is stored is based on the first, and is no conflict with oneself", async () => {
  const { giveVerdict } = await import("../../static/js/changes.js");
  const candidates = [{ id: "c0", verdict: null }];
  const seen = { object: 4, version: 7, candidates };
  const group = {
    version: 8,
    override: {},
    candidates: [{ id: "c0", verdict: "accepted" }],
  };
  const asked = serve(
    { body: { text: "", group } },
    { body: { text: "", group: { ...group, version: 9 } } },
  );
  const give = (verdict) =>
    outbox.send(giveVerdict("p", seen, { candidate: "c0", verdict }));
  const waiting = Promise.all([give("accepted"), give("rejected")]);
  await waiting;
  assert.deepEqual(
    asked.map(({ body }) => body.version),
    [7, 8],
  );
});

test("a correction merges with another user's correction of a different field and takes over its version", async () => {
  globalThis.HTMLElement ??= class {};
  const { merged } = await import("../../static/js/conflict.js");
  const mine = {
    ...change("/override", { hinge: "left", rerun: true, version: 3 }),
    seen: { hinge: null, pose: null },
  };
  const stored = {
    version: 5,
    override: { hinge: null, pose: [[1]] },
    group: { name: "door", candidates: [] },
  };
  assert.deepEqual((await merged(mine, stored)).json, {
    hinge: "left",
    rerun: true,
    version: 5,
  });
});

test("clicks on an object whose creation was refused are rejected without a request", async () => {
  const asked = serve({
    status: 422,
    body: { kind: "prompt", message: "no such frame", hint: "" },
  });
  const made = outbox.send(change("/objects"), "k2");
  const clicked = outbox.send(change("/objects/{k2}/points"));
  await assert.rejects(made, { message: "no such frame" });
  await assert.rejects(clicked, { kind: "not-made" });
  assert.deepEqual(
    asked.map(({ path }) => path),
    ["/objects"],
  );
  assert.equal(kept.size, 0);
});

test("a change whose response is truncated is sent again with the same key", async () => {
  const asked = [];
  globalThis.fetch = async (_, { headers }) => {
    asked.push(headers["Idempotency-Key"]);
    setTimeout(() => live.dispatchEvent(new Event("online")));
    return new Response(asked.length === 1 ? '{"id": ' : '{"id": 3}');
  };
  assert.deepEqual(await outbox.send(change("/a"), "cut"), { id: 3 });
  assert.deepEqual(asked, ["cut", "cut"]);
});

test("a change made before the user is known is stored under that user afterwards", async () => {
  outbox.begin("");
  serve(undefined, { body: {} });
  const sent = outbox.send(change("/early"));
  outbox.begin("ann");
  assert.deepEqual(
    [...kept.values()].map((text) => JSON.parse(text).user),
    ["ann"],
  );
  await sent;
});

/** Mock of the Web Locks API: one holder per lock, the others wait in order; `close` ends the tab that made the requests. */
function locksOf(all) {
  const mine = [];
  return {
    async request(name, act) {
      const queue = (all[name] ??= []);
      const before = queue.at(-1);
      let free;
      const turn = new Promise((resolve) => (free = resolve));
      queue.push(turn);
      mine.push(free);
      await before;
      await act();
      free();
    },
    close: () => mine.forEach((free) => free()),
  };
}

test("pending changes of an open tab are left to it; once it is closed, another tab of the user sends them once", async () => {
  const all = {};
  const tabs = ["one", "two", "three"].map((name) => ({
    locks: locksOf(all),
    name,
  }));
  const [one, two, three] = tabs.map(
    ({ locks, name }) => new Outbox(new Tabs(locks, name)),
  );
  const asked = [];
  globalThis.fetch = async (path) => {
    asked.push(path);
    throw new TypeError("no network");
  };
  one.begin("ann");
  one.send(change("/a"));
  one.send(change("/b"));
  two.begin("ann"); // opened while the changes are pending
  three.begin("bea");
  for (const heard of listeners) heard({ key: [...kept.keys()][0] });
  await new Promise((resolve) => setTimeout(resolve));
  assert.deepEqual([one.waiting, two.waiting, three.waiting], [2, 0, 0]);
  assert.deepEqual(new Set(asked), new Set(["/a"]));
  globalThis.fetch = () => new Promise(() => {}); // the first tab gets no more responses
  live.dispatchEvent(new Event("online"));
  await new Promise((resolve) => setTimeout(resolve));
  asked.length = 0;
  globalThis.fetch = async (path) => (asked.push(path), new Response("{}"));
  tabs[0].locks.close();
  await new Promise((resolve) => two.addEventListener("caught-up", resolve));
  await two.settled;
  assert.deepEqual(asked, ["/a", "/b"]);
  assert.equal(kept.size, 0);
});
