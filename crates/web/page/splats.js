// Photographs of the place as 3D Gaussian splats, in WebGL 2. Loaded by pages that have some.
//
// A splat is an ellipsoid of density. Its covariance is projected to the picture by the local affine approximation of the
// camera (Zwicker, Pfister, van Baar and Gross 2001, EWA Volume Splatting), and splats are laid over each other from far
// to near (Kerbl, Kopanas, Leimkühler and Drettakis 2023, 3D Gaussian Splatting), here without harmonics of the colour.

import { program } from "./shader.js";

/** Texels in a row of the texture, two of them a splat. */
const WIDTH = 4096;
/** The view may turn by so much, as a cosine, until splats are sorted again. */
const SAME_VIEW = 0.9999;

const VERTEX = `#version 300 es
precision highp float;
precision highp usampler2D;
layout(location = 0) in uint number;
uniform usampler2D splats;
uniform mat4 camera;
uniform vec2 viewport;
uniform float ceiling;
out vec2 at;
out vec4 shade;
uvec4 texel(int index) { return texelFetch(splats, ivec2(index % ${WIDTH}, index / ${WIDTH}), 0); }
void main() {
  gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
  uvec4 first = texel(2 * int(number));
  uvec4 second = texel(2 * int(number) + 1);
  vec3 place = uintBitsToFloat(first.xyz);
  vec4 clip = camera * vec4(place, 1.0);
  if (clip.w < 0.2 || place.z > ceiling) return;

  vec3 size = exp(16.0 * vec3(unpackSnorm2x16(second.x), unpackSnorm2x16(second.y).x));
  vec4 q = normalize(vec4(unpackSnorm2x16(second.z), unpackSnorm2x16(second.w)));
  mat3 axes = mat3(
    1.0 - 2.0 * (q.y * q.y + q.z * q.z), 2.0 * (q.x * q.y + q.w * q.z), 2.0 * (q.x * q.z - q.w * q.y),
    2.0 * (q.x * q.y - q.w * q.z), 1.0 - 2.0 * (q.x * q.x + q.z * q.z), 2.0 * (q.y * q.z + q.w * q.x),
    2.0 * (q.x * q.z + q.w * q.y), 2.0 * (q.y * q.z - q.w * q.x), 1.0 - 2.0 * (q.x * q.x + q.y * q.y));

  // Derivatives of the place in the picture, pixels by metres; beside the picture they would grow without end.
  vec2 seen = clip.xy / clip.w;
  vec2 bounded = clamp(seen, -1.3, 1.3);
  mat4 rows = transpose(camera);
  vec3 across = (rows[0].xyz - bounded.x * rows[3].xyz) * (0.5 * viewport.x / clip.w);
  vec3 along = (rows[1].xyz - bounded.y * rows[3].xyz) * (0.5 * viewport.y / clip.w);
  vec3 u = (across * axes) * size;
  vec3 v = (along * axes) * size;

  // The covariance in pixels, widened by a filter of the pixel's size, and its principal axes.
  float a = dot(u, u) + 0.3;
  float b = dot(u, v);
  float c = dot(v, v) + 0.3;
  float middle = 0.5 * (a + c);
  float apart = length(vec2(0.5 * (a - c), b));
  vec2 way = abs(b) > 1e-5 ? normalize(vec2(b, middle + apart - a)) : a >= c ? vec2(1.0, 0.0) : vec2(0.0, 1.0);
  vec2 longer = min(sqrt(middle + apart), 1024.0) * way;
  vec2 shorter = min(sqrt(max(middle - apart, 0.1)), 1024.0) * vec2(way.y, -way.x);
  at = 3.0 * (2.0 * vec2(gl_VertexID & 1, gl_VertexID >> 1) - 1.0);
  gl_Position = vec4(seen + (at.x * longer + at.y * shorter) * 2.0 / viewport, 0.0, 1.0);
  shade = vec4(first.w & 255u, (first.w >> 8) & 255u, (first.w >> 16) & 255u, first.w >> 24) / 255.0;
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec2 at;
in vec4 shade;
out vec4 colour;
void main() {
  float distance = dot(at, at);
  float alpha = shade.a * exp(-0.5 * distance);
  if (distance > 9.0 || alpha < 1.0 / 255.0) discard;
  colour = vec4(shade.rgb, alpha);
}`;

export class Splats {
  /** Reads splats as the site names them. Throws in words where they cannot be read or drawn. */
  static async load(gl, { file, placement }) {
    if (!(globalThis.WebGL2RenderingContext && gl instanceof WebGL2RenderingContext))
      throw new Error("This browser does not draw the photographs of the place (WebGL 2 is off); all else goes on");
    const worker = new Worker(new URL("splats-sorter.js", import.meta.url), { type: "module" });
    try {
      const packed = await new Promise((resolve, reject) => {
        worker.onmessage = ({ data }) => (data.error ? reject(new Error(data.error)) : resolve(data.packed));
        worker.onerror = (event) => reject(new Error(`${file} cannot be shown: ${event.message ?? "no Worker"}`));
        worker.postMessage({ file: new URL(file, document.baseURI).href, placement, width: WIDTH });
      });
      return new Splats(gl, worker, packed);
    } catch (error) {
      worker.terminate();
      throw error;
    }
  }

  constructor(gl, worker, packed) {
    Object.assign(this, { worker, packed, order: null, sorting: false, direction: null });
    worker.onmessage = ({ data }) => {
      this.sorting = false;
      this.order = data.order;
      this.fresh = true;
    };
    this.begin(gl);
  }

  /** Makes everything in a context that is new. */
  begin(gl) {
    this.gl = gl;
    this.program = program(gl, VERTEX, FRAGMENT);
    if (!this.program)
      throw new Error("This browser does not draw the photographs of the place: its graphics refuse the shader");
    this.uniforms = Object.fromEntries(
      ["camera", "viewport", "ceiling"].map((name) => [name, gl.getUniformLocation(this.program, name)]),
    );
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    const height = this.packed.length / (4 * WIDTH);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32UI, WIDTH, height, 0, gl.RGBA_INTEGER, gl.UNSIGNED_INT, this.packed);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
    this.numbers = gl.createBuffer();
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.numbers);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribIPointer(0, 1, gl.UNSIGNED_INT, 0, 0);
    gl.vertexAttribDivisor(0, 1);
    gl.bindVertexArray(null);
    this.fresh = true;
  }

  /** Draws into the viewport that is set what is lower than `ceiling`, metres. The program and the array are others after. */
  draw(camera, ceiling) {
    const { gl } = this;
    this.sort([camera[3], camera[7], camera[11]]);
    if (!this.order) return;
    gl.useProgram(this.program);
    gl.bindVertexArray(this.array);
    if (this.fresh) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.numbers);
      gl.bufferData(gl.ARRAY_BUFFER, this.order, gl.DYNAMIC_DRAW);
      this.fresh = false;
    }
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    const [, , width, height] = gl.getParameter(gl.VIEWPORT);
    gl.uniformMatrix4fv(this.uniforms.camera, false, camera);
    gl.uniform2f(this.uniforms.viewport, width, height);
    gl.uniform1f(this.uniforms.ceiling, ceiling);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, this.order.length);
    gl.bindVertexArray(null);
  }

  /** Asks for an order along a direction, if it is another; steps alone change none. */
  sort(direction) {
    const length = Math.hypot(...direction);
    const unit = direction.map((v) => v / length);
    const same = this.direction?.reduce((sum, v, i) => sum + v * unit[i], 0) > SAME_VIEW;
    if (this.sorting || same) return;
    this.sorting = true;
    this.direction = unit;
    this.worker.postMessage({ direction: unit });
  }

  close() {
    const { gl } = this;
    this.worker.terminate();
    gl.deleteTexture(this.texture);
    gl.deleteBuffer(this.numbers);
    gl.deleteVertexArray(this.array);
    gl.deleteProgram(this.program);
  }
}
