// Promenade's engine for a page: an audio node that plays a dry sound in a scene, for a listener who walks and turns.
//
//   const context = new AudioContext();
//   const engine = await Engine.create(context);
//   source.connect(engine.input);
//   engine.output.connect(context.destination);
//   await engine.load(sceneBytes);
//   engine.pose([x, y, z], [qx, qy, qz, qw]);
//
// Metres, x forward, y left, z up; quaternions turn head axes into the world's.

import { numbers } from "./settings.js";

export { SETTINGS } from "./settings.js";

/** Sounds in one scene at most. */
export const MOST_SOUNDS = 16;

const here = (file) => new URL(file, import.meta.url);

/** The compiled module, once for a page. */
let compiled = null;

/** Compiles the module. Throws where it cannot be had, or this browser cannot run it. */
export function compile(url = here("promenade.wasm")) {
  compiled ??= compileFrom(url).catch((error) => {
    compiled = null;
    throw error;
  });
  return compiled;
}

async function compileFrom(url) {
  if (typeof WebAssembly !== "object") throw new Error("this browser has no WebAssembly");
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url.pathname ?? url}: the server answered ${response.status}`);
  const typed = (response.headers.get("content-type") ?? "").startsWith("application/wasm");
  // A stream is compiled while it comes and kept by the browser; a server that does not name the type gets the slower way.
  return typed ? WebAssembly.compileStreaming(response) : WebAssembly.compile(await response.arrayBuffer());
}

/** The Worker that prepares scenes, one for all engines of a page. */
class Preparer {
  constructor(module) {
    this.worker = new Worker(here("preparer.js"), { type: "module" });
    this.waiting = new Map();
    this.asked = 0;
    this.worker.onmessage = ({ data: { id, answer, error } }) => {
      const { resolve, reject } = this.waiting.get(id) ?? {};
      this.waiting.delete(id);
      if (error === undefined) resolve?.(answer);
      else reject?.(new Error(error));
    };
    this.worker.onerror = (event) => {
      const error = new Error(`scenes cannot be prepared: ${event.message ?? "the Worker did not start"}`);
      for (const { reject } of this.waiting.values()) reject(error);
      this.waiting.clear();
    };
    this.ready = this.call({ kind: "module", module });
  }

  call(message, moved = []) {
    return new Promise((resolve, reject) => {
      const id = this.asked++;
      this.waiting.set(id, { resolve, reject });
      this.worker.postMessage({ ...message, id }, moved);
    });
  }
}

let preparer = null;
let engines = 0;

const added = new WeakMap();

/** Compiles the module, starts the Worker and adds the processor to a context: what takes longest before a first sound. */
export async function warmUp(context) {
  const module = await compile();
  preparer ??= new Preparer(module);
  if (!added.has(context)) added.set(context, context.audioWorklet.addModule(here("processor.js")));
  await Promise.all([preparer.ready, added.get(context)]);
  return module;
}

/**
 * Dry sounds in one scene. Events: `entered` (a scene is played; detail has slot and latency in seconds), `report`
 * (30 a second: peaks, heard pose, poseDelay in seconds, load as a share of the time once a second, answers of the live decoder so far), `died` (detail.text
 * says why; `revive()` is the way back).
 */
export class Engine extends EventTarget {
  /** Makes an engine in an audio context. Throws where the module or the audio thread cannot be had. */
  static async create(context) {
    const module = await warmUp(context);
    return new Engine(context, module);
  }

  /** Use `Engine.create`. */
  constructor(context, module) {
    super();
    this.context = context;
    this.module = module;
    this.name = `engine ${engines++}`;
    /**
     * Where dry sounds go in, the first with one or two channels and the others with one, and both ears come out. They stay
     * the same for good.
     */
    this.inputs = Array.from({ length: MOST_SOUNDS }, () => new GainNode(context));
    this.input = this.inputs[0];
    this.output = new GainNode(context);
    /** What has been loaded, by slot. */
    this.loaded = new Map();
    this.acks = new Map();
    this.acked = 0;
    this.values = new Map();
    this.offsets = new Map();
    this.dead = false;
    this.start();
  }

  start() {
    const { context, module } = this;
    if (this.node) this.end();
    this.node = new AudioWorkletNode(context, "promenade", {
      numberOfInputs: MOST_SOUNDS,
      numberOfOutputs: 1,
      outputChannelCount: [2],
      processorOptions: { module },
    });
    this.node.port.onmessage = ({ data }) => this.hear(data);
    this.node.onprocessorerror = () => this.die("the audio thread has stopped");
    const { port1, port2 } = new MessageChannel();
    preparer.call({ kind: "connect", port: port1 }, [port1]);
    this.node.port.postMessage({ kind: "decoder", port: port2 }, [port2]);
    this.inputs.forEach((input, sound) => input.connect(this.node, 0, sound));
    this.node.connect(this.output);
  }

  /** Ends the processor: the audio thread runs it, whatever it is connected to, until it says itself that it is done. */
  end() {
    // What it still has to say is of the past.
    this.node.port.onmessage = this.node.onprocessorerror = null;
    this.post({ kind: "close" });
    for (const input of this.inputs) input.disconnect();
    this.node.disconnect();
  }

  hear(data) {
    if (data.kind === "ack") {
      this.acks.get(data.ack)?.();
      this.acks.delete(data.ack);
    } else if (data.kind === "died") {
      this.die(data.text);
    } else {
      if (data.kind === "entered") {
        this.entering?.get(data.slot)?.(data);
        this.entering?.delete(data.slot);
      }
      this.dispatchEvent(new CustomEvent(data.kind, { detail: data }));
    }
  }

  die(text) {
    if (this.dead) return;
    this.dead = true;
    this.dispatchEvent(new CustomEvent("died", { detail: { text } }));
  }

  post(message, moved = []) {
    this.node.port.postMessage(message, moved);
  }

  /** Sends a message and waits until the audio thread has taken it. */
  tell(message, moved = []) {
    return new Promise((resolve) => {
      const ack = this.acked++;
      this.acks.set(ack, resolve);
      this.post({ ...message, ack }, moved);
    });
  }

  /**
   * Reads a scene and plays it, cross-fading from what was played over 50 ms.
   *
   * `bytes` is a scene file (ArrayBuffer or Uint8Array, not changed). Options: `slot` keeps it beside scenes of other
   * slots (by default they take each other's place), `hear: false` only makes it ready for `select`, `head` and
   * `headphones` are bytes, `secondEmitter` makes the setting stereoSpread possible for the first sound, `inline` decodes
   * poses on the audio thread, for offline contexts, `further` is how many sounds may be played beside the first, and
   * `accuracy` plays the least of a scene that stays within so many just noticeable differences, 0 for all of it.
   *
   * Gives the scene's description and points once it is played. Throws with the reason where the bytes are no scene.
   */
  async load(bytes, { slot = "main", hear = true, head, headphones, secondEmitter, inline, further, accuracy } = {}) {
    const options = { slot, hear, head, headphones, secondEmitter, inline, further, accuracy };
    const turn = (this.turn = (this.turn ?? 0) + 1);
    const name = `${this.name} ${slot} ${turn}`;
    const prepared = await preparer.call({
      kind: "prepare",
      name,
      rate: this.context.sampleRate,
      scene: bytes,
      head,
      headphones,
      secondEmitter,
      inline,
      further,
      accuracy,
    });
    const { memory, ...scene } = prepared;
    const before = this.loaded.get(slot);
    if (before && before.turn > turn) {
      preparer.call({ kind: "forget", name });
      return scene;
    }
    if (before) preparer.call({ kind: "forget", name: before.name });
    this.loaded.set(slot, { bytes, options, name, turn });
    this.dead = false;
    const rush = this.context.state !== "running";
    const entered = new Promise((resolve) => (this.entering ??= new Map()).set(slot, resolve));
    this.post({ kind: "memory", slot, name, memory, rush, hear }, [memory]);
    // Where the context is suspended, not every browser carries messages back.
    const patience = new Promise((resolve) => setTimeout(resolve, this.context.state === "running" ? 10_000 : 500));
    await Promise.race([entered, patience]);
    return scene;
  }

  /**
   * Hears another slot, cross-fading over 50 ms. `warm` names slots that are played silently, so that a change to
   * them keeps their room.
   */
  select(slot, warm = []) {
    if (!this.loaded.has(slot)) throw new Error(`nothing is loaded in slot "${slot}"`);
    this.post({ kind: "select", slot, warm });
  }

  /** Forgets what a slot holds. */
  drop(slot) {
    const { name } = this.loaded.get(slot) ?? {};
    if (name) preparer.call({ kind: "forget", name });
    this.loaded.delete(slot);
    this.post({ kind: "drop", slot });
  }

  /** Changes settings by name, in the units of `SETTINGS`. */
  set(values) {
    for (const [name, value] of Object.entries(values)) this.values.set(name, value);
    this.post({ kind: "set", values: numbers(values) });
  }

  /** Puts a sound, 0 for the first, some metres from where the scene has its own. */
  put(sound, offset) {
    this.offsets.set(sound, offset);
    this.post({ kind: "put", sound, offset });
  }

  /** The listener's pose, taken at a time of `performance.now()`, seconds. Poses are glided between, sample by sample. */
  pose(position, quaternion, at = performance.now() / 1000) {
    this.last = [...position, ...quaternion];
    this.post({ kind: "pose", pose: this.last, at });
  }

  /** The listener is somewhere else at once. */
  jump(position, quaternion) {
    this.last = [...position, ...quaternion];
    this.post({ kind: "jump", pose: this.last });
  }

  /** Takes a path: rows of seconds, x, y, z, and quaternion x, y, z, w; an empty array takes it away. */
  setPath(rows) {
    this.rows = Float64Array.from(rows.flat());
    this.post({ kind: "way", rows: this.rows });
  }

  /** Walks the path; with `ownHead` it moves the listener and poses turn the head. */
  walk({ from = 0, speed = 1, loop = false, ownHead = false } = {}) {
    this.post({ kind: "walk", from, speed, flags: (loop ? 1 : 0) + (ownHead ? 2 : 0) });
  }

  /** Leaves the path, where the listener is. */
  stop() {
    this.post({ kind: "stop" });
  }

  /** Is as new: the same sound and path give the same samples again. */
  reset() {
    return this.tell({ kind: "reset" });
  }

  /** After `died`: starts again with the scenes, settings and pose that it had. */
  async revive() {
    this.start();
    this.dead = false;
    this.post({ kind: "set", values: numbers(Object.fromEntries(this.values)) });
    for (const [sound, offset] of this.offsets) this.post({ kind: "put", sound, offset });
    if (this.rows) this.post({ kind: "way", rows: this.rows });
    if (this.last) this.post({ kind: "jump", pose: this.last });
    for (const { bytes, options } of [...this.loaded.values()]) await this.load(bytes, options);
  }

  /** Lets go of everything. */
  close() {
    for (const { name } of this.loaded.values()) preparer.call({ kind: "forget", name });
    this.loaded.clear();
    this.end();
    this.output.disconnect();
  }
}
