// The audio thread: plays instances of the module that a Worker has prepared, and cross-fades from one to the next.

import { Instance } from "./module.js";

/** Bytes of a prepared memory that are copied between two blocks: a fraction of a millisecond. */
const PIECE = 1 << 20;
/** Length of a cross-fade, seconds. */
const FADE_S = 0.05;
/** Reports a second. */
const REPORTS = 30;

class PromenadeProcessor extends AudioWorkletProcessor {
  constructor({ processorOptions }) {
    super();
    this.module = processorOptions.module;
    this.slots = new Map();
    this.current = null;
    /** What is being faded out, and the progress of that, samples. */
    this.leaving = null;
    this.faded = 0;
    this.fadeLength = Math.round(FADE_S * sampleRate);
    /** Memories that are being copied, the oldest first. */
    this.arriving = [];
    /** Instances that are played though they are not heard, so that their rooms sound when they are wanted. */
    this.warm = new Set();
    this.settings = new Map();
    /** How far sounds are moved, by number. */
    this.offsets = new Map();
    this.path = null;
    this.peaks = [0, 0];
    this.reported = 0;
    // Milliseconds of work, coarse in each block but right on the average, and samples that it was for.
    this.busy = this.played = 0;
    this.answers = 0;
    this.port.onmessage = ({ data }) => this.receive(data);
  }

  receive(data) {
    try {
      this[data.kind](data);
    } catch (error) {
      this.die(error);
    }
    if (data.ack !== undefined) this.port.postMessage({ kind: "ack", ack: data.ack });
  }

  // Messages.

  /** A prepared memory for a slot; `rush` where nothing is heard meanwhile, `hear` to cross-fade to it. */
  memory({ slot, name, memory, rush, hear }) {
    this.arriving = this.arriving.filter((a) => a.slot !== slot);
    const arriving = { slot, name, hear, instance: null, from: new Uint8Array(memory), done: 0 };
    this.arriving.push(arriving);
    while (rush && this.arriving.includes(arriving)) this.copy(arriving);
  }

  select({ slot, warm }) {
    this.warm = new Set(warm ?? []);
    const wanted = this.slots.get(slot);
    if (wanted && wanted !== this.current) this.fadeTo(wanted);
  }

  drop({ slot }) {
    this.slots.delete(slot);
    this.arriving = this.arriving.filter((a) => a.slot !== slot);
  }

  set({ values }) {
    for (const [setting, value] of values) {
      this.settings.set(setting, value);
      this.all((f) => f.set(setting, value));
    }
  }

  put({ sound, offset }) {
    this.offsets.set(sound, offset);
    this.all((f) => f.put(sound, ...offset));
  }

  pose({ pose, at }) {
    this.all((f) => f.glide(...pose, at));
    this.last = pose;
  }

  jump({ pose }) {
    this.all((f) => f.jump(...pose));
    this.last = pose;
  }

  way({ rows }) {
    this.path = rows;
    this.walking = null;
    for (const instance of this.instances()) instance.take("path", rows);
  }

  walk({ from, speed, flags }) {
    this.walking = { from, speed, flags, began: currentFrame };
    this.all((f) => f.walk(from, speed, flags));
  }

  stop() {
    this.walking = null;
    this.all((f) => f.stop());
  }

  reset() {
    this.all((f) => f.reset());
  }

  decoder({ port }) {
    this.decoderPort = port;
    port.onmessage = ({ data: { slot, voice, row } }) => {
      const instance = this.slots.get(slot);
      if (instance) {
        instance.write(row);
        this.answers += instance.f.answer(voice);
      }
    };
  }

  /** Is done for good: the next block is its last, and its memories go. */
  close() {
    this.closed = true;
    this.current = this.leaving = null;
    this.slots.clear();
    this.warm.clear();
    this.arriving = [];
    this.decoderPort?.postMessage({ closed: true });
    for (const port of [this.decoderPort, this.port]) {
      if (port) port.onmessage = null;
      port?.close();
    }
  }

  // Instances.

  instances() {
    return new Set([...this.slots.values(), this.leaving, this.current].filter(Boolean));
  }

  all(work) {
    for (const instance of this.instances()) work(instance.f);
  }

  /** Copies a piece of the oldest memory that has arrived, and takes it into play when it is whole. */
  copy(arriving) {
    const { from } = arriving;
    if (!arriving.instance) {
      arriving.instance = new Instance(this.module);
      arriving.instance.grow(from.length);
      return;
    }
    const end = Math.min(arriving.done + PIECE, from.length);
    new Uint8Array(arriving.instance.f.memory.buffer).set(from.subarray(arriving.done, end), arriving.done);
    arriving.done = end;
    if (end < from.length) return;
    this.arriving = this.arriving.filter((a) => a !== arriving);
    this.enter(arriving);
  }

  enter({ slot, name, hear, instance }) {
    const before = this.slots.get(slot) ?? null;
    instance.name = name;
    instance.slot = slot;
    instance.latency = instance.f.latency();
    for (const [setting, value] of this.settings) instance.f.set(setting, value);
    for (const [sound, offset] of this.offsets) instance.f.put(sound, ...offset);
    if (this.path) instance.take("path", this.path);
    const heard = this.current?.heard();
    if (heard) instance.f.jump(...heard.slice(0, 7));
    else if (this.last) instance.f.jump(...this.last);
    if (this.walking) {
      const { from, speed, flags, began } = this.walking;
      instance.f.walk(from + (currentFrame - began) / sampleRate, speed, flags);
    }
    this.slots.set(slot, instance);
    if (hear || before === this.current) this.fadeTo(instance);
    this.dead = false;
    const latency = instance.latency / sampleRate;
    this.port.postMessage({ kind: "entered", slot, name, latency });
  }

  fadeTo(instance) {
    // A fade that is under way is cut short at its loudest part.
    if (!this.leaving || this.faded > this.fadeLength / 2) this.leaving = this.current;
    if (!this.warm.has(instance.slot) && instance.idle) instance.f.reset();
    instance.idle = false;
    this.current = instance;
    this.faded = this.leaving ? 0 : this.fadeLength;
  }

  /** Plays a block of one instance into its ears. */
  play(instance, [first, ...others], n) {
    const { f, inputs } = instance.views();
    const channels = Math.min(first.length, 2);
    for (let c = 0; c < Math.max(channels, 1); c++) {
      if (channels > c) inputs[c].set(first[c]);
      else inputs[c].fill(0, 0, n);
    }
    // Sounds that nothing is connected to have no channels.
    let further = 0;
    for (const [i, [left, right]] of others.entries()) {
      const samples = inputs[2 + i];
      if (!left || !samples) continue;
      further |= 1 << i;
      if (right) for (let s = 0; s < n; s++) samples[s] = (left[s] + right[s]) / 2;
      else samples.set(left);
    }
    f.process(Math.max(channels, 1), further, n);
    return instance.views().ears;
  }

  process(input, [output]) {
    if (this.closed) return false;
    const n = output[0].length;
    if (this.arriving.length > 0) this.receive({ kind: "copyNext" });
    if (!this.current || this.dead) return this.report(n);
    const began = Date.now();
    try {
      const ears = this.play(this.current, input, n);
      for (let e = 0; e < 2; e++) output[e].set(ears[e].subarray(0, n));
      if (this.leaving) this.fade(input, output, n);
      for (const slot of this.warm) {
        const instance = this.slots.get(slot);
        if (instance && instance !== this.current && instance !== this.leaving) this.play(instance, input, n);
      }
      if (this.decoderPort) this.ask();
    } catch (error) {
      for (const ear of output) ear.fill(0);
      this.die(error);
    }
    this.busy += Date.now() - began;
    this.played += n;
    for (let e = 0; e < 2; e++) {
      let peak = this.peaks[e];
      for (const x of output[e]) peak = Math.max(peak, Math.abs(x));
      this.peaks[e] = peak;
    }
    return this.report(n);
  }

  copyNext() {
    this.copy(this.arriving[0]);
  }

  fade(input, output, n) {
    const ears = this.play(this.leaving, input, n);
    for (let e = 0; e < 2; e++) {
      for (let i = 0; i < n; i++) {
        const share = Math.min((this.faded + i) / this.fadeLength, 1);
        output[e][i] = ears[e][i] + share * (output[e][i] - ears[e][i]);
      }
    }
    this.faded += n;
    if (this.faded >= this.fadeLength) {
      this.leaving.idle = !this.warm.has(this.leaving.slot);
      this.leaving = null;
    }
  }

  /** Carries questions of live decoders to the Worker. */
  ask() {
    const { f, name, slot, inputs } = this.current;
    for (let voice = 0; voice < inputs.length; voice++) {
      const at = f.asked(voice);
      if (at === 0) continue;
      const pose = Array.from(new Float32Array(f.memory.buffer, at, 7));
      this.decoderPort.postMessage({ name, slot, voice, pose });
    }
  }

  /** The engine is broken: says why, and is silent until it is given another memory. */
  die(error) {
    if (this.dead) return;
    let text = String(error.message ?? error);
    try {
      if (error instanceof WebAssembly.RuntimeError) text = `${this.current?.text() || ""} (${text})`.trim();
    } catch {
      // Its memory is beyond reading; the error's own text has to do.
    }
    this.dead = true;
    this.current = this.leaving = null;
    this.slots.clear();
    this.arriving = [];
    this.port.postMessage({ kind: "died", text });
  }

  report(n) {
    this.reported += n;
    if (this.reported * REPORTS >= sampleRate) {
      this.reported = 0;
      const message = { kind: "report", peaks: this.peaks, frame: currentFrame };
      if (this.current) {
        message.answers = this.answers;
        message.heard = this.current.heard();
        message.poseDelay = this.current.f.pose_delay() / sampleRate;
        if (this.played >= sampleRate) {
          message.load = (this.busy / 1000) * (sampleRate / this.played);
          this.busy = this.played = 0;
        }
      }
      this.port.postMessage(message);
      this.peaks = [0, 0];
    }
    return true;
  }
}

registerProcessor("promenade", PromenadeProcessor);
