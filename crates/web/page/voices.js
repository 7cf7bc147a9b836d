// Sounds that are heard in places: all that are played in one scene share its engine.

import { Engine, MOST_SOUNDS } from "./engine/engine.js";

/**
 * One sound. `dry` is { kind: "site" | "file" | "microphone" | "none", name, ... }; `scene` the number of a scene, or
 * null for the place's.
 */
export class Voice {
  constructor(dry, scene = null) {
    // How far it has been put from where its scene has it, metres; the room it is heard in, and its number there.
    Object.assign(this, { dry, scene, level: 0, offset: [0, 0, 0], source: null, gain: null, room: null, input: 0 });
  }

  /** The scene that it is heard in: its number, and its description and points. */
  get loaded() {
    return this.room?.loaded;
  }
}

/** An engine, and the sounds in its scene by their numbers. */
class Room {
  constructor(scene, engine) {
    Object.assign(this, { scene, engine, sounds: [], size: 0, read: null, ready: null, loaded: null });
  }

  /** The least number that no sound has. */
  get free() {
    const hole = Array.from(this.sounds).findIndex((voice) => !voice);
    return hole < 0 ? this.sounds.length : hole;
  }

  /** Sounds that the scene is made ready for: twice as many when they are too few, so that it is seldom made anew. */
  get wanted() {
    return Math.min(2 ** Math.ceil(Math.log2(Math.max(this.sounds.length, 1))), MOST_SOUNDS);
  }
}

export class Voices extends EventTarget {
  constructor(site) {
    super();
    this.site = site;
    this.context = null;
    this.voices = [];
    /** Those that play, and all by what sounds in them have as their scene, made or being made. */
    this.rooms = new Set();
    this.opened = new Map();
    /** What is loaded beside a scene: head and headphones as bytes, a second emitter, the accuracy. */
    this.beside = {};
    this.values = {};
    this.rows = [];
    this.place = 0;
  }

  /** Uses an audio context from now on, and makes all sounds anew in it. */
  async use(context) {
    for (const voice of this.voices) this.silence(voice);
    this.opened.clear();
    this.master?.disconnect();
    this.context = context;
    this.master = new GainNode(context);
    this.master.connect(context.destination);
    await Promise.all(this.voices.map((voice) => this.begin(voice)));
  }

  async add(dry, scene = null) {
    if (this.voices.length >= MOST_SOUNDS) throw new Error(`a place has at most ${MOST_SOUNDS} sounds`);
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
    voice.gain?.disconnect();
    voice.gain = null;
    this.leave(voice);
  }

  /** Takes a sound out of its room, and closes a room without sounds. */
  leave(voice) {
    const { room } = voice;
    if (!room) return;
    voice.room = null;
    delete room.sounds[voice.input];
    if (room.sounds.some(Boolean)) return;
    this.rooms.delete(room);
    this.opened.delete(room.scene);
    room.engine.close();
    this.dispatchEvent(new CustomEvent("closed", { detail: { room } }));
  }

  async begin(voice) {
    voice.gain = new GainNode(this.context, { gain: 10 ** (voice.level / 20) });
    await Promise.all([this.load(voice), this.plug(voice)]);
  }

  /** Opens a room for sounds with some scene; none where there is another context by then. */
  async open(scene) {
    const { context } = this;
    const engine = await Engine.create(context);
    if (this.context !== context) return engine.close();
    const room = new Room(scene, engine);
    this.rooms.add(room);
    engine.output.connect(this.master);
    engine.set(this.values);
    if (this.rows.length > 0) engine.setPath(this.rows);
    if (this.pose) engine.jump(this.pose.position, this.pose.quaternion);
    for (const kind of ["report", "died", "entered"]) {
      engine.addEventListener(kind, ({ detail }) =>
        this.dispatchEvent(new CustomEvent(kind, { detail: { ...detail, room } })),
      );
    }
    return room;
  }

  /** Plays a sound in its scene. */
  async load(voice) {
    const { scene, gain } = voice;
    if (!this.opened.has(scene)) {
      const opened = this.open(scene);
      this.opened.set(scene, opened);
      // What could not be opened may be tried again.
      opened.catch(() => this.opened.get(scene) === opened && this.opened.delete(scene));
    }
    const room = await this.opened.get(scene);
    if (!room || voice.gain !== gain || voice.scene !== scene) return;
    if (voice.room !== room) {
      gain.disconnect();
      this.leave(voice);
      Object.assign(voice, { room, input: room.free });
      room.sounds[voice.input] = voice;
      room.engine.put(voice.input, voice.offset);
      gain.connect(room.engine.inputs[voice.input]);
    }
    await this.read(room);
  }

  /** Reads the scene of a room, if it has another, is for fewer sounds than it has, or is to be made `anew`. */
  async read(room, anew = false) {
    const number = room.scene ?? this.place;
    if (anew || room.read !== number || room.size < room.wanted) {
      Object.assign(room, { read: number, size: Math.max(room.size, room.wanted) });
      room.ready = this.prepare(room, number);
    }
    await room.ready;
  }

  async prepare(room, number) {
    const { file, name } = this.site.scenes[number];
    try {
      const bytes = await this.site.bytes(file);
      const further = room.size - 1;
      const place = await room.engine.load(bytes, { ...this.beside, further });
      room.loaded = { number, place };
      this.dispatchEvent(new CustomEvent("loaded", { detail: { room } }));
    } catch (error) {
      room.read = null;
      throw new Error(`"${name}" cannot be played: ${error.message}`);
    }
  }

  /** Reads the scenes of all sounds again, with other heads or headphones or in another place. */
  async reload() {
    await Promise.all([...this.rooms].map((room) => this.read(room, true)));
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
      if (voice.plugged !== turn || !voice.gain) return;
      node = new AudioBufferSourceNode(this.context, { buffer, loop: true });
      node.start();
    }
    voice.source = node;
    if (voice.gain) node?.connect(voice.gain);
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
    voice.room?.engine.put(voice.input, offset);
  }

  each(work) {
    for (const { engine } of this.rooms) work(engine);
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
