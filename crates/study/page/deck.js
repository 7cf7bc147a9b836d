// What plays the sounds of a trial, all at once, one of them heard: changes between them leave no gap.

import { text } from "./texts.js";

/** Time of a change, seconds. */
const FADE_S = 0.02;
/** Length of the anchor's low-pass, samples at each side of its middle, and its transition, hertz. */
const TAPS = 240;

const kept = new Map();

async function bytes(file) {
  if (!kept.has(file)) {
    const asked = (async () => {
      const response = await fetch(file);
      if (!response.ok) throw new Error(`${file}: ${text("server answers", response)}`);
      return response.arrayBuffer();
    })();
    asked.catch(() => kept.delete(file));
    kept.set(file, asked);
  }
  return kept.get(file);
}

async function decoded(context, file) {
  try {
    return await context.decodeAudioData((await bytes(file)).slice(0));
  } catch (error) {
    throw new Error(error instanceof DOMException ? text("no sound", { file }) : error.message);
  }
}

/** A low-pass of even phase: a sinc in a Blackman window. */
function lowPass(context, cut) {
  const kernel = new AudioBuffer({ length: 2 * TAPS + 1, sampleRate: context.sampleRate });
  const taps = kernel.getChannelData(0);
  const at = (2 * cut) / context.sampleRate;
  let sum = 0;
  for (let i = 0; i <= 2 * TAPS; i++) {
    const t = i - TAPS;
    const window = 0.42 - 0.5 * Math.cos((Math.PI * i) / TAPS) + 0.08 * Math.cos((2 * Math.PI * i) / TAPS);
    taps[i] = window * (t === 0 ? at : Math.sin(Math.PI * at * t) / (Math.PI * t));
    sum += taps[i];
  }
  for (let i = 0; i <= 2 * TAPS; i++) taps[i] /= sum;
  return kernel;
}

/** Counts how long each sound was heard. */
class Deck extends EventTarget {
  constructor(context, sounds) {
    super();
    this.context = context;
    this.sounds = sounds;
    this.heard = sounds.map(() => 0);
    this.current = null;
    this.since = 0;
  }

  /** Seconds that a sound has been heard so far. */
  seconds(index) {
    return this.heard[index] + (this.current === index ? this.context.currentTime - this.since : 0);
  }

  note(index) {
    if (this.current !== null) this.heard[this.current] += this.context.currentTime - this.since;
    this.current = index;
    this.since = this.context.currentTime;
    this.dispatchEvent(new Event("change"));
  }
}

/** Sounds of files. */
export class FileDeck extends Deck {
  static async open(context, sounds) {
    const deck = new FileDeck(context, sounds);
    deck.buffers = await Promise.all(sounds.map((sound) => decoded(context, sound.file)));
    deck.buffers = await Promise.all(
      deck.buffers.map((buffer, i) => (sounds[i].cut ? cutOff(buffer, sounds[i].cut) : buffer)),
    );
    deck.length = Math.max(...deck.buffers.map((buffer) => buffer.duration));
    deck.stretch = [0, deck.length];
    return deck;
  }

  /** Seconds a sound must be heard of those asked for: no longer than it is. */
  least(index, seconds) {
    return Math.min(seconds, this.buffers[index].duration * 0.9);
  }

  /** Where the sounds are, seconds from their beginning; null while none is heard. */
  get position() {
    if (this.current === null) return null;
    const { currentTime, outputLatency = 0 } = this.context;
    const passed = Math.max(0, currentTime - outputLatency - this.began);
    const [from, to] = this.stretch;
    return this.loops ? from + (passed % (to - from)) : passed;
  }

  /** Goes round between two times of all sounds, seconds. */
  goRound(from, to) {
    const { position, context } = this;
    this.stretch = [from, to];
    if (position !== null) this.began = context.currentTime - ((((position - from) % (to - from)) + to - from) % (to - from));
    for (const source of this.sources ?? []) [source.loopStart, source.loopEnd] = this.stretch;
  }

  /** Hears a sound, from its beginning or where the others are. */
  select(index, { over = false, loop = true } = {}) {
    if (this.sources && !over && this.current !== null) {
      this.gains.forEach((gain, i) =>
        gain.gain.setTargetAtTime(i === index ? this.sounds[i].gain : 0, this.context.currentTime, FADE_S / 4),
      );
    } else {
      this.quiet();
      const start = this.context.currentTime + 0.02;
      Object.assign(this, { began: start, loops: loop });
      this.gains = this.sounds.map((sound, i) => new GainNode(this.context, { gain: i === index ? sound.gain : 0 }));
      this.sources = this.buffers.map((buffer, i) => {
        const [loopStart, loopEnd] = this.stretch;
        const source = new AudioBufferSourceNode(this.context, { buffer, loop, loopStart, loopEnd });
        source.connect(this.gains[i]).connect(this.context.destination);
        source.start(start, loop ? loopStart : 0);
        return source;
      });
      const longest = this.buffers.findIndex((buffer) => buffer.duration === this.length);
      const { sources } = this;
      sources[longest].onended = () => this.sources === sources && this.stop();
    }
    this.note(index);
  }

  quiet() {
    const { sources, gains, context } = this;
    this.sources = null;
    gains?.forEach((gain) => gain.gain.setTargetAtTime(0, context.currentTime, FADE_S / 4));
    sources?.forEach((source) => source.stop(context.currentTime + 2 * FADE_S));
  }

  stop() {
    this.quiet();
    this.note(null);
  }

  close() {
    this.stop();
  }
}

async function cutOff(buffer, cut) {
  const context = new OfflineAudioContext(buffer.numberOfChannels, buffer.length + TAPS, buffer.sampleRate);
  const source = new AudioBufferSourceNode(context, { buffer });
  source
    .connect(new ConvolverNode(context, { buffer: lowPass(context, cut), disableNormalization: true }))
    .connect(context.destination);
  source.start();
  const late = await context.startRendering();
  // The filter's delay is taken off, so that the anchor is in time with the others.
  const made = new AudioBuffer({
    length: buffer.length,
    sampleRate: buffer.sampleRate,
    numberOfChannels: buffer.numberOfChannels,
  });
  for (let i = 0; i < buffer.numberOfChannels; i++) made.copyToChannel(late.getChannelData(i).subarray(TAPS), i);
  return made;
}

/** One dry sound in several scenes, for a listener who walks and turns. */
export class LiveDeck extends Deck {
  static async open(context, sounds, dry) {
    const { Engine } = await import("./engine/engine.js");
    const deck = new LiveDeck(context, sounds);
    deck.engine = await Engine.create(context);
    deck.engine.addEventListener("died", async ({ detail }) => {
      deck.dispatchEvent(new CustomEvent("trouble", { detail: text("sound died", { why: detail.text }) }));
      await deck.engine.revive();
      if (deck.current !== null) deck.hear(deck.current);
    });
    deck.gain = new GainNode(context, { gain: 0 });
    deck.straight = new GainNode(context, { gain: 1 });
    const cuts = sounds.flatMap((sound) => sound.cut ?? []);
    deck.engine.output.connect(deck.gain);
    // The low-pass is late by its half, and so is what goes beside it.
    const late = new DelayNode(context, { delayTime: cuts.length > 0 ? TAPS / context.sampleRate : 0 });
    deck.gain.connect(late).connect(deck.straight).connect(context.destination);
    deck.anchors = cuts.map((cut) => {
      const filter = new ConvolverNode(context, { buffer: lowPass(context, cut), disableNormalization: true });
      const gain = new GainNode(context, { gain: 0 });
      deck.gain.connect(filter).connect(gain).connect(context.destination);
      return { cut, gain };
    });
    // Only what leads to the ears is run, and takes its scenes. One is loaded once, whatever names it goes by.
    deck.files = [...new Set(sounds.map((sound) => sound.file))];
    for (const file of deck.files) {
      await deck.engine.load(await bytes(file), { slot: file, hear: file === deck.files[0] });
    }
    deck.source = new AudioBufferSourceNode(context, { buffer: await decoded(context, dry), loop: true });
    deck.source.connect(deck.engine.input);
    deck.source.start();
    return deck;
  }

  least(_, seconds) {
    return seconds;
  }

  select(index) {
    this.hear(index);
    this.note(index);
  }

  hear(index) {
    const { file, gain, cut } = this.sounds[index];
    const now = this.context.currentTime;
    this.engine.select(file, this.files);
    this.gain.gain.setTargetAtTime(gain, now, FADE_S / 2);
    this.straight.gain.setTargetAtTime(cut ? 0 : 1, now, FADE_S / 2);
    for (const anchor of this.anchors) anchor.gain.gain.setTargetAtTime(anchor.cut === cut ? 1 : 0, now, FADE_S / 2);
  }

  pose(position, quaternion) {
    this.engine.pose(position, quaternion);
  }

  jump(position, quaternion) {
    this.engine.jump(position, quaternion);
  }

  stop() {
    this.gain.gain.setTargetAtTime(0, this.context.currentTime, FADE_S / 2);
    this.note(null);
  }

  close() {
    this.stop();
    const { engine, source } = this;
    setTimeout(() => {
      source.stop();
      engine.close();
    }, 200);
  }
}
