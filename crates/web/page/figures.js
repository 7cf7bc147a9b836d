// Level, latency, interruptions and place, in words and bars.

import { degrees, length, minus, turn } from "./turns.js";

const at = (id) => document.getElementById(id);
const FALL_DB = 1.2;
const decibels = (gain) => 20 * Math.log10(Math.max(gain, 1e-6));
const milliseconds = (seconds) => `${Math.round(1000 * seconds)} ms`;

export class Figures {
  constructor() {
    this.levels = [-120, -120];
  }

  /** Takes the peaks of a room's last thirtieth of a second; rooms add up by their powers. */
  take(room, { peaks, poseDelay }) {
    (this.peaks ??= new Map()).set(room, peaks);
    if (poseDelay !== undefined) this.poseDelay = poseDelay;
  }

  /** Shows how things are; `engineLatency` in seconds, `gain` of the volume. */
  show({ context, engineLatency, gain, pose, emitter }) {
    const running = context?.state === "running";
    [0, 1].forEach((ear) => {
      const power = [...(this.peaks?.values() ?? [])].reduce((sum, peaks) => sum + peaks[ear] ** 2, 0);
      const level = running ? decibels(Math.sqrt(power) * gain) : -120;
      this.levels[ear] = Math.max(level, this.levels[ear] - FALL_DB);
      const bar = at(ear === 0 ? "meter-left" : "meter-right");
      bar.style.width = `${Math.max(0, Math.min(100, (this.levels[ear] + 60) / 0.6))}%`;
    });
    const loudest = Math.max(...this.levels);
    at("figure-level").textContent = loudest < -60 ? "silent" : `${loudest.toFixed(0)} dBFS`;
    if (context) {
      const output = (context.baseLatency || 0) + (context.outputLatency || 0);
      at("figure-latency").textContent = `${milliseconds(engineLatency + output)} (scene ${milliseconds(engineLatency)})`;
      if (this.poseDelay !== undefined) at("figure-moves").textContent = milliseconds(this.poseDelay + output);
      at("figure-rate").textContent = `${(context.sampleRate / 1000).toFixed(1)} kHz`;
      this.showUnderruns(context);
    }
    at("figure-place").textContent = place(pose, emitter);
  }

  showUnderruns(context) {
    const stats = context.playbackStats ?? context.playoutStats;
    const events = stats?.underrunEvents ?? stats?.fallbackFramesEvents;
    if (events === undefined) {
      at("figure-underruns").textContent = "not told by this browser";
      return;
    }
    const lost = stats.underrunDuration ?? stats.fallbackFramesDuration ?? 0;
    at("figure-underruns").textContent = events === 0 ? "none" : `${events}, ${milliseconds(lost)} in all`;
  }

  /** Forgets a room. */
  forget(room) {
    this.peaks?.delete(room);
  }
}

/** Where the listener is, as seen from the sound: for figures and for who asks. */
export function place({ position, quaternion }, emitter) {
  const [x, y, z] = position.map((v) => v.toFixed(1));
  if (!emitter) return `${x}, ${y}, ${z} m`;
  const back = [-quaternion[0], -quaternion[1], -quaternion[2], quaternion[3]];
  const way = turn(back, minus(emitter, position));
  const azimuth = Math.round(degrees(Math.atan2(way[1], way[0])));
  const side =
    Math.abs(azimuth) < 3
      ? "ahead"
      : Math.abs(azimuth) > 177
        ? "behind you"
        : `${Math.abs(azimuth)}° to the ${azimuth > 0 ? "left" : "right"}`;
  return `${length(way).toFixed(1)} m from the sound, ${side}`;
}
