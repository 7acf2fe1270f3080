import assert from "node:assert/strict";
import test from "node:test";
import {
  ago,
  bytes,
  counted,
  duration,
  jointValue,
  usableName,
} from "../../static/js/lib/format.js";
import {
  actionOf,
  clashes,
  KEYMAP,
  printed,
} from "../../static/js/lib/keymap.js";
import { contradictionsOn } from "../../static/js/lib/contradictions.js";
import { decodeBox, paintBox, rgbOf } from "../../static/js/lib/masks.js";
import { strips } from "../../static/js/lib/strips.js";
import {
  fit,
  pinch,
  toImage,
  toScreen,
  zoom,
} from "../../static/js/lib/view.js";
import { clicksOfBox } from "../../static/js/lib/box.js";
import { Gestures } from "../../static/js/lib/gestures.js";
import { inkOn } from "../../static/js/lib/colour.js";
import { ranked } from "../../static/js/lib/commands.js";
import { nextDoubtful, runs, worstFirst } from "../../static/js/lib/lanes.js";
import { disagreements } from "../../static/js/lib/merge.js";
import { project } from "../../static/js/lib/points.js";
import { neighbour, surest } from "../../static/js/lib/proposals.js";
import { forget, keep, keptBy, named } from "../../static/js/lib/kept.js";
import { nextPage } from "../../static/js/lib/next-page.js";
import { moved, shiftBetween } from "../../static/js/lib/moved.js";
import { together } from "../../static/js/lib/together.js";
import { Answers } from "../../static/js/lib/answers.js";
import { Newest } from "../../static/js/lib/newest.js";
import { patiently } from "../../static/js/lib/patience.js";
import { partedText } from "../../static/js/lib/parted.js";
import {
  PIECE,
  sendRest,
  stoppedUpload,
} from "../../static/js/lib/resumable.js";

const key = (name, held = {}) => ({
  key: name,
  ctrlKey: false,
  metaKey: false,
  shiftKey: false,
  altKey: false,
  ...held,
});

test("no key has two meanings on a page", () =>
  assert.deepEqual(clashes(), []));

test("every key of the table finds its action", () => {
  assert.equal(actionOf(key("ArrowRight"), "annotate"), "next-frame");
  assert.equal(
    actionOf(key("ArrowRight", { shiftKey: true }), "annotate"),
    "forward-ten",
  );
  assert.equal(
    actionOf(key("Z", { ctrlKey: true, shiftKey: true }), "annotate"),
    "redo",
  );
  assert.equal(actionOf(key("z", { metaKey: true }), "review"), "undo");
  assert.equal(actionOf(key("?", { shiftKey: true }), "review"), "help");
  assert.equal(actionOf(key("ArrowRight"), "review"), null);
  assert.ok(KEYMAP.every((binding) => binding.keys.length > 0));
});

test("keys that viser takes are free on the review page", () => {
  for (const taken of ["w", "a", "s", "d", "q", "e", "ArrowLeft", "ArrowRight"])
    assert.equal(actionOf(key(taken), "review"), null);
});

test("a packed mask comes out as it went in", async () => {
  const packed = Uint8Array.from([0b10110000]); // 1 0 1 1 0 0 of a 3 x 2 box
  const stream = new Blob([packed])
    .stream()
    .pipeThrough(new CompressionStream("deflate"));
  const bits = Buffer.from(await new Response(stream).arrayBuffer()).toString(
    "base64",
  );
  const mask = {
    width: 9,
    height: 9,
    left: 1,
    top: 2,
    box_width: 3,
    box_height: 2,
    bits,
  };
  assert.deepEqual([...(await decodeBox(mask))], [1, 0, 1, 1, 0, 0]);
});

test("a mask is painted in its colour, opaque at the rim, clear outside", () => {
  const full = new Uint8Array(25).fill(1);
  const rgba = paintBox(full, 5, 5, [10, 20, 30], 0.5);
  assert.deepEqual([...rgba.slice(0, 4)], [10, 20, 30, 255]);
  assert.equal(rgba[4 * 12 + 3], 128);
  assert.equal(paintBox(new Uint8Array(25), 5, 5, [1, 2, 3], 1)[3], 0);
  assert.deepEqual(rgbOf("#0b61c4"), [11, 97, 196]);
});

test("zooming keeps the point under the cursor; screen and image are inverse", () => {
  const view = fit({ width: 960, height: 720 }, { width: 500, height: 500 });
  const at = { x: 123, y: 321 };
  const before = toImage(view, at);
  const after = toImage(zoom(view, 1.7, at, 0.1), at);
  assert.ok(
    Math.abs(before.x - after.x) < 1e-9 && Math.abs(before.y - after.y) < 1e-9,
  );
  const there = toScreen(view, before);
  assert.ok(Math.abs(there.x - at.x) < 1e-9 && Math.abs(there.y - at.y) < 1e-9);
});

test("the whole image is visible and centred when fitted", () => {
  const view = fit({ width: 200, height: 100 }, { width: 400, height: 400 });
  assert.deepEqual(view, { scale: 2, x: 0, y: 100 });
});

test("numbers read well", () => {
  assert.equal(bytes(999), "999 B");
  assert.equal(bytes(1_500_000), "1.5 MB");
  assert.equal(duration(75), "1 min 15 s");
  assert.equal(ago(0, 10), "just now");
  assert.equal(ago(0, 7200), "2 h ago");
  assert.equal(counted(1, "object"), "1 object");
  assert.equal(jointValue("revolute", Math.PI / 2), "90°");
  assert.equal(jointValue("prismatic", 0.42), "42 cm");
});

test("proposals are walked round the end, past those about to go", () => {
  const items = /** @type {any[]} */ (
    ["a", "b", "c"].map((id, k) => ({
      id,
      confidence: 0.9 - 0.3 * k,
      doubts: [],
    }))
  );
  const step = (
    /** @type {string | null} */ current,
    /** @type {1 | -1} */ by,
    /** @type {string[]} */ ...gone
  ) => neighbour(items, current, by, new Set(gone))?.id;
  assert.equal(step(null, 1), "a");
  assert.equal(step(null, -1), "c");
  assert.equal(step("c", 1), "a");
  assert.equal(step("a", -1), "c");
  assert.equal(step("a", 1, "a", "b"), "c");
  assert.equal(step("a", 1, "a", "b", "c"), undefined);
  const ids = (/** @type {any[]} */ all) => all.map((item) => item.id);
  assert.deepEqual(ids(surest(items, 0.6).sure), ["a", "b"]);
  const [first, second] = [
    { ...items[0], doubts: ["overlaps a drawer"] },
    items[1],
  ];
  assert.deepEqual(ids(surest([first, second], 0.6).sure), ["b"]); // a person looks at the other first
  assert.deepEqual(ids(surest([first, second], 0.6).leftOut), ["a"]);
});

test("frames that stand out are marked in the strips", () => {
  const usual = {
    sharpness: 1,
    depth_share: 0.9,
    brightness: 0.5,
    error_mm: 6,
  };
  const odd = {
    sharpness: 0.2,
    depth_share: 0.1,
    brightness: 0.99,
    error_mm: 60,
  };
  const moments = [usual, usual, usual, odd, { ...usual, error_mm: null }].map(
    (m, k) => ({ ...m, frame_index: 5 * k }),
  );
  const found = strips(moments);
  assert.deepEqual(
    found.map((strip) => strip.name),
    ["Sharpness", "Depth", "Brightness", "Depth mismatch"],
  );
  for (const { bars, summary } of found) {
    assert.deepEqual(
      bars.flatMap((bar) => (bar.off ? [bar.frame] : [])),
      [15],
    );
    assert.match(summary, /^1 of 5 frames/);
    assert.ok(bars.every((bar) => bar.height >= 0 && bar.height <= 1));
  }
});

const file = new Blob([new Uint8Array(2 * PIECE + 10)]);

/** A server that keeps half of a piece and then cannot be reached, so often. */
function faultyServer(failures) {
  const kept = { bytes: 0, failures };
  return {
    kept,
    send: async (offset, piece) => {
      assert.equal(offset, kept.bytes);
      if (kept.failures-- > 0) {
        kept.bytes += piece.size >> 1;
        throw new Error("lost");
      }
      return (kept.bytes += piece.size);
    },
    ask: async () => kept.bytes,
    mayPass: (error) => error.message === "lost",
    onProgress: () => {},
    wait: async () => {},
  };
}

test("an upload goes on where the server's copy ends, however often the connection is lost", async () => {
  for (const failures of [0, 1, 5]) {
    const server = faultyServer(failures);
    await sendRest(file, 0, server);
    assert.equal(server.kept.bytes, file.size);
  }
});

test("an upload that is refused is given up", async () => {
  const refusing = {
    ...faultyServer(0),
    send: async () => Promise.reject(new Error("too large")),
  };
  await assert.rejects(sendRest(file, 0, refusing), /too large/);
});

test("only the same file goes on with a stopped upload", () => {
  const stopped = { file_name: "a.r3d", size: 9, modified: 1.5, offset: 3 };
  assert.equal(
    stoppedUpload({ name: "a.r3d", size: 9, lastModified: 1500 }, [stopped]),
    stopped,
  );
  for (const other of [{ name: "b.r3d" }, { size: 8 }, { lastModified: 1501 }])
    assert.equal(
      stoppedUpload({ name: "a.r3d", size: 9, lastModified: 1500, ...other }, [
        stopped,
      ]),
      undefined,
    );
});

test("a box becomes a click on its middle and one beside every side that is in the frame", () => {
  const frame = { width: 100, height: 80, index: 4 };
  const clicks = clicksOfBox({ x: 60, y: 50 }, { x: 20, y: 10 }, frame);
  assert.deepEqual(clicks[0], { frame: 4, x: 40, y: 30, label: 1 });
  assert.ok(
    clicks
      .slice(1)
      .every(
        (c) => c.label === 0 && (c.x < 20 || c.x > 60 || c.y < 10 || c.y > 50),
      ),
  );
  assert.equal(clicks.length, 5);
  assert.equal(clicksOfBox({ x: 0, y: 0 }, { x: 40, y: 40 }, frame).length, 3); // nothing is said outside the picture
  assert.equal(clicksOfBox({ x: 10, y: 10 }, { x: 13, y: 40 }, frame), null); // a slip of the hand
});

test("doubtful frames are found, and the worst come first", () => {
  const frames = [0, 3, 7, 9].map((index) => ({ index }));
  const sure = new Map([
    [0, 0.9],
    [3, 0.4],
    [7, 0.8],
    [9, 0.1],
  ]);
  assert.equal(nextDoubtful(frames, sure, 0, 1), 1);
  assert.equal(nextDoubtful(frames, sure, 1, 1), 3);
  assert.equal(nextDoubtful(frames, sure, 1, -1), null);
  assert.deepEqual(
    worstFirst(sure, 3)
      .map((e) => e.frame)
      .slice(0, 2),
    [9, 3],
  );
  assert.equal(worstFirst(sure, 10).length, 4);
});

test("only what two people set differently is asked about", () => {
  const seen = { name: "a", category: "drawer" };
  assert.deepEqual(
    disagreements(seen, { name: "b" }, { name: "c", category: "drawer" }),
    ["name"],
  );
  assert.deepEqual(
    disagreements(seen, { name: "b" }, { name: "a", category: "cabinet" }),
    [],
  ); // theirs is elsewhere
  assert.deepEqual(
    disagreements(seen, { name: "b" }, { name: "b", category: "drawer" }),
    [],
  ); // the same thought
});

test("the palette finds by any word, best first", () => {
  const commands = ["Next frame", "Object drawer_1", "Frame without masks"].map(
    (text) => ({ text, run: () => {} }),
  );
  assert.deepEqual(
    ranked(commands, "frame").map((c) => c.text),
    ["Frame without masks", "Next frame"],
  );
  assert.deepEqual(
    ranked(commands, "draw obj").map((c) => c.text),
    ["Object drawer_1"],
  );
  assert.equal(ranked(commands, "").length, 3);
});

test("letters alone can be turned off; keys with Ctrl stay", () => {
  assert.equal(actionOf(key("g"), "annotate"), "segment");
  assert.equal(actionOf(key("g"), "annotate", false), null);
  assert.equal(
    actionOf(key("k", { ctrlKey: true }), "annotate", false),
    "palette",
  );
  assert.equal(actionOf(key("ArrowRight"), "annotate", false), "next-frame");
});

test("of two points behind each other the nearer one is drawn", () => {
  const cloud = {
    positions: Int16Array.from([0, -50, 0, 0, 50, 0]),
    colours: Uint8Array.from([9, 9, 9, 200, 0, 0]),
    radius: 50,
  };
  const picture = {
    width: 21,
    height: 21,
    data: new Uint8ClampedArray(4 * 21 * 21),
  };
  project(cloud, { yaw: 0, pitch: 0 }, picture);
  assert.deepEqual(
    [...picture.data.slice(4 * (11 * 21 + 11), 4 * (11 * 21 + 11) + 4)],
    [9, 9, 9, 255],
  );
});

test("the others are named once each, with where they are, and oneself not at all", () => {
  const here = (tab, who, page, object = null) => ({ tab, who, page, object });
  const people = [
    here("a", "ann", "annotate", 3),
    here("b", "bob", "review", 4),
    here("c", "bob", "download"),
    here("d", "ann", "run"),
  ];
  assert.deepEqual(together(people, "a", new Map([[4, "drawer_1"]])), [
    { who: "bob", where: "review drawer_1, download" },
    { who: "you, in another tab", where: "run" },
  ]);
  assert.deepEqual(
    together([here("a", "ann", "annotate")], "a", new Map()),
    [],
  );
});

test("a box moved and moved back is where it was, whichever way it faces", () => {
  const [c, s] = [Math.cos(0.7), Math.sin(0.7)];
  const pose = [
    [c, -s, 0, 1],
    [s, c, 0, 2],
    [0, 0, 1, 0.5],
    [0, 0, 0, 1],
  ];
  const shift = { right: 0.1, back: -0.02, up: 0.3, turn: -0.4 };
  const back = shiftBetween(pose, moved(pose, shift));
  for (const name of Object.keys(shift))
    assert.ok(Math.abs(back[name] - shift[name]) < 1e-12, name);
  const faced = moved(
    [
      [1, 0, 0, 0],
      [0, 1, 0, 0],
      [0, 0, 1, 0],
      [0, 0, 0, 1],
    ],
    { right: 1, back: 2, up: 3, turn: Math.PI / 2 },
  );
  assert.deepEqual(
    faced.slice(0, 3).map((row) => row[3]),
    [1, 2, 3],
  ); // right of who faces its front at -Y
  assert.deepEqual(
    faced.slice(0, 2).map((row) => Math.round(row[0])),
    [0, 1],
  ); // its width now runs along +Y
});

test("changes are kept in order, each person's own, until they are answered; what cannot be read is passed over", () => {
  const items = new Map();
  const store = {
    get length() {
      return items.size;
    },
    key: (k) => [...items.keys()][k] ?? null,
    getItem: (name) => items.get(name) ?? null,
    setItem: (name, text) => items.set(name, text),
    removeItem: (name) => items.delete(name),
  };
  const change = (key, at, user = "ann") => ({
    key,
    at,
    user,
    method: "POST",
    path: `/p/{${key}}`,
    json: {},
  });
  for (const one of [change("c", 30), change("a", 4), change("b", 5, "bob")])
    assert.ok(keep(store, one));
  items.set("theme", "dark");
  items.set("r2c2r-change-0-torn", "{");
  assert.deepEqual(
    keptBy(store, "ann").map(({ key }) => key),
    ["a", "c"],
  );
  forget(store, change("a", 4));
  assert.deepEqual(
    keptBy(store, "ann").map(({ key }) => key),
    ["c"],
  );
  assert.equal(
    keep(
      {
        ...store,
        setItem: () => {
          throw new Error("full");
        },
      },
      change("d", 1),
    ),
    false,
  );
});

test("a click on an object that is still being made finds it once that has a number", () => {
  const click = {
    method: "POST",
    path: "/api/projects/p/objects/{k1}/points?infer=true",
    json: {},
  };
  assert.equal(
    named(click, "k1", 7).path,
    "/api/projects/p/objects/7/points?infer=true",
  );
  assert.equal(named(click, "k2", 7), click);
});

test("two fingers keep what is between them, and spread it as they spread", () => {
  const view = { scale: 2, x: 10, y: -5 };
  const [before, after] = [
    [
      { x: 0, y: 0 },
      { x: 10, y: 20 },
    ],
    [
      { x: 40, y: 40 },
      { x: 60, y: 80 },
    ],
  ];
  const pinched = pinch(view, before, after, 0.1);
  assert.equal(pinched.scale, 4);
  const [there, still] = [
    toImage(view, { x: 5, y: 10 }),
    toImage(pinched, { x: 50, y: 60 }),
  ];
  assert.ok(
    Math.abs(there.x - still.x) < 1e-9 && Math.abs(there.y - still.y) < 1e-9,
  );
});

test("after signing in only a page of this server opens, with its query", () => {
  const here = "http://localhost:8000";
  assert.equal(
    nextPage("/p/a/review?object=3", here),
    `${here}/p/a/review?object=3`,
  );
  assert.equal(
    new URL(nextPage("/.//evil.example/x", here), here).host,
    "localhost:8000",
  );
  for (const other of [
    null,
    "",
    "//evil.example",
    "https://evil.example",
    "javascript:alert(1)",
    "http://[",
  ])
    assert.equal(nextPage(other, here), `${here}/`);
});

test("a press that stays is a click, one that wanders a box, a click under it is carried, two fingers only zoom", () => {
  const at = (x, y) => ({ x, y });
  const free = { pan: false, held: null };
  const gestures = new Gestures();
  gestures.press(1, at(10, 10), free);
  assert.equal(gestures.move(1, at(12, 11), 3), null);
  assert.deepEqual(gestures.release(1, at(12, 11)), {
    kind: "click",
    at: at(12, 11),
  });
  gestures.press(1, at(10, 10), free);
  assert.deepEqual(gestures.move(1, at(30, 40), 3), {
    kind: "box",
    from: at(10, 10),
    to: at(30, 40),
  });
  assert.deepEqual(gestures.box, { from: at(10, 10), to: at(30, 40) });
  assert.deepEqual(gestures.release(1, at(31, 41)), {
    kind: "box",
    from: at(10, 10),
    to: at(31, 41),
  });
  gestures.press(1, at(10, 10), { pan: false, held: "mark" });
  assert.deepEqual(gestures.move(1, at(20, 10), 3), {
    kind: "carry",
    held: "mark",
    at: at(20, 10),
  });
  assert.equal(gestures.box, null);
  assert.deepEqual(gestures.release(1, at(20, 10)), {
    kind: "drop",
    held: "mark",
    at: at(20, 10),
  });
  gestures.press(1, at(10, 10), { pan: true, held: null });
  gestures.move(1, at(20, 10), 3);
  assert.deepEqual(gestures.move(1, at(21, 12), 3), {
    kind: "pan",
    by: at(1, 2),
  });
  assert.equal(gestures.release(1, at(21, 12)), null);
  gestures.press(1, at(10, 10), free);
  gestures.press(2, at(20, 10), free);
  assert.equal(gestures.move(2, at(30, 10), 3).kind, "pinch");
  assert.equal(gestures.release(2, at(30, 10)), null);
  assert.equal(gestures.release(1, at(10, 10)), null);
});

test("a lane is drawn in as few bars as it has stretches", () => {
  assert.deepEqual(runs([0.9, 0.8, undefined, 0.9, 0.2, 0.1]), [
    { from: 0, to: 2, doubtful: false },
    { from: 3, to: 4, doubtful: false },
    { from: 4, to: 6, doubtful: true },
  ]);
});

test("keys are printed as they stand on a keyboard, and none twice", () => {
  assert.deepEqual(printed(["Shift+ArrowRight", "v"]), ["Shift →", "V"]);
  assert.deepEqual(printed(["1", "2", "3"]), ["1 – 3"]);
  assert.deepEqual(printed(["j", "l", "Shift+j", "Shift+l"]), ["J", "L"]);
});

test("a number is read on every colour of the palette", () => {
  assert.deepEqual(["#0072b2", "#f0e442", "#000000", "#e69f00"].map(inkOn), [
    "#ffffff",
    "#10131a",
    "#ffffff",
    "#10131a",
  ]);
});

test("of two sets of bitmaps the newer one is held, whichever comes first, and every other one is closed", async () => {
  const closed = [];
  const bitmap = (name) => ({ name, close: () => closed.push(name) });
  const newest = new Newest();
  await newest.take([Promise.resolve(bitmap("first"))]);
  let arrive = (_) => {};
  const slow = new Promise((resolve) => (arrive = resolve));
  const overtaken = newest.take([slow, Promise.resolve(bitmap("b"))]);
  assert.equal(await newest.take([Promise.resolve(bitmap("c"))]), true);
  arrive(bitmap("a"));
  assert.equal(await overtaken, false);
  assert.deepEqual(
    [newest.held.map((one) => one.name), closed],
    [["c"], ["first", "a", "b"]],
  );
  await assert.rejects(
    newest.take([
      Promise.resolve(bitmap("d")),
      Promise.reject(new Error("no room")),
    ]),
    /no room/,
  );
  assert.deepEqual(
    [newest.held.map((one) => one.name), closed.at(-1)],
    [["c"], "d"],
  );
});

test("what is refused as too much at once is asked again after the time that was named, and said once", async () => {
  const heard = [];
  const waits = {
    retryMs: ({ ms }) => ms ?? null,
    told: ({ ms }) => heard.push(`told ${ms}`),
    wait: async (ms) => heard.push(ms),
  };
  const answers = [{ ms: 2000 }, { ms: 3000 }, "taken"];
  const ask = async () => {
    const answer = answers.shift();
    if (typeof answer === "string") return answer;
    throw answer;
  };
  assert.equal(await patiently(ask, waits), "taken");
  assert.deepEqual(heard, ["told 2000", 2000, 3000]);
  await assert.rejects(
    patiently(() => Promise.reject({ name: "no" }), waits),
    { name: "no" },
  );
  let asked = 0;
  await assert.rejects(
    patiently(() => (asked++, Promise.reject({ ms: 1 })), waits),
    { ms: 1 },
  );
  assert.equal(asked, 20);
});

/** A mask of these columns, 10 rows high, of a picture of 100 x 20. */
const columns = (object, left, right, clicks = []) => ({
  object,
  name: `door_${object}`,
  mask: {
    width: 100,
    height: 20,
    left,
    top: 5,
    box_width: right - left,
    box_height: 10,
    bits: "",
  },
  pixels: new Uint8Array((right - left) * 10).fill(1),
  clicks,
});

test("masks that share no more than a border contradict nothing", () => {
  assert.deepEqual(
    contradictionsOn([
      columns(1, 0, 51),
      columns(2, 50, 100),
      columns(3, 80, 80),
    ]),
    [],
  );
});

test("masks that share much of the smaller are said of both objects, with what mends it", () => {
  const some = contradictionsOn([columns(1, 0, 50), columns(2, 40, 90)]);
  assert.deepEqual(
    some.map(({ object, text }) => [object, text.split(":")[0]]),
    [
      [1, "Shares 20 % with door_2 here"],
      [2, "Shares 20 % with door_1 here"],
    ],
  );
  const most = contradictionsOn([columns(1, 0, 50), columns(2, 20, 50)]);
  assert.match(
    most[0].text,
    /^On the same thing as door_2 \(100 % shared\): merge or delete one/,
  );
  assert.deepEqual(
    most.map(({ mergesWith }) => mergesWith),
    [
      { object: 2, name: "door_2" },
      { object: 1, name: "door_1" },
    ],
  );
});

test("a mask that leaves out a click on it or takes in one off it says so", () => {
  const click = (x, label) => ({ x, y: 10.5, label });
  assert.deepEqual(
    contradictionsOn([
      columns(1, 0, 50, [click(20.5, 1), click(50.5, 1), click(70.5, 0)]),
    ]),
    [],
  );
  assert.match(
    contradictionsOn([columns(1, 0, 50, [click(60.5, 1)])])[0].text,
    /lies outside its mask/,
  );
  assert.match(
    contradictionsOn([columns(1, 0, 50, [click(20.5, 1), click(30.5, 0)])])[0]
      .text,
    /lies inside its mask/,
  );
});

test("an answer that a later one overtook is not taken, and one before a failure is", async () => {
  const answers = new Answers();
  const shown = [];
  const say = [];
  const taken = [0, 1, 2].map((k) => {
    const asked = new Promise(
      (resolve, reject) => (say[k] = { resolve, reject }),
    );
    return answers.take(asked, (answer) => shown.push(answer));
  });
  say[2].reject(new Error("the server is away"));
  await assert.rejects(taken[2], /away/);
  say[1].resolve("second");
  await taken[1];
  say[0].resolve("first");
  await taken[0];
  assert.deepEqual(shown, ["second"]);
  await answers.take(Promise.resolve("fourth"), (answer) => shown.push(answer));
  assert.deepEqual(shown, ["second", "fourth"]);
});

test("who gave way to whom is said by their names, and also that a front is whole again", () => {
  assert.equal(
    partedText("door_1", ["door_2", "door_3"]),
    "door_1 now ends at the seam to door_2, door_3",
  );
  assert.equal(partedText("door_1", []), "door_1 has its whole front again");
});

test("a name is joined to one that simulators accept", () => {
  for (const [typed, name] of [
    ["cook books", "cook_books"],
    [" Müsli-Schüssel ", "Musli_Schussel"],
    ["mom's cup (blue)", "mom_s_cup_blue"],
    ["drawer_1", "drawer_1"],
    ["架子", ""],
    ["2-door cabinet", "item_2_door_cabinet"],
    ["CON", "item_CON"], // Windows unpacks no folder of that name
    ["console", "console"],
  ])
    assert.equal(usableName(typed ?? ""), name);
});
