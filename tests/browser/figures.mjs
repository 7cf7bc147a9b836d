// Figures of the page, for documents: cost of a block beside the program's, bytes, seconds from click to sound, interruptions.
//
//   node tests/browser/figures.mjs PROMENADE ENGINE BLOCK_COST [SECONDS]
//
// BLOCK_COST is the example of that name (cargo build --release -p promenade-web --example block_cost); "-" leaves costs out.
// The machine's load is in all of them: run it on an idle one, and compare ratios.

import { mkdtempSync, readFileSync, readdirSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { brotliCompressSync, gzipSync } from "node:zlib";
import { noise } from "./sound.mjs";
import { launch, open, run, serve, until } from "./steps.mjs";

const [program, engine, native, given] = process.argv.slice(2);
const seconds = Number(given ?? 60);
const root = process.cwd();
const folder = mkdtempSync(join(tmpdir(), "promenade-figures-"));
const site = join(folder, "site");
const SCENES = {
  "living room": "presets/library/living-room.promenade",
  box: "presets/scenes/box.promenade",
  "Room A": "presets/scenes/iosr-room-a.promenade",
};
run(
  program,
  "web",
  ...Object.values(SCENES).map((s) => join(root, s)),
  "--dry",
  join(root, "data/speech.wav"),
  "--path",
  join(root, "presets/paths/walk.json"),
  "--engine",
  engine,
  "-o",
  site,
);
const contents = JSON.parse(readFileSync(join(site, "site.json")));

// Bytes.
const own = readdirSync(site, { recursive: true }).filter(
  (f) => statSync(join(site, f)).isFile() && !/^(scenes|sounds|paths)\//.test(f),
);
const total = (pack) => own.reduce((sum, f) => sum + pack(readFileSync(join(site, f))).length, 0);
console.log(
  `page and engine: ${total((b) => b)} bytes, gzip ${total((b) => gzipSync(b, { level: 9 }))}, ` +
    `brotli ${total((b) => brotliCompressSync(b))}`,
);
console.log(`engine alone: ${statSync(engine).size} bytes, gzip ${gzipSync(readFileSync(engine), { level: 9 }).length}`);

// Cost of a block, processor time of this thread here and of the program there.
const { Instance } = await import(
  `data:text/javascript,${encodeURIComponent(readFileSync(join(site, "engine/module.js"), "utf8"))}`
);
const module = new WebAssembly.Module(readFileSync(engine));
const rows = Float64Array.from(JSON.parse(readFileSync(join(site, contents.paths[0].file))).flat());
const RATE = 48_000;
const BLOCKS = 375 * 24;
const input = noise(128 * BLOCKS, 0.25);
/** Milliseconds that a block takes with so many sounds, 1 m apart. */
function cost(scene, sounds) {
  const instance = new Instance(module);
  instance.f.start(RATE);
  instance.take("load", readFileSync(join(root, scene)), 2, sounds - 1, 0);
  instance.take("path", rows);
  instance.f.walk(0, 1, 1);
  for (let sound = 1; sound < sounds; sound++) instance.f.put(sound, 0, sound - sounds / 2, 0);
  const play = (count) => {
    for (let i = 0; i < count; i++) {
      const { inputs } = instance.views();
      for (const [sound, samples] of inputs.entries()) {
        const at = (128 * (i + 997 * sound)) % (input.length - 128);
        if (sound !== 1) samples.set(input.subarray(at, at + 128));
      }
      instance.f.process(1, 2 ** (sounds - 1) - 1, 128);
    }
  };
  play(2000);
  const before = process.cpuUsage();
  play(BLOCKS);
  return process.cpuUsage(before).user / 1000 / BLOCKS;
}
for (const [name, scene] of Object.entries(SCENES)) {
  const here = cost(scene, 1);
  console.log(
    `${name}: a block of 128 (2.667 ms) takes ${here.toFixed(4)} ms; with eight sounds in one engine ` +
      `${(cost(scene, 8) / here).toFixed(2)} times as long`,
  );
  if (native === "-") continue;
  const there = Number(run(native, join(root, scene), BLOCKS, join(site, contents.paths[0].file)));
  console.log(`  compiled for this machine ${there.toFixed(4)} ms: here ${(here / there).toFixed(2)} times as long`);
}

const server = await serve(site);
const browser = await launch();

// From click to sound.
for (const [name, wait] of [
  ["cold", false],
  ["warm", true],
]) {
  const times = [];
  for (let i = 0; i < 5; i++) {
    const context = await browser.newContext();
    const page = await context.newPage();
    await page.addInitScript(() => {
      addEventListener("click", () => (globalThis.clicked = performance.now()), true);
      const timer = setInterval(() => {
        const { promenade } = globalThis;
        if (!promenade?.voices?.voices[0]?.room || globalThis.listens) return;
        globalThis.listens = true;
        clearInterval(timer);
        promenade.voices.addEventListener("report", ({ detail }) => {
          if (globalThis.clicked && !globalThis.sounded && Math.max(...detail.peaks) > 1e-4)
            globalThis.sounded = performance.now();
        });
      }, 1);
    });
    await page.goto(server.address, { waitUntil: wait ? "load" : "commit" });
    if (wait) await page.waitForFunction(() => document.documentElement.dataset.ready);
    await page.locator("#listen").click();
    await page.waitForFunction(() => globalThis.sounded, null, { timeout: 20_000 });
    times.push(await page.evaluate(() => sounded - clicked));
    await context.close();
  }
  times.sort((a, b) => a - b);
  console.log(`${name}: from click to sound ${times[2].toFixed(0)} ms (${times[0].toFixed(0)} to ${times[4].toFixed(0)})`);
}

// Interruptions.
const page = await open(browser, server.address);
await page.click("#listen");
await until(page, "sound", () => document.documentElement.dataset.sound === "running");
await page.evaluate(() => promenade.output.context.playbackStats?.resetLatency?.());
const stats = () => page.evaluate(() => promenade.output.context.playbackStats?.toJSON());
const before = await stats();
let changes = 0;
const end = Date.now() + 1000 * seconds;
await page.click("#path-play");
while (Date.now() < end) {
  await page.waitForTimeout(4000);
  changes++;
  await page.selectOption("#scene", String(changes % 3));
}
const after = await stats();
console.log(
  `interruptions over ${seconds} s with ${changes} changes of scene: ${after.underrunEvents - before.underrunEvents}, ` +
    `${((after.underrunDuration - before.underrunDuration) * 1000).toFixed(0)} ms in all`,
);
await browser.close();
server.stop();
rmSync(folder, { recursive: true });
