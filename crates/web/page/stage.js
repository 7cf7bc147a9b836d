// Draws the place: photographs as splats, floor, outline, anchors, image sources, path, sounds and the listener, in WebGL.

import { program } from "./shader.js";
import { add, cross, length, minus, normal, perspective, product, project, times, turn, view } from "./turns.js";

const VERTEX = `
attribute vec3 place;
attribute vec4 colour;
attribute float size;
uniform mat4 camera;
uniform float scale;
varying vec4 shade;
void main() {
  gl_Position = camera * vec4(place, 1.0);
  gl_PointSize = clamp(size * scale / max(gl_Position.w, 0.1), 2.0, 64.0);
  shade = colour;
}`;
const FRAGMENT = `
precision mediump float;
varying vec4 shade;
uniform float round;
void main() {
  float edge = 1.0;
  if (round > 0.5) {
    float r = length(gl_PointCoord - 0.5);
    if (r > 0.5) discard;
    edge = smoothstep(0.5, 0.4, r);
  }
  gl_FragColor = vec4(shade.rgb, shade.a * edge);
}`;
/** How steeply the plan is seen from above, and its angle of view, radians. */
const STEEP = 1.05;
const ANGLE = 0.7;
const FLOATS = 8;
/** How near to a sound a drag takes it, pixels. */
const GRASP = 22;
/** Splats higher than this above the listener are left out of the plan, metres: ceilings would hide all else. */
const ABOVE = 0.2;

/** Colours of the page, as numbers. */
function palette() {
  const style = getComputedStyle(document.documentElement);
  const of = (name, alpha = 1) => {
    const hex = style.getPropertyValue(name).trim().slice(1);
    return [0, 2, 4].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255).concat(alpha);
  };
  return {
    stage: of("--stage"),
    ink: of("--ink"),
    soft: of("--soft", 0.55),
    line: of("--line"),
    accent: of("--accent"),
    sound: of("--level"),
    path: of("--warn", 0.9),
  };
}

export class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    this.eyes = false;
    this.zoom = 1;
    this.place = null;
    this.sounds = [];
    this.path = [];
    this.labels = [];
    /** What draws photographs, if there are any. */
    this.splats = null;
    this.lost = false;
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.lost = true;
    });
    canvas.addEventListener("webglcontextrestored", () => this.begin());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => (this.colours = palette()));
    this.colours = palette();
    this.begin();
  }

  begin() {
    const options = { antialias: true, alpha: false, xrCompatible: false };
    const gl = (this.gl = this.canvas.getContext("webgl2", options) ?? this.canvas.getContext("webgl", options));
    this.program = gl && program(gl, VERTEX, FRAGMENT);
    this.lost = !this.program;
    if (this.lost) return;
    gl.useProgram(this.program);
    this.uniforms = Object.fromEntries(
      ["camera", "scale", "round"].map((name) => [name, gl.getUniformLocation(this.program, name)]),
    );
    [
      ["place", 3, 0],
      ["colour", 4, 3],
      ["size", 1, 7],
    ].forEach(([name, count, from]) => {
      const at = gl.getAttribLocation(this.program, name);
      gl.enableVertexAttribArray(at);
      (this.attributes ??= {})[name] = [at, count, 4 * from];
    });
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    this.still = gl.createBuffer();
    this.moving = gl.createBuffer();
    this.dirty = true;
    this.splats?.begin(gl);
  }

  /** Takes what stands still: a scene's description and points, edges of an outline, a path's rows. */
  show(place, { outline = [], path = [] } = {}) {
    this.place = place;
    this.outline = outline;
    this.path = path;
    this.dirty = true;
    const points = [...place.description.bounds];
    for (let i = 0; i < place.anchors.length; i += 6) points.push(place.anchors.slice(i, i + 3));
    for (const edge of outline) points.push(edge.slice(0, 3), edge.slice(3, 6));
    points.push(place.description.start.position, place.description.emitter ?? place.description.start.position);
    for (const row of path) points.push(row.slice(1, 4));
    const least = (axis) => Math.min(...points.map((p) => p[axis]));
    const most = (axis) => Math.max(...points.map((p) => p[axis]));
    const low = [0, 1, 2].map(least);
    const high = [0, 1, 2].map(most);
    this.floor = Math.min(
      low[2],
      place.description.start.position[2] - (outline.length + place.anchors.length > 12 ? 0 : 1.6),
    );
    this.middle = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (this.floor + high[2]) / 2];
    this.half = [0, 1].map((axis) => Math.max(1.5, high[axis] - low[axis]) / 2 + 0.4).concat((high[2] - this.floor) / 2);
    this.reach = Math.max(this.half[0], this.half[1]);
  }

  /** The camera of the page's view. */
  camera(pose) {
    const aspect = this.canvas.width / Math.max(this.canvas.height, 1);
    if (this.eyes) {
      const angle = aspect > 1 ? 1.25 : 1.6;
      return product(
        perspective(angle, aspect),
        view(pose.position, turn(pose.quaternion, [1, 0, 0]), turn(pose.quaternion, [0, 0, 1])),
      );
    }
    const { eye, forward, up } = this.above(aspect);
    return product(perspective(ANGLE, aspect), view(eye, forward, up));
  }

  above(aspect) {
    const forward = [0, Math.cos(STEEP), -Math.sin(STEEP)];
    const up = [0, Math.sin(STEEP), Math.cos(STEEP)];
    const tall = Math.tan(ANGLE / 2);
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    // As far away as every corner of the place needs to be seen.
    let distance = 0;
    for (let corner = 0; corner < 8; corner++) {
      const at = this.half.map((half, axis) => (corner & (1 << axis) ? half : -half));
      const needed = Math.max(Math.abs(at[0]) / (tall * aspect), Math.abs(dot(at, up)) / tall) * 1.05 - dot(at, forward);
      distance = Math.max(distance, needed);
    }
    return { eye: add(this.middle, times(forward, -distance / this.zoom)), forward, up };
  }

  /** Where on the floor a point of the canvas lies, in pixels of the page; null for the sky. */
  ground(x, y, pose) {
    if (!this.place || this.eyes) return null;
    const box = this.canvas.getBoundingClientRect();
    const aspect = box.width / Math.max(box.height, 1);
    const { eye, forward, up } = this.above(aspect);
    const tall = Math.tan(ANGLE / 2);
    const right = normal(cross(forward, up));
    const px = ((x - box.left) / box.width) * 2 - 1;
    const py = 1 - ((y - box.top) / box.height) * 2;
    const ray = add(forward, add(times(right, px * tall * aspect), times(up, py * tall)));
    const height = pose.position[2];
    if (ray[2] > -1e-3) return null;
    const at = add(eye, times(ray, (height - eye[2]) / ray[2]));
    return [at[0], at[1], height];
  }

  /** The sound that can be dragged at a point of the page, in pixels. */
  soundAt(x, y, pose) {
    if (!this.place || this.eyes) return null;
    const box = this.canvas.getBoundingClientRect();
    const camera = this.camera(pose);
    const far = ({ position }) => {
      const at = project(camera, position);
      if (!at) return Infinity;
      return Math.hypot(box.left + ((at[0] + 1) / 2) * box.width - x, box.top + ((1 - at[1]) / 2) * box.height - y);
    };
    const near = this.sounds.filter((sound) => sound.voice && far(sound) < GRASP).sort((a, b) => far(a) - far(b));
    return near[0] ?? null;
  }

  resize() {
    const { canvas } = this;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const [w, h] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
  }

  /** Draws what is there; `pose` is the listener's. */
  draw(pose) {
    if (this.lost || !this.place) return;
    this.resize();
    const { gl } = this;
    const camera = this.camera(pose);
    // What stands still is drawn four times a second only, but for splats, which are sorted meanwhile.
    const seen = JSON.stringify([pose, [...camera], this.canvas.width, this.canvas.height, this.eyes]);
    const still = !this.splats && seen === this.seen && !this.dirty && this.drawn === this.colours;
    this.unchanged = still ? (this.unchanged + 1) % 15 : 0;
    this.seen = seen;
    if (this.unchanged) return;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    this.clear();
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    this.drawWith(camera, this.canvas.height, pose, !this.eyes);
    this.label(camera);
  }

  clear() {
    this.gl.clearColor(...this.colours.stage);
    this.gl.clear(this.gl.COLOR_BUFFER_BIT | this.gl.DEPTH_BUFFER_BIT);
  }

  /** Draws through some camera into the viewport that is set. */
  drawWith(camera, height, pose, listener) {
    const { gl } = this;
    if (this.dirty || this.drawn !== this.colours) {
      this.stillParts = this.upload(this.still, this.stillShapes());
      this.dirty = false;
      this.drawn = this.colours;
    }
    if (this.splats) {
      this.splats.draw(camera, listener ? pose.position[2] + ABOVE : 1e9);
      gl.useProgram(this.program);
    }
    gl.uniformMatrix4fv(this.uniforms.camera, false, camera);
    gl.uniform1f(this.uniforms.scale, height * (this.eyes ? 0.8 : 1.4));
    this.paint(this.still, this.stillParts);
    this.paint(this.moving, this.upload(this.moving, this.movingShapes(pose, listener)));
  }

  upload(buffer, shapes) {
    const { gl } = this;
    const parts = [];
    const all = [];
    for (const [kind, vertices] of shapes) {
      if (vertices.length === 0) continue;
      parts.push([kind, all.length / FLOATS, vertices.length]);
      for (const vertex of vertices) all.push(...vertex);
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(all), buffer === this.still ? gl.STATIC_DRAW : gl.DYNAMIC_DRAW);
    return parts;
  }

  paint(buffer, parts) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    for (const [at, count, from] of Object.values(this.attributes))
      gl.vertexAttribPointer(at, count, gl.FLOAT, false, 4 * FLOATS, from);
    for (const [kind, first, count] of parts) {
      gl.uniform1f(this.uniforms.round, kind === "points" ? 1 : 0);
      gl.drawArrays({ points: gl.POINTS, lines: gl.LINES, triangles: gl.TRIANGLES }[kind], first, count);
    }
  }

  stillShapes() {
    const { colours, place, floor } = this;
    const { bounds } = place.description;
    const lines = [];
    const line = (a, b, colour) => lines.push([...a, ...colour, 0], [...b, ...colour, 0]);
    const step = [1, 2, 5, 10, 20, 50].find((s) => this.reach < 12 * s) ?? 100;
    const around = step * Math.ceil((this.reach * 1.6) / step);
    const [cx, cy] = this.middle.map(Math.round);
    const faint = [...colours.line.slice(0, 3), 0.7];
    for (let i = -around; i <= around; i += step) {
      line([cx + i, cy - around, floor], [cx + i, cy + around, floor], faint);
      line([cx - around, cy + i, floor], [cx + around, cy + i, floor], faint);
    }
    for (const edge of this.outline) line(edge.slice(0, 3), edge.slice(3, 6), colours.soft);
    if (this.outline.length === 0 && length(minus(bounds[1], bounds[0])) > 0.1) {
      const [a, b] = bounds;
      const corner = (x, y) => [x ? b[0] : a[0], y ? b[1] : a[1], floor];
      [
        [0, 0, 1, 0],
        [1, 0, 1, 1],
        [1, 1, 0, 1],
        [0, 1, 0, 0],
      ].forEach(([x, y, u, v]) => line(corner(x, y), corner(u, v), colours.soft));
    }
    const way = spline(this.path);
    for (let i = 1; i < way.length; i++) line(way[i - 1], way[i], colours.path);
    const points = [];
    for (let i = 0; i < place.anchors.length; i += 6) {
      points.push([...place.anchors.slice(i, i + 3), ...place.anchors.slice(i + 3, i + 6), 0.9, 0.05]);
    }
    for (let i = 0; i < place.images.length; i += 4) {
      points.push([...place.images.slice(i, i + 3), ...colours.sound.slice(0, 3), 0.12 + 0.25 * place.images[i + 3], 0.08]);
    }
    return [
      ["lines", lines],
      ["points", points],
    ];
  }

  movingShapes({ position, quaternion }, listener) {
    const { colours, floor } = this;
    const points = this.sounds.map((s) => [...s.position, ...colours.sound, Math.max(0.32, 0.05 * this.reach)]);
    const lines = this.sounds.flatMap((s) => [
      [...s.position, ...colours.soft, 0],
      [s.position[0], s.position[1], floor, ...colours.soft, 0],
    ]);
    const triangles = [];
    if (listener) {
      const size = Math.max(0.28, 0.06 * this.reach);
      const at = (v) => [...add(position, turn(quaternion, times(v, size))), ...colours.accent, 0];
      triangles.push(at([2.1, 0, 0]), at([0.55, 0.75, 0]), at([0.55, -0.75, 0]));
      for (let i = 0; i < 24; i++) {
        const rim = (k) => at([Math.cos((k * Math.PI) / 12), Math.sin((k * Math.PI) / 12), 0]);
        triangles.push(at([0, 0, 0]), rim(i), rim(i + 1));
      }
      lines.push([...position, ...colours.accent, 0], [position[0], position[1], floor, ...colours.accent, 0]);
    }
    return [
      ["lines", lines],
      ["points", points],
      ["triangles", triangles],
    ];
  }

  /** Puts the names of sounds where they are drawn. */
  label(camera) {
    const box = this.canvas.parentElement;
    while (this.labels.length < this.sounds.length) {
      const made = document.createElement("span");
      made.className = "label";
      made.setAttribute("aria-hidden", "true");
      this.labels.push(box.insertBefore(made, this.canvas.nextSibling));
    }
    this.labels.forEach((label, i) => {
      const sound = this.sounds[i];
      const at = sound && project(camera, sound.position);
      label.hidden = !at || Math.abs(at[0]) > 1 || Math.abs(at[1]) > 1;
      if (label.hidden) return;
      label.textContent = sound.name;
      const { clientWidth, clientHeight } = this.canvas;
      label.style.translate = `${((at[0] + 1) / 2) * clientWidth}px ${((1 - at[1]) / 2) * clientHeight}px`;
    });
  }
}

/** Pieces of a path between two of its keyframes. */
const PIECES = 12;

/** Points of the spline that a path is walked on (Catmull and Rom 1974, for unequal times, as the engine has it). */
function spline(rows) {
  const points = rows.slice(0, 1).map((row) => row.slice(1, 4));
  for (let i = 1; i < rows.length; i++) {
    const [before, a, b, after] = [rows[Math.max(i - 2, 0)], rows[i - 1], rows[i], rows[Math.min(i + 1, rows.length - 1)]];
    const span = b[0] - a[0];
    const slope = (from, to, axis) => ((to[axis] - from[axis]) * span) / (to[0] - from[0]);
    for (let piece = 1; piece <= PIECES; piece++) {
      const u = piece / PIECES;
      const [u2, u3] = [u * u, u * u * u];
      const at = (axis) =>
        a[axis] * (2 * u3 - 3 * u2 + 1) +
        slope(before, b, axis) * (u3 - 2 * u2 + u) +
        b[axis] * (3 * u2 - 2 * u3) +
        slope(a, after, axis) * (u3 - u2);
      points.push([at(1), at(2), at(3)]);
    }
  }
  return points;
}
