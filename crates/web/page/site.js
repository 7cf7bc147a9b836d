// What the site has: scenes, dry sounds, paths, heads and headphones, by site.json and as bytes.

/** Bytes or a page of the site. Throws in words where there are none. */
async function get(file) {
  let response;
  try {
    response = await fetch(file);
  } catch {
    throw new Error(`${file} cannot be had: the server does not answer`);
  }
  if (!response.ok) throw new Error(`${file} cannot be had: the server answers ${response.status}`);
  return response;
}

export class Site {
  static async open() {
    return new Site(await (await get("site.json")).json());
  }

  constructor(contents) {
    Object.assign(this, { scenes: [], sounds: [], paths: [], heads: [], headphones: [] }, contents);
    this.kept = new Map();
  }

  /** The bytes of a file of the site, fetched once; `progress(bytes)` is called with those that have come of all files. */
  bytes(file) {
    if (!this.kept.has(file)) {
      const asked = get(file).then((response) => this.read(response));
      asked.catch(() => this.kept.delete(file));
      this.kept.set(file, asked);
    }
    return this.kept.get(file);
  }

  async read(response) {
    const counted = new TransformStream({
      transform: (piece, out) => {
        this.received = (this.received ?? 0) + piece.length;
        this.progress?.(this.received);
        out.enqueue(piece);
      },
    });
    return new Response(response.body.pipeThrough(counted)).arrayBuffer();
  }

  /** JSON of a file of the site. */
  async json(file) {
    return JSON.parse(new TextDecoder().decode(await this.bytes(file)));
  }
}
