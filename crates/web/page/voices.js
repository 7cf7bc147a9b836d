// Sounds that are heard in the place: each has a dry sound, a level, a scene it is played in, and an engine.

import { Engine } from "./engine/engine.js";

/**
 * One sound. `dry` is { kind: "site" | "file" | "microphone" | "none", name, ... }; `scene` the number of a scene, or
 * null for the place's.
 */
export class Voice {
  constructor(dry, scene = null) {
    // How far it has been put from where its scene has it, metres.
    Object.assign(this, { dry, scene, level: 0, offset: [0, 0, 0], engine: null, source: null, loaded: null });
  }
}

const offsets = ({ offset: [offsetX, offsetY, offsetZ] }) => ({ offsetX, offsetY, offsetZ });

export class Voices extends EventTarget {
  constructor(site) {
    super();
    this.site = site;
    this.context = null;
    this.voices = [];
    /** What is loaded beside a scene: head and headphones as bytes, a second emitter. */
    this.beside = {};
    this.values = {};
    this.rows = [];
    this.place = 0;
  }

  /** Uses an audio context from now on, and makes all sounds anew in it. */
  async use(context) {
    for (const voice of this.voices) this.silence(voice);
    this.master?.disconnect();
    this.context = context;
    this.master = new GainNode(context);
    this.master.connect(context.destination);
    await Promise.all(this.voices.map((voice) => this.begin(voice)));
  }

  async add(dry, scene = null) {
    const voice = new Voice(dry, scene);
    this.voices.push(voice);
    if (this.context) await this.begin(voice);
    return voice;
  }

  remove(voice) {
    this.silence(voice);
    this.voices = this.voices.filter((v) => v !== voice);
  }

  silence(voice) {
    this.unplug(voice);
    voice.engine?.close();
    voice.gain?.disconnect();
    voice.engine = null;
  }

  async begin(voice) {
    const { context } = this;
    const engine = await Engine.create(context);
    if (this.context !== context || voice.engine) return engine.close();
    voice.engine = engine;
    voice.gain = new GainNode(context, { gain: 10 ** (voice.level / 20) });
    engine.output.connect(voice.gain).connect(this.master);
    engine.set({ ...this.values, ...offsets(voice) });
    if (this.rows.length > 0) engine.setPath(this.rows);
    if (this.pose) engine.jump(this.pose.position, this.pose.quaternion);
    for (const kind of ["report", "died", "entered"]) {
      engine.addEventListener(kind, ({ detail }) =>
        this.dispatchEvent(new CustomEvent(kind, { detail: { ...detail, voice } })),
      );
    }
    await Promise.all([this.load(voice), this.plug(voice)]);
  }

  /** Reads the scene of a sound and plays it. */
  async load(voice) {
    const number = voice.scene ?? this.place;
    const { file, name } = this.site.scenes[number];
    try {
      const bytes = await this.site.bytes(file);
      const { head, headphones, secondEmitter } = this.beside;
      const place = await voice.engine.load(bytes, { head, headphones, secondEmitter });
      voice.loaded = { number, place };
      this.dispatchEvent(new CustomEvent("loaded", { detail: { voice } }));
    } catch (error) {
      throw new Error(`"${name}" cannot be played: ${error.message}`);
    }
  }

  /** Reads the scenes of all sounds again, with other heads or headphones or in another place. */
  async reload() {
    await Promise.all(this.voices.filter((v) => v.engine).map((voice) => this.load(voice)));
  }

  /** Connects the dry sound of a sound. */
  async plug(voice) {
    this.unplug(voice);
    const { dry } = voice;
    const turn = (voice.plugged = (voice.plugged ?? 0) + 1);
    let node = null;
    if (dry.kind === "microphone") {
      node = new MediaStreamAudioSourceNode(this.context, { mediaStream: dry.stream });
    } else if (dry.kind !== "none") {
      const buffer = await this.decoded(dry);
      if (voice.plugged !== turn || !voice.engine) return;
      node = new AudioBufferSourceNode(this.context, { buffer, loop: true });
      node.start();
    }
    voice.source = node;
    node?.connect(voice.engine.input);
  }

  unplug(voice) {
    if (voice.source instanceof AudioBufferSourceNode) voice.source.stop();
    voice.source?.disconnect();
    voice.source = null;
  }

  /** The samples of a dry sound. */
  async decoded(dry) {
    const bytes = dry.kind === "file" ? dry.bytes : await this.site.bytes(dry.file);
    try {
      // Decoding takes the bytes away.
      return await this.context.decodeAudioData(bytes.slice(0));
    } catch {
      throw new Error(`"${dry.name}" cannot be played: this browser finds no sound in it`);
    }
  }

  setLevel(voice, level) {
    voice.level = level;
    voice.gain?.gain.setTargetAtTime(10 ** (level / 20), this.context.currentTime, 0.02);
  }

  /** Puts a sound elsewhere in its scene. */
  put(voice, offset) {
    voice.offset = offset;
    voice.engine?.set(offsets(voice));
  }

  each(work) {
    for (const { engine } of this.voices) if (engine) work(engine);
  }

  set(values) {
    Object.assign(this.values, values);
    this.each((engine) => engine.set(values));
  }

  move(pose, at) {
    this.pose = pose;
    this.each((engine) => engine.pose(pose.position, pose.quaternion, at));
  }

  jump(pose) {
    this.pose = pose;
    this.each((engine) => engine.jump(pose.position, pose.quaternion));
  }

  setPath(rows) {
    this.rows = rows;
    this.each((engine) => engine.setPath(rows));
  }
}
