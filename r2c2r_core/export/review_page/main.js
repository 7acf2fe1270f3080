// @ts-check
import { Eye } from "./eye.js";
import { listen } from "./hand.js";
import { Kitchen } from "./kitchen.js";
import { Painter } from "./painter.js";
import { buildPanel, byId } from "./panel.js";

/** Draws the scene of a bundle without a server: WebGL 2, orbit camera, a slider a joint, findings to fly to. */
function start() {
  const canvas = /** @type {HTMLCanvasElement} */ (byId("view"));
  const gl = canvas.getContext("webgl2", { antialias: true });
  if (!gl) {
    byId("caption").textContent =
      "This browser has no WebGL 2: see preview.png and report.html instead.";
    return;
  }
  /** @type {import("./scene.d.ts").Scene} */
  const scene = JSON.parse(byId("scene").textContent ?? "");
  const kitchen = new Kitchen(scene);
  const eye = new Eye(canvas, byId("panel"), scene.yaw);
  const painter = new Painter(gl, kitchen, eye, draw);
  let waiting = false;
  let painted = 0;

  function draw() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame((now) => {
      waiting = false;
      const moving = kitchen.step(Math.min((now - painted) / 1000, 0.1));
      painted = now;
      show(kitchen.positions);
      if (moving) draw();
      painter.paint();
    });
  }

  /** @type {<A extends unknown[]>(act: (...given: A) => void) => (...given: A) => void} */
  const drawn =
    (act) =>
    (...given) => {
      act(...given);
      draw();
    };
  const flyTo = drawn((/** @type {string | null} */ object) => {
    kitchen.place();
    eye.fit(kitchen.bounds(object));
    painter.marked = object;
  });
  const under = (/** @type {number} */ x, /** @type {number} */ y) => {
    const { from, towards } = eye.ray(x, y);
    return kitchen.hit(from, towards);
  };
  const show = buildPanel(scene, {
    put: drawn((body, value) => kitchen.put(body, value)),
    sendAll: drawn((goalOf) => kitchen.sendAll(goalOf)),
    flyTo,
    showColliders: drawn((shown) => {
      painter.showColliders = shown;
    }),
  });
  listen(canvas, {
    look: (x, y) => {
      const body = scene.bodies[under(x, y)];
      const item = scene.objects.find(({ name }) => name === body?.object);
      byId("caption").textContent = item?.text ?? "";
      return Boolean(body?.joint);
    },
    press: drawn((x, y) => kitchen.toggle(under(x, y))),
    turn: drawn((yaw, pitch) => eye.turn(yaw, pitch)),
    shift: drawn((dx, dy) => eye.shift(dx, dy)),
    zoom: drawn((factor) => eye.zoom(factor)),
    fit: () => flyTo(null),
  });
  window.addEventListener("resize", draw);
  flyTo(null);
}

start();
