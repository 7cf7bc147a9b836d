// The listener: keys, mouse, touch and buttons become a position and a turn of the head.

import { add, angles, length, minus, ofAngles, times } from "./turns.js";
import { EASE_S, KEYS as ON_THE_FLOOR, TURN, WALK, keyOf } from "./walking.js";

/** By how much Shift is faster. */
const FASTER = 2.5;
/** Radians per pixel of a drag. */
const DRAG = 0.006;
/** How far beyond its bounds a place may be left, metres. */
const BEYOND = 1;
const FREE = 6;

const KEYS = {
  ...ON_THE_FLOOR,
  KeyR: "up",
  KeyF: "down",
  PageUp: "look-up",
  PageDown: "look-down",
};

export class Listener extends EventTarget {
  constructor(stage, canvas, pad) {
    super();
    this.stage = stage;
    this.held = new Set();
    this.velocity = [0, 0, 0];
    this.position = [0, 0, 0];
    [this.yaw, this.pitch, this.roll] = [0, 0, 0];
    /** A head that is turned by something else, or null. */
    this.head = null;
    this.goal = null;
    this.bounds = null;
    this.listen(canvas, pad);
  }

  /** Goes to where a place starts, and stays within it. */
  enter(description) {
    const [low, high] = description.bounds;
    const wide = length(minus(high, low)) > 0.1 ? BEYOND : FREE;
    const hull = [low, high, ...(description.emitter ? [description.emitter] : [])];
    this.bounds = [0, 1, 2].map((axis) => [
      Math.min(...hull.map((p) => p[axis])) - wide,
      Math.max(...hull.map((p) => p[axis])) + wide,
    ]);
    this.start = description.start;
    this.goHome();
  }

  goHome() {
    this.set(this.start.position, this.start.quaternion);
    this.dispatchEvent(new Event("jump"));
  }

  /** Is at a pose, as after a path. */
  set(position, quaternion) {
    this.position = [...position];
    [this.yaw, this.pitch, this.roll] = angles(quaternion);
    this.velocity = [0, 0, 0];
    this.goal = null;
  }

  get pose() {
    return { position: this.position, quaternion: this.head ?? ofAngles(this.yaw, this.pitch, this.roll) };
  }

  /** The direction in which "forward" lies, radians. */
  get heading() {
    return this.head ? angles(this.head)[0] : this.yaw;
  }

  listen(canvas, pad) {
    const move = (name, on) => {
      if (on) this.held.add(name);
      else this.held.delete(name);
      if (on) this.touched();
    };
    // Walking and turning wherever the focus is, the rest where the place has it.
    addEventListener("keydown", (event) => {
      const here = event.target === canvas && !(event.ctrlKey || event.metaKey || event.altKey);
      const name = keyOf(event) ?? (here ? KEYS[event.code] : undefined);
      this.fast = event.shiftKey;
      if (name) move(name, true);
      else if (here && event.code === "Home") this.goHome();
      else return;
      event.preventDefault();
    });
    addEventListener("keyup", (event) => {
      this.fast = event.shiftKey;
      move(KEYS[event.code], false);
    });
    for (const leave of ["blur", "visibilitychange"]) addEventListener(leave, () => this.held.clear());
    canvas.addEventListener("blur", () => this.held.clear());

    for (const button of pad.querySelectorAll("[data-move]")) {
      const name = button.dataset.move;
      button.addEventListener("pointerdown", (event) => {
        button.setPointerCapture(event.pointerId);
        move(name, true);
      });
      for (const end of ["pointerup", "pointercancel", "lostpointercapture"])
        button.addEventListener(end, () => move(name, false));
      button.addEventListener("keydown", (event) => {
        if (event.code === "Space" || event.code === "Enter") move(name, true);
      });
      button.addEventListener("keyup", () => move(name, false));
      button.addEventListener("blur", () => move(name, false));
      // A screen reader presses without holding: one step.
      button.addEventListener("click", (event) => {
        if (event.detail === 0 && event.pointerType === "") this.step(name);
      });
    }

    let drag = null;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.focus({ preventScroll: true });
      canvas.setPointerCapture(event.pointerId);
      drag = { x: event.clientX, y: event.clientY, far: 0, sound: this.stage.soundAt(event.clientX, event.clientY, this.pose) };
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!drag) return;
      const [dx, dy] = [event.clientX - drag.x, event.clientY - drag.y];
      [drag.x, drag.y] = [event.clientX, event.clientY];
      drag.far += Math.abs(dx) + Math.abs(dy);
      if (drag.far < 5) return;
      if (drag.sound) {
        const to = this.stage.ground(event.clientX, event.clientY, { position: drag.sound.position });
        if (to) this.dispatchEvent(new CustomEvent("drag", { detail: { sound: drag.sound, to } }));
        return;
      }
      this.yaw -= dx * DRAG;
      if (this.stage.eyes) this.look(-dy * DRAG);
      this.touched();
    });
    canvas.addEventListener("pointerup", (event) => {
      if (drag && drag.far < 5) this.goal = this.stage.ground(event.clientX, event.clientY, this.pose);
      if (drag && this.goal) this.touched();
      drag = null;
    });
    canvas.addEventListener("pointercancel", () => (drag = null));
    canvas.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        this.stage.zoom = Math.max(0.3, Math.min(6, this.stage.zoom * Math.exp(-event.deltaY * 0.001)));
      },
      { passive: false },
    );
  }

  touched() {
    this.dispatchEvent(new Event("touched"));
  }

  look(by) {
    this.pitch = Math.max(-1.4, Math.min(1.4, this.pitch + by));
  }

  /** One step or a small turn, for who cannot hold a button. */
  step(name) {
    this.touched();
    if (name === "turn-left" || name === "turn-right") this.yaw += name === "turn-left" ? 0.26 : -0.26;
    else this.goal = this.within(add(this.position, times(this.ahead(new Set([name])), 0.5)));
  }

  /** Direction of the keys that are held, in the world. */
  ahead(held) {
    const axis = (plus, less) => (held.has(plus) ? 1 : 0) - (held.has(less) ? 1 : 0);
    const [x, y] = [axis("forward", "back"), axis("left", "right")];
    const [sin, cos] = [Math.sin(this.heading), Math.cos(this.heading)];
    return [cos * x - sin * y, sin * x + cos * y, axis("up", "down")];
  }

  within(position) {
    return this.bounds ? position.map((v, i) => Math.max(this.bounds[i][0], Math.min(this.bounds[i][1], v))) : position;
  }

  /** Moves on by some seconds. */
  advance(seconds) {
    const speed = WALK * (this.fast ? FASTER : 1);
    let wanted = times(this.ahead(this.held), speed);
    if (length(wanted) > 0) this.goal = null;
    if (this.goal) {
      const way = minus(this.goal, this.position);
      const far = length(way);
      if (far < 0.02) this.goal = null;
      else wanted = times(way, Math.min(speed, 4 * far) / far);
    }
    const ease = 1 - Math.exp(-seconds / EASE_S);
    this.velocity = add(this.velocity, times(minus(wanted, this.velocity), ease));
    if (length(this.velocity) < 1e-3 && length(wanted) === 0) this.velocity = [0, 0, 0];
    this.position = this.within(add(this.position, times(this.velocity, seconds)));
    const turning = (this.held.has("turn-left") ? 1 : 0) - (this.held.has("turn-right") ? 1 : 0);
    this.yaw += turning * TURN * seconds * (this.fast ? FASTER : 1);
    this.look(((this.held.has("look-up") ? 1 : 0) - (this.held.has("look-down") ? 1 : 0)) * TURN * seconds);
  }
}
