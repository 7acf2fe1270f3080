// @ts-check
/** Draws the scene of a bundle without a server: WebGL 2, orbit camera, a slider a joint, findings to fly to. */
(() => {
  /**
   * @typedef {{ low: number[], span: number[], positions: string, uv: string, indices: string, texture: number, colour: number[] }} Mesh
   * @typedef {{ name: string, kind: "revolute" | "prismatic", axis: number[], lower: number, upper: number }} Joint
   * @typedef {{ name: string, object: string, parent: number, pose: number[], joint: Joint | null, surface: Mesh | null, colliders: Mesh | null }} Body
   * @typedef {{ name: string, text: string }} Item
   * @typedef {{ severity: string, message: string, object: string | null }} Finding
   * @typedef {{ name: string, passed: boolean, bodies: Body[], textures: string[], objects: Item[], findings: Finding[], yaw: number }} Scene
   * @typedef {{ array: WebGLVertexArrayObject, count: number, mesh: Mesh }} Drawable
   */

  /** @type {Scene} */
  const scene = JSON.parse(byId("scene").textContent ?? "");
  const canvas = /** @type {HTMLCanvasElement} */ (byId("view"));
  const context = canvas.getContext("webgl2", { antialias: true });
  if (!context) {
    byId("caption").textContent =
      "This browser has no WebGL 2: see preview.png and report.html instead.";
    return;
  }
  const gl = context;

  // Matrices: column-major arrays of 16, as WebGL takes them

  /** @type {(a: ArrayLike<number>, b: ArrayLike<number>) => number[]} */
  const product = (a, b) =>
    Array.from({ length: 16 }, (_, k) => {
      const [column, row] = [k >> 2, k & 3];
      let sum = 0;
      for (let i = 0; i < 4; i += 1)
        sum += at(a, i * 4 + row) * at(b, column * 4 + i);
      return sum;
    });
  /** @type {(m: ArrayLike<number>, p: number[]) => number[]} */
  const apply = (m, [x = 0, y = 0, z = 0]) =>
    [0, 1, 2].map(
      (r) => at(m, r) * x + at(m, 4 + r) * y + at(m, 8 + r) * z + at(m, 12 + r),
    );
  /** @type {(m: ArrayLike<number>, v: number[]) => number[]} rotation transposed */
  const unturn = (m, v) =>
    [0, 1, 2].map((c) =>
      dot([at(m, c * 4), at(m, c * 4 + 1), at(m, c * 4 + 2)], v),
    );
  /** @type {(a: number[], b: number[]) => number} */
  const dot = (a, b) => a.reduce((sum, value, k) => sum + value * at(b, k), 0);
  /** @type {(a: number[], b: number[], s?: number) => number[]} */
  const plus = (a, b, s = 1) => a.map((value, k) => value + s * at(b, k));
  /** @type {(a: number[], b: number[]) => number[]} */
  const cross = ([a = 0, b = 0, c = 0], [d = 0, e = 0, f = 0]) => [
    b * f - c * e,
    c * d - a * f,
    a * e - b * d,
  ];
  /** @type {(v: number[]) => number[]} */
  const unit = (v) => v.map((value) => value / Math.hypot(...v));

  /**
   * What a joint does to its body at a position.
   * @param {Joint} joint
   * @param {number} value
   */
  function motion({ kind, axis: [x = 0, y = 0, z = 0] }, value) {
    if (kind === "prismatic")
      return [
        1,
        0,
        0,
        0,
        0,
        1,
        0,
        0,
        0,
        0,
        1,
        0,
        x * value,
        y * value,
        z * value,
        1,
      ];
    const [c, s] = [Math.cos(value), Math.sin(value)];
    const t = 1 - c;
    return [
      ...[t * x * x + c, t * x * y + s * z, t * x * z - s * y, 0],
      ...[t * x * y - s * z, t * y * y + c, t * y * z + s * x, 0],
      ...[t * x * z + s * y, t * y * z - s * x, t * z * z + c, 0],
      ...[0, 0, 0, 1],
    ];
  }

  // What is drawn

  const program = link(
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
  const grid = link(
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
  const floor = buffers({
    low: [],
    span: [],
    texture: -1,
    colour: [],
    positions: encoded(
      new Uint16Array([0, 0, 0, 65535, 0, 0, 65535, 65535, 0, 0, 65535, 0]),
    ),
    uv: encoded(new Uint16Array(8)),
    indices: encoded(new Uint32Array([0, 1, 2, 0, 2, 3])),
  });
  const surfaces = scene.bodies.map((body) =>
    body.surface ? buffers(body.surface) : null,
  );
  const colliders = scene.bodies.map((body) =>
    body.colliders ? buffers(body.colliders) : null,
  );
  const textures = scene.textures.map(loadTexture);

  /** @type {number[]} joint positions by body */
  const positions = scene.bodies.map(() => 0);
  /** @type {Map<number, number>} where joints are going */
  const goals = new Map();
  /** @type {number[][]} */
  let worlds = [];
  let showColliders = false;
  /** @type {string | null} */
  let marked = null;
  const view = { target: [0, 0, 0], yaw: scene.yaw, pitch: 0.35, distance: 3 };
  let waiting = false;
  let painted = 0;

  function place() {
    worlds = [];
    scene.bodies.forEach((body, k) => {
      const own = body.joint
        ? product(body.pose, motion(body.joint, positions[k] ?? 0))
        : body.pose;
      worlds.push(
        body.parent < 0 ? own : product(worlds[body.parent] ?? [], own),
      );
    });
  }

  /**
   * Corners of what is shown of an object, or of everything.
   * @param {string | null} object
   */
  function bounds(object) {
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    scene.bodies.forEach((body, k) => {
      const mesh = body.surface ?? body.colliders;
      if (!mesh || (object !== null && body.object !== object)) return;
      for (let corner = 0; corner < 8; corner += 1) {
        const local = mesh.low.map(
          (value, axis) => value + ((corner >> axis) & 1) * at(mesh.span, axis),
        );
        apply(worlds[k] ?? [], local).forEach((value, axis) => {
          low[axis] = Math.min(at(low, axis), value);
          high[axis] = Math.max(at(high, axis), value);
        });
      }
    });
    return { low, high };
  }

  /** @param {string | null} object */
  function flyTo(object) {
    const { low, high } = bounds(object);
    if (!low.every(Number.isFinite)) return;
    view.target = low.map((value, k) => (value + at(high, k)) / 2);
    view.distance = Math.max(0.6, 1.5 * Math.hypot(...plus(high, low, -1)));
    marked = object;
    draw();
  }

  function eye() {
    const flat = Math.cos(view.pitch) * view.distance;
    return plus(view.target, [
      flat * Math.cos(view.yaw),
      flat * Math.sin(view.yaw),
      Math.sin(view.pitch) * view.distance,
    ]);
  }

  function camera() {
    const from = eye();
    const back = unit(plus(from, view.target, -1));
    const right = unit(cross([0, 0, 1], back));
    const up = cross(back, right);
    const look = [0, 1, 2].flatMap((k) => [
      at(right, k),
      at(up, k),
      at(back, k),
      0,
    ]);
    look.push(-dot(right, from), -dot(up, from), -dot(back, from), 1);
    const focal = 1 / Math.tan(0.35);
    const aside = byId("panel").clientWidth / canvas.clientWidth; // the middle of what the panel leaves free
    const [near, far] = [view.distance * 0.02, view.distance * 30];
    const lens = [
      ...[(focal * canvas.height) / canvas.width, 0, 0, 0],
      ...[0, focal, 0, 0],
      ...[aside, 0, -(far + near) / (far - near), -1],
      ...[0, 0, (-2 * far * near) / (far - near), 0],
    ];
    return { matrix: product(lens, look), from, right, up, back, focal, aside };
  }

  function draw() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame((now) => {
      waiting = false;
      const moving = step(Math.min((now - painted) / 1000, 0.1));
      painted = now;
      if (moving) draw();
      paint();
    });
  }

  /**
   * Move joints towards their goals; whether more is to come.
   * @param {number} seconds since the last picture
   */
  function step(seconds) {
    for (const [body, goal] of goals) {
      const joint = scene.bodies[body]?.joint;
      const left = goal - (positions[body] ?? 0);
      const most = ((joint?.upper ?? 0) - (joint?.lower ?? 0)) * seconds * 1.5;
      positions[body] =
        Math.abs(left) <= most
          ? goal
          : (positions[body] ?? 0) + Math.sign(left) * most;
      if (positions[body] === goal) goals.delete(body);
    }
    showPositions();
    return goals.size > 0;
  }

  function paint() {
    const scale = Math.min(window.devicePixelRatio || 1, 2);
    canvas.width = Math.round(canvas.clientWidth * scale);
    canvas.height = Math.round(canvas.clientHeight * scale);
    place();
    const { matrix, from } = camera();
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(
      gl.SRC_ALPHA,
      gl.ONE_MINUS_SRC_ALPHA,
      gl.ONE,
      gl.ONE_MINUS_SRC_ALPHA,
    );
    gl.useProgram(program);
    gl.uniformMatrix4fv(
      gl.getUniformLocation(program, "camera"),
      false,
      matrix,
    );
    gl.uniform3fv(gl.getUniformLocation(program, "eye"), from);
    scene.bodies.forEach((body, k) => drawBody(body, k));
    gl.useProgram(grid);
    gl.uniformMatrix4fv(gl.getUniformLocation(grid, "camera"), false, matrix);
    gl.uniform4f(
      gl.getUniformLocation(grid, "place"),
      at(view.target, 0),
      at(view.target, 1),
      0,
      30,
    );
    gl.bindVertexArray(floor.array);
    gl.drawElements(gl.TRIANGLES, floor.count, gl.UNSIGNED_INT, 0);
  }

  /**
   * @param {Body} body
   * @param {number} k
   */
  function drawBody(body, k) {
    const item = showColliders ? colliders[k] : surfaces[k];
    if (!item) return;
    const texture = textures[item.mesh.texture];
    const uniform = (/** @type {string} */ name) =>
      gl.getUniformLocation(program, name);
    gl.uniformMatrix4fv(uniform("world"), false, worlds[k] ?? []);
    gl.uniform3fv(uniform("low"), item.mesh.low);
    gl.uniform3fv(uniform("span"), item.mesh.span);
    gl.uniform4fv(uniform("colour"), [...item.mesh.colour, 1]);
    gl.uniform1i(uniform("textured"), texture ? 1 : 0);
    gl.uniform1f(uniform("glow"), body.object === marked ? 1 : 0);
    if (texture) gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.bindVertexArray(item.array);
    gl.drawElements(gl.TRIANGLES, item.count, gl.UNSIGNED_INT, 0);
  }

  // Hand and keyboard

  /**
   * The body under the pointer, by the boxes of what is drawn.
   * @param {PointerEvent} event
   */
  function under(event) {
    const box = canvas.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * 2 - 1;
    const y = 1 - ((event.clientY - box.top) / box.height) * 2;
    const { from, right, up, back, focal } = camera();
    const sideways = plus(
      plus([0, 0, 0], right, (x * box.width) / box.height / focal),
      up,
      y / focal,
    );
    const direction = unit(plus(sideways, back, -1));
    let [best, nearest] = [-1, Infinity];
    scene.bodies.forEach((body, k) => {
      const mesh = body.surface ?? body.colliders;
      const world = worlds[k];
      if (!mesh || !world) return;
      const start = unturn(world, plus(from, world.slice(12, 15), -1));
      const along = unturn(world, direction);
      let [enter, leave] = [0, Infinity];
      for (let axis = 0; axis < 3; axis += 1) {
        const one = (at(mesh.low, axis) - at(start, axis)) / at(along, axis);
        const other =
          (at(mesh.low, axis) + at(mesh.span, axis) - at(start, axis)) /
          at(along, axis);
        enter = Math.max(enter, Math.min(one, other));
        leave = Math.min(leave, Math.max(one, other));
      }
      if (enter < leave && enter < nearest) [best, nearest] = [k, enter];
    });
    return best;
  }

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
      const body = scene.bodies[under(event)];
      byId("caption").textContent =
        scene.objects.find((item) => item.name === body?.object)?.text ?? "";
      canvas.style.cursor = body?.joint ? "pointer" : "grab";
      return;
    }
    const [dx, dy] = [event.clientX - held.x, event.clientY - held.y];
    const spread = pinch();
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    travelled += Math.abs(dx) + Math.abs(dy);
    if (pointers.size > 1) zoom(spread / Math.max(pinch(), 1));
    else if (event.shiftKey || event.buttons & 6) shift(dx, dy);
    else turn(-dx * 0.006, dy * 0.006);
  });
  canvas.addEventListener("pointerup", (event) => {
    pointers.delete(event.pointerId);
    if (travelled < 4 && event.button === 0) toggle(under(event));
  });
  canvas.addEventListener("pointercancel", (event) =>
    pointers.delete(event.pointerId),
  );
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      zoom(Math.exp(event.deltaY * 0.001));
    },
    { passive: false },
  );
  canvas.addEventListener("keydown", (event) => {
    /** @type {Record<string, () => void>} */
    const keys = {
      ArrowLeft: () => turn(-0.1, 0),
      ArrowRight: () => turn(0.1, 0),
      ArrowUp: () => turn(0, 0.08),
      ArrowDown: () => turn(0, -0.08),
      "+": () => zoom(0.9),
      "=": () => zoom(0.9),
      "-": () => zoom(1.1),
      Home: () => flyTo(null),
    };
    const act = keys[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  });
  window.addEventListener("resize", draw);

  function pinch() {
    const [a, b] = [...pointers.values()];
    return a && b ? Math.hypot(a.x - b.x, a.y - b.y) : 1;
  }

  /** @type {(yaw: number, pitch: number) => void} */
  function turn(yaw, pitch) {
    view.yaw += yaw;
    view.pitch = Math.min(Math.max(view.pitch + pitch, -1.5), 1.5);
    draw();
  }

  /** @param {number} factor */
  function zoom(factor) {
    view.distance = Math.min(Math.max(view.distance * factor, 0.05), 100);
    draw();
  }

  /** @type {(dx: number, dy: number) => void} */
  function shift(dx, dy) {
    const { right, up, focal } = camera();
    const metres = (2 * view.distance) / focal / canvas.clientHeight;
    view.target = plus(plus(view.target, right, -dx * metres), up, dy * metres);
    draw();
  }

  /** @param {number} body */
  function toggle(body) {
    const joint = scene.bodies[body]?.joint;
    if (!joint) return;
    const goal = goals.get(body) ?? positions[body] ?? 0;
    goals.set(
      body,
      goal > (joint.lower + joint.upper) / 2 ? joint.lower : joint.upper,
    );
    draw();
  }

  // The panel

  /** @type {Map<number, { slider: HTMLInputElement, output: HTMLOutputElement, joint: Joint }>} */
  const sliders = new Map();

  function showPositions() {
    for (const [body, { slider, output, joint }] of sliders) {
      const value = positions[body] ?? 0;
      slider.value = String(value);
      output.textContent =
        joint.kind === "revolute"
          ? `${Math.round((value * 180) / Math.PI)}°`
          : `${Math.round(value * 1000)} mm`;
    }
  }

  function buildPanel() {
    byId("name").textContent = scene.name;
    byId("verdict").textContent = scene.passed
      ? "Certificate passed"
      : "Certificate failed";
    byId("verdict").className = scene.passed ? "good" : "bad";
    scene.bodies.forEach((body, k) => {
      const { joint } = body;
      if (!joint) return;
      const output = document.createElement("output");
      const slider = document.createElement("input");
      Object.assign(slider, {
        type: "range",
        min: joint.lower,
        max: joint.upper,
        step: "any",
        value: 0,
      });
      slider.addEventListener("input", () => {
        goals.delete(k);
        positions[k] = Number(slider.value);
        showPositions();
        draw();
      });
      slider.setAttribute("aria-label", joint.name);
      const row = document.createElement("div");
      row.className = "joint";
      row.append(joint.name, output, slider);
      byId("joints").append(row);
      sliders.set(k, { slider, output, joint });
    });
    if (!sliders.size)
      byId("joints").textContent = "Nothing in this scene opens.";
    const head = document.createElement("h2");
    head.textContent = scene.findings.length ? "Findings" : "No findings";
    byId("findings").append(head, ...scene.findings.map(findingButton));
    byId("open").addEventListener("click", () =>
      sendAll((joint) => joint.upper),
    );
    byId("close").addEventListener("click", () =>
      sendAll((joint) => joint.lower),
    );
    byId("home").addEventListener("click", () => flyTo(null));
    byId("colliders").addEventListener("change", (event) => {
      showColliders = /** @type {HTMLInputElement} */ (event.target).checked;
      draw();
    });
  }

  /** @param {Finding} finding */
  function findingButton({ severity, message, object }) {
    const button = document.createElement("button");
    button.type = "button";
    button.className = `finding ${severity}`;
    button.textContent = message;
    button.disabled = object === null;
    button.addEventListener("click", () => flyTo(object));
    return button;
  }

  /** @param {(joint: Joint) => number} goalOf */
  function sendAll(goalOf) {
    for (const [body, { joint }] of sliders) goals.set(body, goalOf(joint));
    draw();
  }

  // Small things

  /** @type {(list: ArrayLike<number>, index: number) => number} */
  function at(list, index) {
    return list[index] ?? 0;
  }

  /** @param {string} id */
  function byId(id) {
    return /** @type {HTMLElement} */ (document.getElementById(id));
  }

  /** @param {string} text */
  function decoded(text) {
    return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
  }

  /** @param {Uint16Array | Uint32Array} values */
  function encoded(values) {
    return btoa(String.fromCharCode(...new Uint8Array(values.buffer)));
  }

  /** @type {(vertex: string, fragment: string) => WebGLProgram} */
  function link(vertex, fragment) {
    const made = gl.createProgram();
    for (const [kind, text] of /** @type {[number, string][]} */ ([
      [gl.VERTEX_SHADER, vertex],
      [gl.FRAGMENT_SHADER, fragment],
    ])) {
      const shader = /** @type {WebGLShader} */ (gl.createShader(kind));
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(made, shader);
    }
    gl.bindAttribLocation(made, 0, "position");
    gl.bindAttribLocation(made, 1, "uv");
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS))
      throw new Error(gl.getProgramInfoLog(made) ?? "shader");
    return made;
  }

  /**
   * @param {Mesh} mesh
   * @returns {Drawable}
   */
  function buffers(mesh) {
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    for (const [
      slot,
      text,
      size,
    ] of /** @type {[number, string, number][]} */ ([
      [0, mesh.positions, 3],
      [1, mesh.uv, 2],
    ])) {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, decoded(text), gl.STATIC_DRAW);
      gl.enableVertexAttribArray(slot);
      gl.vertexAttribPointer(slot, size, gl.UNSIGNED_SHORT, true, 0, 0);
    }
    const indices = decoded(mesh.indices);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    return { array, count: indices.byteLength / 4, mesh };
  }

  /** @param {string} url */
  function loadTexture(url) {
    const texture = gl.createTexture();
    const image = new Image();
    image.addEventListener("load", () => {
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, true);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, gl.RGB, gl.UNSIGNED_BYTE, image);
      gl.generateMipmap(gl.TEXTURE_2D);
      gl.texParameteri(
        gl.TEXTURE_2D,
        gl.TEXTURE_MIN_FILTER,
        gl.LINEAR_MIPMAP_LINEAR,
      );
      draw();
    });
    image.src = url;
    return texture;
  }

  buildPanel();
  place();
  flyTo(null);
})();
