// @ts-check
import { apply, at, motion, plus, product, unit, unturn } from "./algebra.js";

/** @typedef {import("./scene.d.ts").Joint} Joint */

/** Where everything stands: joint positions, where they are going, and what that makes of the bodies. */
export class Kitchen {
  /** @param {import("./scene.d.ts").Scene} scene */
  constructor(scene) {
    this.scene = scene;
    /** @type {number[]} joint positions by body */
    this.positions = scene.bodies.map(() => 0);
    /** @type {Map<number, number>} where joints are going */
    this.goals = new Map();
    /** @type {number[][]} */
    this.worlds = [];
    this.place();
  }

  place() {
    this.worlds = [];
    this.scene.bodies.forEach((body, k) => {
      const own = body.joint
        ? product(body.pose, motion(body.joint, this.positions[k] ?? 0))
        : body.pose;
      const parent = this.worlds[body.parent];
      this.worlds.push(parent ? product(parent, own) : own);
    });
  }

  /** @type {(body: number, value: number) => void} */
  put(body, value) {
    this.goals.delete(body);
    this.positions[body] = value;
  }

  /** @param {(joint: Joint) => number} goalOf */
  sendAll(goalOf) {
    this.scene.bodies.forEach(({ joint }, k) => {
      if (joint) this.goals.set(k, goalOf(joint));
    });
  }

  /** @param {number} body */
  toggle(body) {
    const joint = this.scene.bodies[body]?.joint;
    if (!joint) return;
    const goal = this.goals.get(body) ?? this.positions[body] ?? 0;
    const isOpen = goal > (joint.lower + joint.upper) / 2;
    this.goals.set(body, isOpen ? joint.lower : joint.upper);
  }

  /**
   * Move joints towards their goals; whether more is to come.
   * @param {number} seconds since the last picture
   */
  step(seconds) {
    for (const [body, goal] of this.goals) {
      const joint = this.scene.bodies[body]?.joint;
      const position = this.positions[body] ?? 0;
      const left = goal - position;
      const most = ((joint?.upper ?? 0) - (joint?.lower ?? 0)) * seconds * 1.5;
      if (Math.abs(left) <= most) this.put(body, goal);
      else this.positions[body] = position + Math.sign(left) * most;
    }
    return this.goals.size > 0;
  }

  /**
   * Corners of what is shown of an object, or of everything.
   * @param {string | null} object
   */
  bounds(object) {
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    this.scene.bodies.forEach((body, k) => {
      const mesh = body.surface ?? body.colliders;
      if (!mesh || (object !== null && body.object !== object)) return;
      for (let corner = 0; corner < 8; corner += 1) {
        const local = mesh.low.map(
          (value, axis) => value + ((corner >> axis) & 1) * at(mesh.span, axis),
        );
        apply(this.worlds[k] ?? [], local).forEach((value, axis) => {
          low[axis] = Math.min(at(low, axis), value);
          high[axis] = Math.max(at(high, axis), value);
        });
      }
    });
    return { low, high };
  }

  /**
   * The nearest body that a ray meets, by the boxes of what is drawn; -1 where it meets none.
   * @type {(from: number[], towards: number[]) => number}
   */
  hit(from, towards) {
    const direction = unit(towards);
    let [best, nearest] = [-1, Infinity];
    this.scene.bodies.forEach((body, k) => {
      const mesh = body.surface ?? body.colliders;
      const world = this.worlds[k];
      if (!mesh || !world) return;
      const start = unturn(world, plus(from, world.slice(12, 15), -1));
      const along = unturn(world, direction);
      let [enter, leave] = [0, Infinity];
      for (let axis = 0; axis < 3; axis += 1) {
        const near = at(mesh.low, axis) - at(start, axis);
        const one = near / at(along, axis);
        const other = (near + at(mesh.span, axis)) / at(along, axis);
        enter = Math.max(enter, Math.min(one, other));
        leave = Math.min(leave, Math.max(one, other));
      }
      if (enter < leave && enter < nearest) [best, nearest] = [k, enter];
    });
    return best;
  }
}
