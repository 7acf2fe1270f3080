import assert from "node:assert/strict";
import test from "node:test";

const kept = new Map();
/** What listens to the browser's storage. */
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

/** A server that answers what it is told to. */
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

test("a change whose answer is lost is sent again under its own key, the next under another, and both are kept until then", async () => {
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

test("a server that is busy or full is asked again; a change is never sent for somebody else", async () => {
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

test("a click on an object that is still being made goes to the number it gets, whatever else waits", async () => {
  const asked = serve({ body: { id: 41 } }, { body: {} });
  const made = outbox.send(change("/objects"), "k1");
  const clicked = outbox.send(change("/objects/{k1}/points"));
  await Promise.all([made, clicked]);
  assert.deepEqual(
    asked.map(({ path }) => path),
    ["/objects", "/objects/41/points"],
  );
});

test("what an earlier visit left is sent, that person's alone; a refusal is said and not tried again", async () => {
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

test("what disagrees with somebody else's change is merged, and sent as another change", async () => {
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

test("of two corrections of different things both stay; the second is sent again over the first", async () => {
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

test("clicks on an object whose making was refused are refused here, in words, and not sent", async () => {
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

test("an answer that is cut off is asked for again under the same key", async () => {
  const asked = [];
  globalThis.fetch = async (_, { headers }) => {
    asked.push(headers["Idempotency-Key"]);
    setTimeout(() => live.dispatchEvent(new Event("online")));
    return new Response(asked.length === 1 ? '{"id": ' : '{"id": 3}');
  };
  assert.deepEqual(await outbox.send(change("/a"), "cut"), { id: 3 });
  assert.deepEqual(asked, ["cut", "cut"]);
});

test("what was done before it is known who does it is that person's", async () => {
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

/** A browser's locks: one holder each, the others in the order they came; `close` is the end of a tab. */
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

test("what waits in an open tab is left to it; once it is gone one of the others sends it, once", async () => {
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
  two.begin("ann"); // opened while they wait
  three.begin("bea");
  for (const heard of listeners) heard({ key: [...kept.keys()][0] });
  await new Promise((resolve) => setTimeout(resolve));
  assert.deepEqual([one.waiting, two.waiting, three.waiting], [2, 0, 0]);
  assert.deepEqual(new Set(asked), new Set(["/a"]));
  globalThis.fetch = () => new Promise(() => {}); // the first tab says nothing any more
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
