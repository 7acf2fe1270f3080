// @ts-check
import { at, cross, dot, plus, product, unit } from "./algebra.js";

const FOCAL = 1 / Math.tan(0.35);
const ROOM = 1.2; // for doors that open
const CORNERS = [0, 1].flatMap((x) =>
  [0, 1].flatMap((y) => [0, 1].map((z) => [x, y, z])),
);

/** Where the reader looks from: round a target, at a distance. */
export class Eye {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {HTMLElement} panel what covers part of the canvas, on its right
   * @param {number} yaw
   */
  constructor(canvas, panel, yaw) {
    this.canvas = canvas;
    this.panel = panel;
    this.target = [0, 0, 0];
    this.yaw = yaw;
    this.pitch = 0.35;
    this.distance = 3;
  }

  /** @type {(yaw: number, pitch: number) => void} */
  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.min(Math.max(this.pitch + pitch, -1.5), 1.5);
  }

  /** @param {number} factor */
  zoom(factor) {
    this.distance = Math.min(Math.max(this.distance * factor, 0.05), 100);
  }

  /** @type {(dx: number, dy: number) => void} in pixels */
  shift(dx, dy) {
    const { right, up } = this.axes();
    const metres = (2 * this.distance) / FOCAL / this.canvas.clientHeight;
    const aside = plus(this.target, right, -dx * metres);
    this.target = plus(aside, up, dy * metres);
  }

  /**
   * Look at the middle of a box from where it fits.
   * @param {{ low: number[], high: number[] }} box
   */
  fit({ low, high }) {
    if (!low.every(Number.isFinite)) return;
    this.target = low.map((value, k) => (value + at(high, k)) / 2);
    const { right, up, back } = this.axes();
    const { clientWidth, clientHeight } = this.canvas;
    const free = Math.max(1 - this.panel.clientWidth / clientWidth, 0.3); // of the width, beside the panel
    const slopes = [FOCAL / (free * (clientWidth / clientHeight)), FOCAL];
    const needed = CORNERS.map((corner) => {
      const offset = corner.map(
        (end, k) => (end - 0.5) * (at(high, k) - at(low, k)),
      );
      const [across, along] = [dot(offset, right), dot(offset, up)].map(
        (reach, k) => Math.abs(reach) * at(slopes, k),
      );
      return dot(offset, back) + Math.max(across ?? 0, along ?? 0);
    });
    this.distance = Math.max(0.6, ROOM * Math.max(...needed));
  }

  axes() {
    const flat = Math.cos(this.pitch) * this.distance;
    const from = plus(this.target, [
      flat * Math.cos(this.yaw),
      flat * Math.sin(this.yaw),
      Math.sin(this.pitch) * this.distance,
    ]);
    const back = unit(plus(from, this.target, -1));
    const right = unit(cross([0, 0, 1], back));
    return { from, right, up: cross(back, right), back };
  }

  /** The matrix from the world to the canvas. */
  matrix() {
    const { from, right, up, back } = this.axes();
    const look = [0, 1, 2].flatMap((k) => [
      ...[at(right, k), at(up, k)],
      ...[at(back, k), 0],
    ]);
    look.push(-dot(right, from), -dot(up, from), -dot(back, from), 1);
    const { canvas, distance } = this;
    const aside = this.panel.clientWidth / canvas.clientWidth; // the middle of what the panel leaves free
    const [near, far] = [distance * 0.02, distance * 30];
    const lens = [
      ...[(FOCAL * canvas.height) / canvas.width, 0, 0, 0],
      ...[0, FOCAL, 0, 0],
      ...[aside, 0, -(far + near) / (far - near), -1],
      ...[0, 0, (-2 * far * near) / (far - near), 0],
    ];
    return product(lens, look);
  }

  /**
   * The ray through a pixel of the page.
   * @type {(clientX: number, clientY: number) => { from: number[], towards: number[] }}
   */
  ray(clientX, clientY) {
    const box = this.canvas.getBoundingClientRect();
    const aside = this.panel.clientWidth / this.canvas.clientWidth;
    const x = ((clientX - box.left) / box.width) * 2 - 1 + aside;
    const y = 1 - ((clientY - box.top) / box.height) * 2;
    const { from, right, up, back } = this.axes();
    const across = (x * box.width) / box.height / FOCAL;
    const sideways = plus(plus([0, 0, 0], right, across), up, y / FOCAL);
    return { from, towards: plus(sideways, back, -1) };
  }
}
