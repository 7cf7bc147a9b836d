// A plan on which the listener walks and turns: by keys, buttons, mouse and touch.

import { text } from "./texts.js";
import { EASE_S, KEYS, TURN, WALK, keyOf } from "./walking.js";

const DRAG = 0.01;
/** A step and a turn of a button, metres and radians. */
const STEP = 0.5;
const BUTTONS = ["turn-left", "forward", "back", "left", "right", "turn-right"];

/** Yaw of a quaternion x, y, z, w, positive to the left. */
export const yawOf = ([x, y, z, w]) => Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));

export class Walker {
  /**
   * `place` is that of the item, the same for all of its scenes; `moved(position, quaternion)` is called as often as the
   * picture changes.
   */
  constructor(place, moved) {
    const [low, high] = place.bounds;
    this.bounds = [0, 1].map((axis) => [low[axis], high[axis]]);
    this.emitter = place.emitter;
    this.shown = [0, 1].map((axis) => {
      const around = [low, high, ...(place.emitter ? [place.emitter] : [])].map((p) => p[axis]);
      return [Math.min(...around) - 0.5, Math.max(...around) + 0.5];
    });
    this.position = [...place.start.position];
    this.yaw = yawOf(place.start.quaternion);
    this.velocity = [0, 0];
    this.held = new Set();
    this.moved = moved;
    this.build();
  }

  build() {
    this.element = document.createElement("div");
    this.element.className = "plan";
    this.canvas = document.createElement("canvas");
    Object.assign(this.canvas, { tabIndex: 0 });
    this.canvas.setAttribute("role", "application");
    this.canvas.setAttribute("aria-label", text("plan"));
    const pad = document.createElement("div");
    pad.className = "pad";
    pad.setAttribute("role", "group");
    pad.setAttribute("aria-label", text("walk and turn"));
    for (const name of BUTTONS) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = text(name === "back" ? "back step" : name);
      button.addEventListener("click", () => this.step(name));
      pad.append(button);
    }
    const help = document.createElement("p");
    help.className = "soft";
    help.textContent = text("walk help");
    this.element.append(this.canvas, pad, help);
    this.press = (event) => {
      const walks = keyOf(event);
      if (!walks) return;
      this.goal = null;
      this.held.add(walks);
      event.preventDefault();
    };
    this.release = (event) => this.held.delete(KEYS[event.code]);
    this.leave = () => this.held.clear();
    addEventListener("keydown", this.press);
    addEventListener("keyup", this.release);
    addEventListener("blur", this.leave);
    let drag = null;
    this.canvas.addEventListener("pointerdown", (event) => {
      drag = { x: event.clientX, far: 0 };
      this.canvas.setPointerCapture(event.pointerId);
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (!drag) return;
      const by = event.clientX - drag.x;
      drag.x = event.clientX;
      drag.far += Math.abs(by);
      if (drag.far > 5) this.yaw -= by * DRAG;
    });
    this.canvas.addEventListener("pointerup", (event) => {
      if (drag && drag.far <= 5) this.goal = this.within(this.place(event));
      drag = null;
    });
    let last = performance.now();
    const frame = (now) => {
      if (this.closed) return;
      this.advance(Math.min(0.1, (now - last) / 1000));
      last = now;
      this.draw();
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  close() {
    this.closed = true;
    removeEventListener("keydown", this.press);
    removeEventListener("keyup", this.release);
    removeEventListener("blur", this.leave);
  }

  step(name) {
    if (name === "turn-left" || name === "turn-right") this.yaw += name === "turn-left" ? 0.26 : -0.26;
    else this.goal = this.within(this.ahead(new Set([name])).map((v, i) => this.position[i] + STEP * v));
  }

  ahead(held) {
    const axis = (plus, less) => (held.has(plus) ? 1 : 0) - (held.has(less) ? 1 : 0);
    const [x, y] = [axis("forward", "back"), axis("left", "right")];
    const [sin, cos] = [Math.sin(this.yaw), Math.cos(this.yaw)];
    return [cos * x - sin * y, sin * x + cos * y];
  }

  within(place) {
    return place.map((v, i) => Math.max(this.bounds[i][0], Math.min(this.bounds[i][1], v)));
  }

  advance(seconds) {
    let wanted = this.ahead(this.held).map((v) => WALK * v);
    if (this.goal) {
      const way = this.goal.map((v, i) => v - this.position[i]);
      const far = Math.hypot(...way);
      if (far < 0.02) this.goal = null;
      else wanted = way.map((v) => (v * Math.min(WALK, 4 * far)) / far);
    }
    const ease = 1 - Math.exp(-seconds / EASE_S);
    this.velocity = this.velocity.map((v, i) => v + (wanted[i] - v) * ease);
    const [x, y] = this.within(this.velocity.map((v, i) => this.position[i] + v * seconds));
    this.position = [x, y, this.position[2]];
    this.yaw += ((this.held.has("turn-left") ? 1 : 0) - (this.held.has("turn-right") ? 1 : 0)) * TURN * seconds;
    this.canvas.dataset.place = [x, y].map((v) => v.toFixed(2)).join(" ");
    this.moved(this.position, this.quaternion);
  }

  get quaternion() {
    return [0, 0, Math.sin(this.yaw / 2), Math.cos(this.yaw / 2)];
  }

  /** Pixels of a metre, and where the middle of what is shown lies. */
  frame() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const [[x0, x1], [y0, y1]] = this.shown;
    // The world's x goes up, its y to the left, as the listener looks at first.
    const scale = Math.min(height / (x1 - x0), width / (y1 - y0));
    return { scale, middle: [(x0 + x1) / 2, (y0 + y1) / 2], width, height };
  }

  onCanvas([x, y]) {
    const { scale, middle, width, height } = this.frame();
    return [width / 2 - (y - middle[1]) * scale, height / 2 - (x - middle[0]) * scale];
  }

  place(event) {
    const { scale, middle, width, height } = this.frame();
    const box = this.canvas.getBoundingClientRect();
    return [
      middle[0] - (event.clientY - box.top - height / 2) / scale,
      middle[1] - (event.clientX - box.left - width / 2) / scale,
    ];
  }

  draw() {
    const { canvas } = this;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    const pen = canvas.getContext("2d");
    const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name);
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    const [[x0, x1], [y0, y1]] = this.bounds;
    const [a, b] = [this.onCanvas([x1, y1]), this.onCanvas([x0, y0])];
    pen.strokeStyle = colour("--line");
    pen.lineWidth = 1.5;
    pen.setLineDash([5, 4]);
    pen.strokeRect(a[0], a[1], b[0] - a[0], b[1] - a[1]);
    pen.setLineDash([]);
    pen.font = "13px system-ui, sans-serif";
    pen.textAlign = "center";
    if (this.emitter) {
      const [x, y] = this.onCanvas(this.emitter);
      pen.fillStyle = colour("--heard");
      pen.beginPath();
      pen.arc(x, y, 7, 0, 7);
      pen.fill();
      pen.fillText(text("the sound"), x, y + 22);
    }
    const [x, y] = this.onCanvas(this.position);
    pen.save();
    pen.translate(x, y);
    pen.rotate(-this.yaw);
    pen.fillStyle = colour("--accent");
    pen.beginPath();
    pen.arc(0, 0, 9, 0, 7);
    pen.moveTo(-7, -6);
    pen.lineTo(0, -19);
    pen.lineTo(7, -6);
    pen.fill();
    pen.restore();
    pen.fillStyle = colour("--ink");
    pen.fillText(text("you"), x, y + 26);
  }
}
