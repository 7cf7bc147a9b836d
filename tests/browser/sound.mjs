// WAV files and measures of signals.

import { readFileSync, writeFileSync } from "node:fs";

/** Writes channels of samples as 32-bit floats. */
export function writeWav(file, rate, channels) {
  const frames = channels[0].length;
  const data = Buffer.alloc(44 + 4 * frames * channels.length);
  data.write("RIFF", 0);
  data.writeUInt32LE(data.length - 8, 4);
  data.write("WAVEfmt ", 8);
  [
    [16, 4],
    [3, 2],
    [channels.length, 2],
    [rate, 4],
    [rate * 4 * channels.length, 4],
    [4 * channels.length, 2],
    [32, 2],
  ].reduce((at, [value, bytes]) => {
    data.writeUIntLE(value, at, bytes);
    return at + bytes;
  }, 16);
  data.write("data", 36);
  data.writeUInt32LE(4 * frames * channels.length, 40);
  for (let i = 0; i < frames; i++) channels.forEach((c, n) => data.writeFloatLE(c[i], 44 + 4 * (i * channels.length + n)));
  writeFileSync(file, data);
}

/** Channels of a file of 32-bit floats or 16-bit integers. */
export function readWav(file) {
  const data = readFileSync(file);
  let [at, form, out] = [12, null, null];
  while (at + 8 <= data.length) {
    const [name, size] = [data.toString("latin1", at, at + 4), data.readUInt32LE(at + 4)];
    if (name === "fmt ")
      form = { count: data.readUInt16LE(at + 10), rate: data.readUInt32LE(at + 12), bits: data.readUInt16LE(at + 22) };
    if (name === "data") {
      const bytes = form.bits / 8;
      const frames = Math.floor(Math.min(size, data.length - at - 8) / bytes / form.count);
      const sample = (i) => (bytes === 4 ? data.readFloatLE(at + 8 + 4 * i) : data.readInt16LE(at + 8 + 2 * i) / 32768);
      out = Array.from({ length: form.count }, (_, c) =>
        Float32Array.from({ length: frames }, (_, i) => sample(i * form.count + c)),
      );
    }
    at += 8 + size + (size % 2);
  }
  return { rate: form.rate, channels: out };
}

/** Noise that is the same each time, -1 to 1 times a gain. */
export function noise(length, gain) {
  let state = 1;
  return Float32Array.from({ length }, () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return gain * (state / 2 ** 31 - 1);
  });
}

export const tone = (hz, rate, length, gain) =>
  Float32Array.from({ length }, (_, i) => gain * Math.sin((2 * Math.PI * hz * i) / rate));

/** A signal at three times its rate, by a windowed sinc. */
export function threefold(samples) {
  const reach = 24;
  const kernel = (t) => (t === 0 ? 1 : (Math.sin(Math.PI * t) / (Math.PI * t)) * (0.5 + 0.5 * Math.cos((Math.PI * t) / reach)));
  return Float32Array.from({ length: 3 * samples.length }, (_, i) => {
    const at = i / 3;
    let sum = 0;
    for (let k = Math.ceil(at - reach); k <= at + reach; k++) sum += (samples[k] ?? 0) * kernel(at - k);
    return sum;
  });
}

/** Energy of the difference of two signals over that of the first, dB. */
export function differenceDb(wanted, found) {
  let [difference, energy] = [0, 0];
  wanted.forEach((channel, c) =>
    channel.forEach((x, i) => {
      difference += (x - found[c][i]) ** 2;
      energy += x ** 2;
    }),
  );
  if (energy === 0) throw new Error("there is nothing to compare with");
  return 10 * Math.log10(difference / energy + 1e-30);
}

/** Level of the strongest line `from` to `to` Hz beside a tone, against the tone, dB, from bins of a Blackman-Harris window. */
export function sideLinesDb(signal, rate, hz, from, to) {
  const n = signal.length;
  const window = (i) =>
    [0.35875, -0.48829, 0.14128, -0.01168].reduce((sum, a, k) => sum + a * Math.cos((2 * Math.PI * k * i) / n), 0);
  const windowed = Float64Array.from(signal, (x, i) => x * window(i));
  const power = (f) => {
    let [re, im] = [0, 0];
    const step = (2 * Math.PI * f) / rate;
    const [c, s] = [Math.cos(step), Math.sin(step)];
    let [a, b] = [1, 0];
    for (const x of windowed) {
      re += x * a;
      im -= x * b;
      [a, b] = [a * c - b * s, a * s + b * c];
    }
    return re * re + im * im;
  };
  const bin = rate / n;
  let [side, middle] = [0, 0];
  for (let f = hz - from; f <= hz + from; f += bin) middle = Math.max(middle, power(f));
  for (let f = from; f <= to; f += bin) side = Math.max(side, power(hz + f), power(hz - f));
  return 10 * Math.log10(side / middle);
}
