// @ts-check
/** Programs, buffers and pictures of WebGL 2. */

/** @typedef {{ array: WebGLVertexArrayObject, count: number, mesh: import("./scene.d.ts").Mesh }} Drawable */

/** @type {(gl: WebGL2RenderingContext, vertex: string, fragment: string) => WebGLProgram} */
export function link(gl, vertex, fragment) {
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
 * @param {WebGL2RenderingContext} gl
 * @param {import("./scene.d.ts").Mesh} mesh
 * @returns {Drawable}
 */
export function buffers(gl, mesh) {
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  for (const [slot, text, size] of /** @type {[number, string, number][]} */ ([
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

/** @type {(gl: WebGL2RenderingContext, url: string, done: () => void) => WebGLTexture} */
export function loadTexture(gl, url, done) {
  const texture = gl.createTexture();
  const image = new Image();
  image.addEventListener("load", () => {
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, true);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, gl.RGB, gl.UNSIGNED_BYTE, image);
    gl.generateMipmap(gl.TEXTURE_2D);
    const mipmaps = gl.LINEAR_MIPMAP_LINEAR;
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, mipmaps);
    done();
  });
  image.src = url;
  return texture;
}

/** @param {Uint16Array | Uint32Array} values */
export function encoded(values) {
  return btoa(String.fromCharCode(...new Uint8Array(values.buffer)));
}

/** @param {string} text */
function decoded(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
}
