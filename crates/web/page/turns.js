// Vectors, quaternions (x, y, z, w) and 4 x 4 matrices (columns first), as few as the page needs.
//
// World and head axes: x forward, y left, z up. A quaternion turns head axes into the world's.

export const degrees = (radians) => (radians * 180) / Math.PI;
export const radians = (degree) => (degree * Math.PI) / 180;

/** Of yaw (positive to the left), pitch (positive nose up) and roll (positive right ear down), radians. */
export function ofAngles(yaw, pitch, roll) {
  const about = (axis, angle) => {
    const q = [0, 0, 0, Math.cos(angle / 2)];
    q[axis] = Math.sin(angle / 2);
    return q;
  };
  return multiply(multiply(about(2, yaw), about(1, -pitch)), about(0, roll));
}

/** Yaw, pitch and roll of a quaternion, radians. */
export function angles(q) {
  const [x, y, z, w] = q;
  const yaw = Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
  const pitch = -Math.asin(Math.max(-1, Math.min(1, 2 * (w * y - z * x))));
  const roll = Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y));
  return [yaw, pitch, roll];
}

/** First `b`, then `a`. */
export function multiply([ax, ay, az, aw], [bx, by, bz, bw]) {
  return [
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
    aw * bw - ax * bx - ay * by - az * bz,
  ];
}

/** A vector turned by a quaternion. */
export function turn(q, [x, y, z]) {
  const [rx, ry, rz] = multiply(multiply(q, [x, y, z, 0]), [-q[0], -q[1], -q[2], q[3]]);
  return [rx, ry, rz];
}

export const add = (a, b) => a.map((v, i) => v + b[i]);
export const minus = (a, b) => a.map((v, i) => v - b[i]);
export const times = (a, s) => a.map((v) => v * s);
export const length = (a) => Math.hypot(...a);
export const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
export const normal = (a) => times(a, 1 / Math.max(length(a), 1e-9));

/** What a camera at a place, looking forward with up, makes of the world. */
export function view(eye, forward, up) {
  const f = normal(forward);
  const s = normal(cross(f, up));
  const u = cross(s, f);
  const dot = (a) => -(a[0] * eye[0] + a[1] * eye[1] + a[2] * eye[2]);
  return [s[0], u[0], -f[0], 0, s[1], u[1], -f[1], 0, s[2], u[2], -f[2], 0, dot(s), dot(u), -dot(f), 1];
}

/** Perspective with a vertical angle, radians. */
export function perspective(angle, aspect, near = 0.05, far = 500) {
  const f = 1 / Math.tan(angle / 2);
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0];
}

/** First `b`, then `a`. */
export function product(a, b) {
  const out = new Array(16).fill(0);
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      for (let k = 0; k < 4; k++) out[4 * column + row] += a[4 * k + row] * b[4 * column + k];
    }
  }
  return out;
}

/** A point in clip coordinates, divided: x and y in -1 to 1 are seen; null behind the camera. */
export function project(matrix, [x, y, z]) {
  const row = (i) => matrix[i] * x + matrix[4 + i] * y + matrix[8 + i] * z + matrix[12 + i];
  const w = row(3);
  return w > 1e-6 ? [row(0) / w, row(1) / w] : null;
}
