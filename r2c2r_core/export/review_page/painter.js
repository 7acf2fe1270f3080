// @ts-check
import { at } from "./algebra.js";
import { buffers, encoded, link, loadTexture } from "./device.js";

/** Draws the kitchen: its surfaces or its colliders, what is marked, and a grid on the floor. */
export class Painter {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {import("./kitchen.js").Kitchen} kitchen
   * @param {import("./eye.js").Eye} eye
   * @param {() => void} redraw when a picture has arrived
   */
  constructor(gl, kitchen, eye, redraw) {
    this.gl = gl;
    this.kitchen = kitchen;
    this.eye = eye;
    this.showColliders = false;
    /** @type {string | null} an object */
    this.marked = null;
    this.program = link(
      gl,
      `#version 300 es
  in vec3 position; in vec2 uv; uniform mat4 camera, world; uniform vec3 low, span; out vec3 seen; out vec2 st;
  void main() { vec4 p = world * vec4(low + position * span, 1.0); seen = p.xyz; st = uv; gl_Position = camera * p; }`,
      `#version 300 es
  precision highp float; in vec3 seen; in vec2 st; uniform sampler2D picture; uniform vec4 colour; uniform bool textured;
  uniform vec3 eye; uniform float glow; out vec4 result;
  void main() {
    vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
    normal *= sign(dot(normal, eye - seen));
    float key = max(dot(normal, normalize(vec3(0.35, -0.5, 0.8))), 0.0);
    float head = max(dot(normal, normalize(eye - seen)), 0.0);
    vec3 base = textured ? texture(picture, st).rgb : colour.rgb;
    result = vec4(base * (0.55 + 0.2 * key + 0.3 * head) + glow * vec3(0.25, 0.18, 0.0), colour.a);
  }`,
    );
    this.grid = link(
      gl,
      `#version 300 es
  in vec3 position; uniform mat4 camera; uniform vec4 place; out vec2 ground;
  void main() { vec3 p = vec3(place.xy + (position.xy - 0.5) * place.w, place.z); ground = p.xy;
    gl_Position = camera * vec4(p, 1.0); }`,
      `#version 300 es
  precision highp float; in vec2 ground; uniform vec4 place; out vec4 result;
  void main() {
    vec2 lines = abs(fract(ground * 2.0 - 0.5) - 0.5) / fwidth(ground * 2.0);
    float fade = 1.0 - smoothstep(0.2, 0.5, length(ground - place.xy) / place.w);
    result = vec4(vec3(0.5), (1.0 - min(min(lines.x, lines.y), 1.0)) * 0.35 * fade);
  }`,
    );
    this.floor = buffers(gl, square());
    const { bodies, textures } = kitchen.scene;
    this.surfaces = bodies.map(
      (body) => body.surface && buffers(gl, body.surface),
    );
    this.colliders = bodies.map(
      (body) => body.colliders && buffers(gl, body.colliders),
    );
    this.textures = textures.map((url) => loadTexture(gl, url, redraw));
  }

  paint() {
    const { gl, eye, program, grid } = this;
    const { canvas } = eye;
    const scale = Math.min(window.devicePixelRatio || 1, 2);
    canvas.width = Math.round(canvas.clientWidth * scale);
    canvas.height = Math.round(canvas.clientHeight * scale);
    this.kitchen.place();
    const matrix = eye.matrix();
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    const rest = gl.ONE_MINUS_SRC_ALPHA;
    gl.blendFuncSeparate(gl.SRC_ALPHA, rest, gl.ONE, rest);
    gl.useProgram(program);
    gl.uniformMatrix4fv(
      gl.getUniformLocation(program, "camera"),
      false,
      matrix,
    );
    gl.uniform3fv(gl.getUniformLocation(program, "eye"), eye.axes().from);
    this.kitchen.scene.bodies.forEach((body, k) => this.paintBody(body, k));
    gl.useProgram(grid);
    gl.uniformMatrix4fv(gl.getUniformLocation(grid, "camera"), false, matrix);
    const place = [at(eye.target, 0), at(eye.target, 1), 0, 30];
    gl.uniform4fv(gl.getUniformLocation(grid, "place"), place);
    gl.bindVertexArray(this.floor.array);
    gl.drawElements(gl.TRIANGLES, this.floor.count, gl.UNSIGNED_INT, 0);
  }

  /**
   * @param {import("./scene.d.ts").Body} body
   * @param {number} k
   */
  paintBody(body, k) {
    const { gl, program } = this;
    const item = (this.showColliders ? this.colliders : this.surfaces)[k];
    if (!item) return;
    const texture = this.textures[item.mesh.texture];
    const uniform = (/** @type {string} */ name) =>
      gl.getUniformLocation(program, name);
    gl.uniformMatrix4fv(uniform("world"), false, this.kitchen.worlds[k] ?? []);
    gl.uniform3fv(uniform("low"), item.mesh.low);
    gl.uniform3fv(uniform("span"), item.mesh.span);
    gl.uniform4fv(uniform("colour"), [...item.mesh.colour, 1]);
    gl.uniform1i(uniform("textured"), texture ? 1 : 0);
    gl.uniform1f(uniform("glow"), body.object === this.marked ? 1 : 0);
    if (texture) gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.bindVertexArray(item.array);
    gl.drawElements(gl.TRIANGLES, item.count, gl.UNSIGNED_INT, 0);
  }
}

/** The floor's unit square, as a mesh of the scene. */
function square() {
  const corners = [0, 0, 0, 65535, 0, 0, 65535, 65535, 0, 0, 65535, 0];
  return {
    low: [],
    span: [],
    texture: -1,
    colour: [],
    positions: encoded(new Uint16Array(corners)),
    uv: encoded(new Uint16Array(8)),
    indices: encoded(new Uint32Array([0, 1, 2, 0, 2, 3])),
  };
}
