// Points as disks that lie in their surface, triangles, and lines, by WebGL 2.

const CLOUD_VERTEX = `#version 300 es
uniform mat4 view, clip;
uniform vec3 viewOrigin;
uniform vec2 uvOrigin;
uniform float step, radius, pixelsPerUnit, uvStep;
uniform bool isMesh;
in vec3 point;
in vec4 normal;
in vec4 color;
in float size;
in vec2 uv;
out vec3 viewNormal, viewPoint;
out vec4 shade;
out vec2 place;
out float diskRadius, pixels;
void main() {
  place = uvOrigin + uvStep * uv;
  vec4 position = vec4(viewOrigin + mat3(view) * (step * point), 1.0);
  viewPoint = position.xyz;
  viewNormal = mat3(view) * normal.xyz;
  shade = color;
  diskRadius = radius * exp2(size / 18.0 - 2.0);
  pixels = 2.0 * diskRadius * pixelsPerUnit / max(-position.z, 1e-9);
  gl_PointSize = clamp(pixels, 1.6, 400.0);
  gl_Position = !isMesh && color.a < 0.5 ? vec4(2.0, 2.0, 2.0, 1.0) : clip * position;
}`;

const CLOUD_FRAGMENT = `#version 300 es
precision highp float;
uniform mat4 clip;
uniform bool isMesh, showReverse, isPainted;
uniform float ambient;
uniform sampler2D image;
in vec3 viewNormal, viewPoint;
in vec4 shade;
in vec2 place;
in float diskRadius, pixels;
out vec4 result;
const vec3 light = vec3(-0.38, 0.6, 0.71); // 45 degrees aside: turned to it or away, a surface changes most
void main() {
  vec3 painted = texture(image, place).rgb; // before any pixel is discarded, whose neighbours choose the mipmap
  if (shade.a < 0.999) discard;
  vec3 n = normalize(viewNormal);
  bool isReverse = dot(n, viewPoint) > 0.0;
  if (isReverse && !showReverse) discard;
  if (isReverse) n = -n;
  float z = viewPoint.z;
  if (!isMesh && pixels > 3.0) {
    vec2 p = vec2(2.0, -2.0) * (gl_PointCoord - 0.5);
    float rise = -dot(n.xy, p) / max(n.z, 0.2);
    float squared = dot(p, p) + rise * rise;
    if (squared > 1.0) discard;
    z += diskRadius * (rise - 0.5 * squared);
  }
  gl_FragDepth = 0.5 + 0.5 * (clip[2][2] * z + clip[3][2]) / -z;
  float wrapped = 0.5 + 0.5 * dot(n, light); // half Lambert (Mitchell et al. 2007): shape shows in the shade, too
  float lit = ambient + (1.0 - ambient) * 1.1 * wrapped * wrapped;
  result = vec4((isPainted ? painted : shade.rgb) * lit * (isReverse ? 0.6 : 1.0), 1.0);
}`;

const LINE_VERTEX = `#version 300 es
uniform mat4 view, clip;
uniform vec2 shift;
in vec3 point;
in vec4 color;
out vec4 shade;
void main() {
  shade = color;
  gl_Position = clip * view * vec4(point, 1.0);
  gl_Position.xy += shift * gl_Position.w;
}`;

const LINE_FRAGMENT = `#version 300 es
precision highp float;
in vec4 shade;
out vec4 result;
void main() { result = vec4(shade.rgb * shade.a, shade.a); }`;

const ANISOTROPY = 4;
const CLOUD_INPUTS = ["point", "normal", "color", "size", "uv"];

class Renderer {
  constructor(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: true });
    if (!gl) throw new Error("This browser cannot draw the model: it has no WebGL 2.");
    this.canvas = canvas;
    this.gl = gl;
    this.clouds = new Map(); // of each cloud its buffers
    this.cloudProgram = this.#program(CLOUD_VERTEX, CLOUD_FRAGMENT, CLOUD_INPUTS);
    this.lineProgram = this.#program(LINE_VERTEX, LINE_FRAGMENT, ["point", "color"]);
    this.lineBuffers = [gl.createBuffer(), gl.createBuffer()];
    this.noImage = this.#textureOf(new ImageData(1, 1));
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  /** The most pixels in a row of an image. */
  get maxImageSize() {
    return this.gl.getParameter(this.gl.MAX_TEXTURE_SIZE);
  }

  /** Fit the drawing to the page; true where that changed it. */
  resize() {
    const ratio = window.devicePixelRatio || 1;
    const width = Math.round(this.canvas.clientWidth * ratio), height = Math.round(this.canvas.clientHeight * ratio);
    const isNew = this.canvas.width !== width || this.canvas.height !== height;
    if (isNew) Object.assign(this.canvas, { width, height });
    return isNew;
  }

  clear() {
    const gl = this.gl;
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  }

  /** Give back the buffers of clouds that are not used any more. */
  keepOnly(clouds) {
    const kept = new Set(clouds);
    for (const [cloud, buffers] of this.clouds) {
      if (kept.has(cloud)) continue;
      Object.values(buffers).forEach((buffer) => buffer instanceof WebGLBuffer && this.gl.deleteBuffer(buffer));
      this.gl.deleteTexture(buffers.image ?? null);
      this.clouds.delete(cloud);
    }
  }

  /** Draw a cloud into a part of the canvas: from left to left + width, parts of 1. */
  drawCloud(cloud, { view, clip }, part, { asMesh, isPainted, showReverse, pointSize, ambient }) {
    const gl = this.gl, program = this.cloudProgram, buffers = this.#buffers(cloud);
    const height = this.#viewport(part);
    gl.useProgram(program.id);
    gl.uniformMatrix4fv(program.at("view"), false, view);
    gl.uniformMatrix4fv(program.at("clip"), false, clip);
    gl.uniform3fv(program.at("viewOrigin"), seen(view, cloud.origin)); // here, as float32 has too few digits
    gl.uniform1f(program.at("step"), cloud.step);
    gl.uniform1f(program.at("radius"), 0.75 * pointSize * (cloud.sizeUnit ?? cloud.spacing));
    gl.uniform1f(program.at("pixelsPerUnit"), 0.5 * height * clip[5]);
    gl.uniform1f(program.at("ambient"), ambient);
    gl.uniform1i(program.at("isMesh"), asMesh ? 1 : 0);
    gl.uniform1i(program.at("showReverse"), showReverse ? 1 : 0);
    gl.uniform1i(program.at("isPainted"), isPainted ? 1 : 0);
    gl.bindTexture(gl.TEXTURE_2D, buffers.image ?? this.noImage);
    this.#attribute(0, buffers.points, 3, cloud.points.BYTES_PER_ELEMENT === 4 ? gl.UNSIGNED_INT : gl.UNSIGNED_SHORT, false);
    this.#attribute(1, buffers.normals, 4, gl.BYTE, true);
    this.#attribute(2, buffers.paint, 4, gl.UNSIGNED_BYTE, true);
    this.#attribute(3, buffers.sizes, 1, gl.UNSIGNED_BYTE, false);
    gl.disableVertexAttribArray(4);
    if (isPainted) {
      gl.uniform2fv(program.at("uvOrigin"), cloud.uvOrigin);
      gl.uniform1f(program.at("uvStep"), cloud.uvStep);
      this.#attribute(4, buffers.uv, 2, gl.UNSIGNED_SHORT, false);
    }
    if (asMesh) {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers.triangles);
      gl.drawElements(gl.TRIANGLES, cloud.triangles.length, gl.UNSIGNED_INT, 0);
    } else gl.drawArrays(gl.POINTS, 0, cloud.size);
  }

  /**
   * Draw segments: positions, six numbers each, and a color with opacity, four bytes for each end. Lines of several
   * pixels are drawn several times, side by side: WebGL has but thin ones.
   */
  drawLines(positions, colors, { view, clip }, part, pixels = 1) {
    const gl = this.gl, program = this.lineProgram;
    if (!positions.length) return;
    const height = this.#viewport(part), width = part.width * this.canvas.width;
    gl.useProgram(program.id);
    gl.uniformMatrix4fv(program.at("view"), false, view);
    gl.uniformMatrix4fv(program.at("clip"), false, clip);
    [Float32Array.from(positions), Uint8Array.from(colors)].forEach((data, i) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.lineBuffers[i]);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    });
    this.#attribute(0, this.lineBuffers[0], 3, gl.FLOAT, false);
    this.#attribute(1, this.lineBuffers[1], 4, gl.UNSIGNED_BYTE, true);
    for (const place of [2, 3, 4]) gl.disableVertexAttribArray(place);
    for (let x = 0; x < pixels; x++) {
      for (let y = 0; y < pixels; y++) {
        gl.uniform2f(program.at("shift"), (2 * x - pixels + 1) / width, (2 * y - pixels + 1) / height);
        gl.drawArrays(gl.LINES, 0, positions.length / 3);
      }
    }
  }

  #viewport({ left, width }) {
    const { width: w, height } = this.canvas;
    this.gl.viewport(Math.round(left * w), 0, Math.round(width * w), height);
    return height;
  }

  #attribute(place, buffer, width, type, normalized) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, width, type, normalized, 0, 0);
  }

  #buffers(cloud) {
    const gl = this.gl;
    let buffers = this.clouds.get(cloud);
    if (!buffers) {
      buffers = { points: this.#filled(cloud.points), normals: this.#filled(cloud.normals), paint: gl.createBuffer() };
      buffers.sizes = this.#filled(cloud.sizes);
      buffers.sizesVersion = cloud.sizesVersion;
      buffers.moment = cloud.moment;
      if (cloud.image) Object.assign(buffers, { uv: this.#filled(cloud.uv), image: this.#textureOf(cloud.image) });
      this.clouds.set(cloud, buffers);
    }
    if (buffers.version !== cloud.version) {
      this.#fill(buffers.paint, cloud.paint);
      buffers.version = cloud.version;
    }
    if (buffers.sizesVersion !== cloud.sizesVersion) {
      this.#fill(buffers.sizes, cloud.sizes);
      buffers.sizesVersion = cloud.sizesVersion;
    }
    if (buffers.moment !== cloud.moment) {
      this.#fill(buffers.points, cloud.points);
      this.#fill(buffers.normals, cloud.normals);
      buffers.moment = cloud.moment;
    }
    if (cloud.triangles && !buffers.triangles) {
      buffers.triangles = this.#filled(cloud.triangles, gl.ELEMENT_ARRAY_BUFFER);
    }
    return buffers;
  }

  #fill(buffer, data) {
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, buffer);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, data, this.gl.DYNAMIC_DRAW);
  }

  #filled(data, target = this.gl.ARRAY_BUFFER) {
    const buffer = this.gl.createBuffer();
    this.gl.bindBuffer(target, buffer);
    this.gl.bufferData(target, data, this.gl.STATIC_DRAW);
    return buffer;
  }

  /** An image for a surface that is seen from near and far, at any slant; beyond its borders it begins again. */
  #textureOf(image) {
    const gl = this.gl, texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, image);
    gl.generateMipmap(gl.TEXTURE_2D);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    const slanted = gl.getExtension("EXT_texture_filter_anisotropic");
    if (slanted) gl.texParameterf(gl.TEXTURE_2D, slanted.TEXTURE_MAX_ANISOTROPY_EXT, ANISOTROPY);
    return texture;
  }

  #program(vertex, fragment, inputs) {
    const gl = this.gl, id = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(id, shader);
    }
    inputs.forEach((name, place) => gl.bindAttribLocation(id, place, name));
    gl.linkProgram(id);
    if (!gl.getProgramParameter(id, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(id));
    const places = {};
    return { id, at: (name) => (places[name] ??= gl.getUniformLocation(id, name)) };
  }
}
