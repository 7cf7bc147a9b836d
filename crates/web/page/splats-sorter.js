// In a Worker: reads splats, packs them for the graphics card, and sorts them by depth.

import { multiply, turn } from "./turns.js";

/** The constant spherical harmonic, 1 / (2 sqrt(pi)). */
const HARMONIC = 0.28209479177387814;
/** Bytes of a splat in a .splat file. */
const BYTES = 32;
const KEYS = 1 << 16;
const SIZES = { char: 1, uchar: 1, int8: 1, uint8: 1, short: 2, ushort: 2, int16: 2, uint16: 2 };
Object.assign(SIZES, { int: 4, uint: 4, float: 4, int32: 4, uint32: 4, float32: 4, double: 8, float64: 8 });

let places;

/** What a .ply file of little-endian binary holds: its count, and what reads one splat. */
function ply(buffer) {
  const text = new TextDecoder("latin1").decode(new Uint8Array(buffer, 0, Math.min(buffer.byteLength, 1 << 16)));
  const end = /end_header\r?\n/.exec(text);
  if (!end) throw new Error("it is no PLY file");
  const head = text.slice(text.indexOf("element vertex"), end.index);
  const count = Number(head.split(/\s+/)[2]);
  const at = {};
  let stride = 0;
  for (const line of head.split("\n").slice(1)) {
    const [word, type, name] = line.trim().split(/\s+/);
    if (word === "element") break;
    if (word !== "property") continue;
    at[name] ??= stride;
    stride += SIZES[type];
  }
  const view = new DataView(buffer, end.index + end[0].length);
  const read = (i, name) => view.getFloat32(stride * i + at[name], true);
  const all = (i, ...names) => names.map((name) => read(i, name));
  return {
    count,
    splat: (i) => {
      const [w, x, y, z] = all(i, "rot_0", "rot_1", "rot_2", "rot_3");
      return {
        place: all(i, "x", "y", "z"),
        sizes: all(i, "scale_0", "scale_1", "scale_2"),
        turned: [x, y, z, w],
        colour: all(i, "f_dc_0", "f_dc_1", "f_dc_2").map((v) => 0.5 + HARMONIC * v),
        alpha: 1 / (1 + Math.exp(-read(i, "opacity"))),
      };
    },
  };
}

/** The same of a .splat file: place and sizes as floats, then colour, opacity and a quaternion (w, x, y, z) as bytes. */
function splat(buffer) {
  const floats = new Float32Array(buffer);
  const bytes = new Uint8Array(buffer);
  return {
    count: buffer.byteLength / BYTES,
    splat: (i) => {
      const [r, g, b, alpha, w, x, y, z] = bytes.subarray(BYTES * i + 24, BYTES * (i + 1));
      return {
        place: floats.subarray(8 * i, 8 * i + 3),
        sizes: Array.from(floats.subarray(8 * i + 3, 8 * i + 6), Math.log),
        turned: [x, y, z, w].map((v) => (v - 128) / 128),
        colour: [r, g, b].map((v) => v / 255),
        alpha: alpha / 255,
      };
    },
  };
}

/** Two texels of four 32-bit words a splat: place, colour; logarithms of sizes by 16 and a quaternion as parts of 32767. */
function pack({ count, splat }, { origin, rotation, metres_per_unit }, width) {
  const packed = new Uint32Array(4 * width * Math.ceil((2 * count) / width));
  const floats = new Float32Array(packed.buffer);
  const halves = new Int16Array(packed.buffer);
  const byte = (share, shift) => Math.round(255 * Math.min(Math.max(share, 0), 1)) << shift;
  const half = (share) => Math.round(32767 * Math.min(Math.max(share, -1), 1));
  const metres = Math.log(metres_per_unit);
  places = new Float32Array(3 * count);
  for (let i = 0; i < count; i++) {
    const { place, sizes, turned, colour, alpha } = splat(i);
    const at = turn(
      rotation,
      origin.map((o, axis) => place[axis] - o),
    ).map((v) => v * metres_per_unit);
    places.set(at, 3 * i);
    floats.set(at, 8 * i);
    packed[8 * i + 3] = byte(colour[0], 0) | byte(colour[1], 8) | byte(colour[2], 16) | byte(alpha, 24);
    for (let axis = 0; axis < 3; axis++) halves[16 * i + 8 + axis] = half((sizes[axis] + metres) / 16);
    const quaternion = multiply(rotation, turned);
    const length = Math.hypot(...quaternion) || 1;
    for (let part = 0; part < 4; part++) halves[16 * i + 12 + part] = half(quaternion[part] / length);
  }
  return packed;
}

/** Numbers of all splats from far to near along a direction, by counting. */
function order([x, y, z]) {
  const count = places.length / 3;
  const depths = new Float32Array(count);
  let [least, most] = [Infinity, -Infinity];
  for (let i = 0; i < count; i++) {
    const depth = x * places[3 * i] + y * places[3 * i + 1] + z * places[3 * i + 2];
    depths[i] = depth;
    if (depth < least) least = depth;
    if (depth > most) most = depth;
  }
  const scale = (KEYS - 1) / Math.max(most - least, 1e-9);
  const key = (i) => Math.min(KEYS - 1, Math.max(0, Math.floor((most - depths[i]) * scale)));
  const starts = new Uint32Array(KEYS + 1);
  for (let i = 0; i < count; i++) starts[key(i) + 1]++;
  for (let k = 0; k < KEYS; k++) starts[k + 1] += starts[k];
  const numbers = new Uint32Array(count);
  for (let i = 0; i < count; i++) numbers[starts[key(i)]++] = i;
  return numbers;
}

async function open({ file, placement, width }) {
  const response = await fetch(file);
  if (!response.ok) throw new Error(`the server answers ${response.status}`);
  const buffer = await response.arrayBuffer();
  return pack(file.endsWith(".splat") ? splat(buffer) : ply(buffer), placement, width);
}

onmessage = async ({ data }) => {
  if (data.direction) {
    const numbers = order(data.direction);
    return postMessage({ order: numbers }, [numbers.buffer]);
  }
  try {
    const packed = await open(data);
    postMessage({ packed }, [packed.buffer]);
  } catch (error) {
    postMessage({ error: `${data.file.split("/").pop()} cannot be shown: ${error.message}` });
  }
};
