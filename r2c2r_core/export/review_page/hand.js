// @ts-check
/** Pointer, wheel and keyboard on the picture. */

/**
 * @typedef {object} Acts
 * @property {(x: number, y: number) => boolean} look a pointer rests there; whether something there opens
 * @property {(x: number, y: number) => void} press
 * @property {(yaw: number, pitch: number) => void} turn
 * @property {(dx: number, dy: number) => void} shift
 * @property {(factor: number) => void} zoom
 * @property {() => void} fit
 */

/**
 * @param {HTMLCanvasElement} canvas
 * @param {Acts} acts
 */
export function listen(canvas, acts) {
  /** @type {Map<number, { x: number, y: number }>} */
  const pointers = new Map();
  let travelled = 0;

  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    travelled = 0;
  });
  canvas.addEventListener("pointermove", (event) => {
    const held = pointers.get(event.pointerId);
    if (!held) {
      const opens = acts.look(event.clientX, event.clientY);
      canvas.style.cursor = opens ? "pointer" : "grab";
      return;
    }
    const [dx, dy] = [event.clientX - held.x, event.clientY - held.y];
    const spread = pinch(pointers);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    travelled += Math.abs(dx) + Math.abs(dy);
    if (pointers.size > 1) acts.zoom(spread / Math.max(pinch(pointers), 1));
    else if (event.shiftKey || event.buttons & 6) acts.shift(dx, dy);
    else acts.turn(-dx * 0.006, dy * 0.006);
  });
  canvas.addEventListener("pointerup", (event) => {
    pointers.delete(event.pointerId);
    if (travelled < 4 && event.button === 0)
      acts.press(event.clientX, event.clientY);
  });
  canvas.addEventListener("pointercancel", (event) =>
    pointers.delete(event.pointerId),
  );
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      acts.zoom(Math.exp(event.deltaY * 0.001));
    },
    { passive: false },
  );
  canvas.addEventListener("keydown", (event) => {
    const act = keys(acts)[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  });
}

/**
 * @param {Acts} acts
 * @returns {Record<string, () => void>}
 */
function keys({ turn, zoom, fit }) {
  return {
    ArrowLeft: () => turn(-0.1, 0),
    ArrowRight: () => turn(0.1, 0),
    ArrowUp: () => turn(0, 0.08),
    ArrowDown: () => turn(0, -0.08),
    "+": () => zoom(0.9),
    "=": () => zoom(0.9),
    "-": () => zoom(1.1),
    Home: fit,
  };
}

/** @param {Map<number, { x: number, y: number }>} pointers */
function pinch(pointers) {
  const [a, b] = [...pointers.values()];
  return a && b ? Math.hypot(a.x - b.x, a.y - b.y) : 1;
}
