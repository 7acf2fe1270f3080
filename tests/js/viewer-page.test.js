import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import vm from "node:vm";

const SCRIPT = readFileSync(new URL("../../static/js/viewer-page.js", import.meta.url), "utf8");

/** Number of frames that viser's heartbeat draws in a minute where each takes this long. @param {number} frame_ms */
function frames(frame_ms) {
  let [now, drawn] = [0, 0];
  /** @type {(() => void)[]} */
  const beats = [];
  const page = {
    performance: { now: () => now },
    requestAnimationFrame: (/** @type {() => void} */ act) => ((now += frame_ms / 2), act()),
    /** @param {() => void} act */
    setInterval: (act) => beats.push(act),
  };
  vm.runInNewContext(SCRIPT, page);
  page.setInterval(() => (drawn += 1), /** @type {any} */ (1000));
  while (now < 60_000) {
    now += 1000;
    beats[0]?.();
  }
  return drawn;
}

test("a scene that does not change is drawn once a second, and where a frame is slow for a tenth of the time", () => {
  assert.ok(frames(20) >= 55);
  assert.ok(frames(3000) <= 3);
});

test("other timers of the page keep their pace", () => {
  /** @type {unknown[]} */
  const asked = [];
  const page = { setInterval: (/** @type {unknown[]} */ ...given) => asked.push(given) };
  vm.runInNewContext(SCRIPT, page);
  const act = () => {};
  page.setInterval(act, 500);
  assert.deepEqual(asked, [[act, 500]]);
});
