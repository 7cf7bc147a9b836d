// The head by the orientation of a telephone or tablet.

import { angles, multiply, ofAngles, radians } from "./turns.js";

/** From a device that is held upright to a head: forward out of its back, up along its long side. As x, y, z, w. */
const HEAD_IN_DEVICE = [-0.5, 0.5, 0.5, 0.5];

/** Whether this browser may have such a thing. */
export const isHere = () => "DeviceOrientationEvent" in window && matchMedia("(pointer: coarse)").matches;

/** The turn of a head that a device's angles make, degrees; `screen` is by how much its picture is turned. */
export function headOf(alpha, beta, gamma, screen = 0) {
  // Intrinsic z, x', y'' (W3C Device Orientation), then the screen's turn.
  const about = (axis, angle) => {
    const q = [0, 0, 0, Math.cos(angle / 2)];
    q[axis] = Math.sin(angle / 2);
    return q;
  };
  const device = [
    about(2, radians(alpha)),
    about(0, radians(beta)),
    about(1, radians(gamma)),
    about(2, radians(-screen)),
  ].reduce(multiply);
  return multiply(device, HEAD_IN_DEVICE);
}

export class Orientation {
  /** `turned` is called with a quaternion. */
  constructor(listener, turned) {
    this.listener = listener;
    this.turned = turned;
    this.on = false;
    this.hear = (event) => this.take(event);
  }

  /** Begins; throws where it is refused. The direction in which the device lies now is where the listener faces. */
  async start() {
    const ask = DeviceOrientationEvent.requestPermission;
    if (ask && (await ask.call(DeviceOrientationEvent)) !== "granted") throw new Error("this device did not allow it");
    this.offset = null;
    this.on = true;
    addEventListener("deviceorientation", this.hear);
  }

  stop() {
    this.on = false;
    removeEventListener("deviceorientation", this.hear);
    this.listener.head = null;
  }

  take({ alpha, beta, gamma }) {
    if (alpha === null) return;
    const head = headOf(alpha, beta, gamma, screen.orientation?.angle ?? 0);
    this.offset ??= this.listener.yaw - angles(head)[0];
    const turned = multiply(ofAngles(this.offset, 0, 0), head);
    this.listener.head = turned;
    this.listener.yaw = angles(turned)[0];
    this.turned();
  }
}
