// Settings of the engine: number, range and unit of each. Decibels, degrees and names become what the module takes here
// and nowhere else.

const db = (value) => (value <= -60 ? 0 : 10 ** (value / 20));
const same = (value) => value;
const flag = (value) => (value ? 1 : 0);

/**
 * By name: `id` of the module, `from` and `to` and `step` in the `unit` shown, `at` first, and `as` the module takes
 * it.
 */
export const SETTINGS = {
  gain: { id: 1, from: -60, to: 12, step: 0.5, at: 0, unit: "dB", as: db },
  mix: { id: 2, from: 0, to: 100, step: 1, at: 100, unit: "%", as: (v) => v / 100 },
  bypass: { id: 3, at: false, as: flag },
  wetSolo: { id: 4, at: false, as: flag },
  direct: { id: 5, from: -60, to: 24, step: 0.5, at: 0, unit: "dB", as: db },
  early: { id: 6, from: -60, to: 24, step: 0.5, at: 0, unit: "dB", as: db },
  late: { id: 7, from: -60, to: 24, step: 0.5, at: 0, unit: "dB", as: db },
  decay: { id: 8, from: 50, to: 200, step: 1, at: 100, unit: "%", as: (v) => v / 100 },
  distanceLaw: { id: 9, from: 0, to: 2, step: 0.05, at: 1, unit: "", as: same },
  width: { id: 10, from: 0, to: 200, step: 1, at: 100, unit: "%", as: (v) => v / 100 },
  lowCut: { id: 11, from: 0, to: 1000, step: 10, at: 0, unit: "Hz", as: same },
  stereoSpread: { id: 12, from: 0, to: 180, step: 1, at: 0, unit: "°", as: (v) => (v * Math.PI) / 180 },
  decodeRate: { id: 13, at: 40, unit: "Hz", as: same },
};

/** Pairs of number and value for the module, of values by name. Throws for a name or value that there is not. */
export function numbers(values) {
  return Object.entries(values).map(([name, value]) => {
    const setting = SETTINGS[name];
    if (!setting) throw new Error(`there is no setting "${name}"`);
    const number = setting.as(value);
    if (!Number.isFinite(number)) throw new Error(`setting "${name}": expected a number, found ${value}`);
    return [setting.id, number];
  });
}
