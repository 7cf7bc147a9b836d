// Headphones or not? Woods, Siegel, Traer and McDermott, "Headphone screening to facilitate web-based auditory experiments",
// Attention, Perception & Psychophysics 79, 2017.
// Three tones of 200 Hz, one 6 dB softer, one with its channels in antiphase. In front of loudspeakers the latter cancels
// itself and seems to be the softest.

import { shuffled } from "./random.js";

export const TRIALS = 6;
export const PASS = 5;
const TONE_S = 1;
const RAMP_S = 0.1;
const PAUSE_S = 0.5;
const LEVEL = 0.2;
const SOFTER = 10 ** (-6 / 20);

/** Trials: which of three places is the softest, and which the antiphase one. Each softest place comes equally often. */
export function screening(random) {
  const softest = shuffled(
    Array.from({ length: TRIALS }, (_, i) => i % 3),
    random,
  );
  return softest.map((soft) => {
    const others = [0, 1, 2].filter((place) => place !== soft);
    return { soft, antiphase: others[random() < 0.5 ? 0 : 1] };
  });
}

/** Samples of a trial, left and right. */
export function tones({ soft, antiphase }, rate) {
  const [tone, ramp, pause] = [TONE_S, RAMP_S, PAUSE_S].map((s) => Math.round(s * rate));
  const length = 3 * tone + 2 * pause;
  const ears = [new Float32Array(length), new Float32Array(length)];
  for (let place = 0; place < 3; place++) {
    const level = LEVEL * (place === soft ? SOFTER : 1);
    for (let i = 0; i < tone; i++) {
      const edge = Math.min(1, i / ramp, (tone - 1 - i) / ramp);
      const value = level * Math.sin((Math.PI / 2) * edge) ** 2 * Math.sin((2 * Math.PI * 200 * i) / rate);
      const at = place * (tone + pause) + i;
      ears[0][at] = value;
      ears[1][at] = place === antiphase ? -value : value;
    }
  }
  return ears;
}

/** Plays a trial; `on(place)` is called as each tone begins, with null at the end. */
export function play(context, trial, on) {
  const ears = tones(trial, context.sampleRate);
  const buffer = new AudioBuffer({ length: ears[0].length, numberOfChannels: 2, sampleRate: context.sampleRate });
  ears.forEach((ear, i) => buffer.copyToChannel(ear, i));
  const source = new AudioBufferSourceNode(context, { buffer });
  source.connect(context.destination);
  source.start();
  const timers = [0, 1, 2].map((place) => setTimeout(() => on(place), 1000 * place * (TONE_S + PAUSE_S)));
  source.onended = () => on(null);
  return () => {
    timers.forEach(clearTimeout);
    source.onended = null;
    source.stop();
  };
}
