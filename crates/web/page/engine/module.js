// The WebAssembly module's functions with names and types, for the audio thread and for Workers alike. Worklets have no
// TextDecoder.

const UTF8_PIECE = 4096;

/** One instance of the module: one scene at one sample rate. */
export class Instance {
  /** @param {WebAssembly.Module} module compiled from promenade.wasm */
  constructor(module) {
    this.f = new WebAssembly.Instance(module, {}).exports;
    this.buffer = null;
  }

  /** Bytes of its memory. */
  get size() {
    return this.f.memory.buffer.byteLength;
  }

  /** Makes its memory as large as another's that will be copied into it. */
  grow(size) {
    const missing = size - this.size;
    if (missing > 0) this.f.memory.grow(Math.ceil(missing / 65536));
  }

  /** Writes bytes into the module's room; the next function takes them. Throws where they are too many. */
  write(bytes) {
    const at = this.f.room(bytes.byteLength);
    if (at === 0 && bytes.byteLength > 0) throw new Error(this.text());
    const view = new Uint8Array(bytes.buffer ?? bytes, bytes.byteOffset ?? 0, bytes.byteLength);
    new Uint8Array(this.f.memory.buffer, at, bytes.byteLength).set(view);
  }

  /** Calls a function that returns 1 for success, with bytes in the room; throws its text otherwise. */
  take(name, bytes, ...rest) {
    this.write(bytes);
    if (this.f[name](...rest) !== 1) throw new Error(this.text());
  }

  /** What the last call that failed had to say, or the description. */
  text() {
    const bytes = new Uint8Array(this.f.memory.buffer, this.f.text(), this.f.text_len());
    let binary = "";
    for (let i = 0; i < bytes.length; i += UTF8_PIECE) {
      binary += String.fromCharCode(...bytes.subarray(i, i + UTF8_PIECE));
    }
    return decodeURIComponent(escape(binary));
  }

  /** A copy of the row that `points` or `decode` made. */
  row(at) {
    return new Float32Array(this.f.memory.buffer, at, this.f.points_len()).slice();
  }

  /**
   * Views of inputs (both channels of the first sound, one of each further one) and ears; memory that has grown needs new
   * ones.
   */
  views() {
    const { buffer } = this.f.memory;
    if (this.buffer !== buffer) {
      this.buffer = buffer;
      const view = (at) => new Float32Array(buffer, at, 1024);
      this.inputs = [];
      for (let at; (at = this.f.input(this.inputs.length)) !== 0; ) this.inputs.push(view(at));
      this.ears = [view(this.f.ear(0)), view(this.f.ear(1))];
    }
    return this;
  }

  /** The pose that is played (x, y, z, and the quaternion's x, y, z, w) and the seconds along a path, below 0 off it. */
  heard() {
    return Array.from(new Float32Array(this.f.memory.buffer, this.f.heard(), 8));
  }
}
