// Plays scenes in an offline audio context of the page, with the page's own engine.

/**
 * Runs in the page: plays `sound` (samples in base64, as they pass quickest) in a scene and gives both ears, as well in base64,
 * and the latency, samples.
 */
async function playInPage({ scene, sound, rate, path, messages, settings, inline, reset, second }) {
  const { Engine } = await import("/engine/engine.js");
  const input = new Float32Array(Uint8Array.from(atob(sound), (c) => c.charCodeAt(0)).buffer);
  const text = (samples) => {
    const bytes = new Uint8Array(samples.buffer);
    let binary = "";
    for (let i = 0; i < bytes.length; i += 32_768) binary += String.fromCharCode(...bytes.subarray(i, i + 32_768));
    return btoa(binary);
  };
  const seconds = input.length / rate;
  const context = new OfflineAudioContext({
    numberOfChannels: 2,
    length: input.length * (reset ? 2 : 1),
    sampleRate: rate,
  });
  const engine = await Engine.create(context);
  const entered = new Promise((resolve) => engine.addEventListener("entered", ({ detail }) => resolve(detail.latency)));
  engine.output.connect(context.destination);
  const bytes = await (await fetch(scene)).arrayBuffer();
  const { description } = await engine.load(bytes, { inline });
  const latency = Math.round((await entered) * rate);
  if (second) {
    await engine.load(await (await fetch(second.scene)).arrayBuffer(), { slot: "second", hear: false, inline });
    engine.select("main", ["second"]);
  }
  engine.set(settings ?? {});
  if (path) {
    engine.setPath(path);
    engine.walk();
  }
  const buffer = new AudioBuffer({ length: input.length, sampleRate: rate });
  buffer.copyToChannel(input, 0);
  const source = new AudioBufferSourceNode(context, { buffer, loop: Boolean(reset) });
  source.connect(engine.input);
  source.start();
  await engine.tell({ kind: "set", values: [] });
  if (reset)
    context
      .suspend(seconds)
      .then(() => engine.reset())
      .then(() => context.resume());
  if (second) {
    context.suspend(second.at).then(async () => {
      engine.select("second", ["main"]);
      await engine.tell({ kind: "set", values: [] });
      context.resume();
    });
  }
  for (const { at, sent, pose } of messages ?? []) {
    context.suspend(at).then(async () => {
      engine.pose(pose.slice(0, 3), pose.slice(3), sent);
      await engine.tell({ kind: "set", values: [] });
      context.resume();
    });
  }
  const played = await context.startRendering();
  return { ears: [0, 1].map((c) => text(played.getChannelData(c))), latency, description };
}

/** Both ears of a scene that plays `input`. */
export async function play(page, { input, ...options }) {
  const sound = Buffer.from(input.buffer, input.byteOffset, input.byteLength).toString("base64");
  const played = await page.evaluate(playInPage, { ...options, sound });
  const samples = (text) => new Float32Array(Uint8Array.from(Buffer.from(text, "base64")).buffer);
  return { ...played, ears: played.ears.map(samples) };
}
