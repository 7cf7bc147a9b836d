// The sound's way out: the audio context, its states, and the way back from each.

import { clear, show } from "./messages.js";

const at = (id) => document.getElementById(id);

export class Output {
  constructor(voices) {
    Object.assign(this, { voices, context: null, started: false, paused: false, volume: 1 });
    voices.addEventListener("died", ({ detail }) => this.died(detail));
    voices.addEventListener("entered", ({ detail }) => (detail.room.latency = detail.latency));
  }

  /** The longest latency of a scene, seconds. */
  get latency() {
    return Math.max(0, ...[...this.voices.rooms].map((room) => room.latency ?? 0));
  }

  /** Makes a context, suspended until the listener wants it, and everything that plays in it. */
  open() {
    this.ready = this.make();
    return this.ready;
  }

  async make() {
    const rate = Number(at("rate").value);
    const before = this.context;
    const context = new AudioContext({ latencyHint: "interactive", ...(rate ? { sampleRate: rate } : {}) });
    if (!context.audioWorklet)
      throw new Error("This browser has no AudioWorklet, or the page was not opened from this machine or by https");
    this.context = context;
    context.onstatechange = () => context === this.context && this.changed();
    if (this.started) context.resume();
    await this.voices.use(context);
    this.setVolume(this.volume);
    if (before && before.state !== "closed") await before.close();
    if (before && before.sampleRate !== context.sampleRate) {
      const [old, now] = [before, context].map((c) => (c.sampleRate / 1000).toFixed(1));
      show("rate", `The sample rate went from ${old} to ${now} kHz; all scenes were made ready anew.`, { calm: true });
      setTimeout(() => clear("rate"), 6000);
    }
    this.changed();
  }

  setVolume(volume) {
    this.volume = volume;
    if (this.voices.master) this.voices.master.gain.setTargetAtTime(volume, this.context.currentTime, 0.02);
  }

  async resume() {
    this.started = true;
    this.paused = false;
    at("welcome").hidden = true;
    at("pause").disabled = false;
    await this.context?.resume();
    this.changed();
  }

  async pause() {
    this.paused = true;
    await this.context.suspend();
    this.changed();
  }

  /** Tells of a state, with the way back. */
  changed() {
    const { state } = this.context;
    at("pause").textContent = this.paused ? "Go on" : "Pause";
    document.documentElement.dataset.sound = this.started ? state : "waiting";
    if (!this.started || this.paused || state === "running") {
      clear("output");
    } else if (state === "closed") {
      show("output", "The sound's way out was closed.", { action: ["Start again", () => this.again()] });
    } else {
      show("output", "The browser has stopped the sound.", { action: ["Go on", () => this.resume()] });
    }
  }

  async again() {
    try {
      await this.open();
      await this.resume();
      clear("engine");
    } catch (error) {
      show("engine", `${error.message}.`, { action: ["Try again", () => this.again()] });
    }
  }

  died({ room, text }) {
    show("died", `The sound engine has stopped: ${text}.`, {
      action: [
        "Start it again",
        async () => {
          try {
            await room.engine.revive();
          } catch (error) {
            show("died", `The sound engine does not start: ${error.message}.`, {
              action: ["Load the page anew", () => location.reload()],
            });
          }
        },
      ],
    });
  }

  connectControls() {
    at("listen").addEventListener("click", () => {
      at("stage").focus({ preventScroll: true });
      return this.context ? this.resume() : this.again();
    });
    at("pause").addEventListener("click", () => (this.paused ? this.resume() : this.pause()));
    at("rate").addEventListener("change", () => this.again());
    document.addEventListener("visibilitychange", () => this.seen());
    navigator.mediaDevices?.addEventListener?.("devicechange", () => this.deviceChanged());
  }

  /** In the background the sound goes on and the listener stands still, but for a path. */
  seen() {
    if (!this.started) return;
    if (document.hidden) {
      show(
        "background",
        "This page was in the background: the sound went on, and you stood still unless you walked a path.",
        { calm: true },
      );
    } else {
      setTimeout(() => !document.hidden && clear("background"), 5000);
      if (!this.paused && this.context.state !== "running") this.context.resume();
    }
  }

  /** Another output may run at another rate; the browser converts, but the engine would rather play at that rate itself. */
  async deviceChanged() {
    if (!this.started || at("rate").value) return;
    const probe = new AudioContext();
    const rate = probe.sampleRate;
    await probe.close();
    if (rate !== this.context.sampleRate) {
      show("device", `The output now runs at ${(rate / 1000).toFixed(1)} kHz.`, {
        action: ["Play at that rate", () => this.again()],
      });
    }
  }
}
