// How long a page keeps somebody waiting on a line of a given rate: bytes, the first picture, the first sound.
//
//   node tests/browser/loading.mjs ADDRESS [MBIT] [TIMES]
//
// ADDRESS is of a page of `promenade web`, served in any way. "Listen" is clicked as soon as it is there and then every 300 ms
// until sound comes, as somebody does. Times are from the first request on, medians of TIMES visits (5), 40 ms from here to the
// server and back.

import { launch } from "./steps.mjs";

const [address, mbit = "10", times = "5"] = process.argv.slice(2);
const browser = await launch();
const found = [];
for (let visit = 0; visit < Number(times); visit++) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 860 } });
  const page = await context.newPage();
  const line = await context.newCDPSession(page);
  await line.send("Network.enable");
  const bytesPerSecond = (Number(mbit) * 1e6) / 8;
  const rate = { downloadThroughput: bytesPerSecond, uploadThroughput: bytesPerSecond };
  await line.send("Network.emulateNetworkConditions", { offline: false, latency: 40, ...rate });
  let bytes = 0;
  line.on("Network.loadingFinished", ({ encodedDataLength }) => (bytes += encodedDataLength));
  await page.addInitScript(() => {
    // Sound is heard where the samples that go to the ears are not silent.
    const connect = AudioNode.prototype.connect;
    AudioNode.prototype.connect = function (to, ...rest) {
      if (to === this.context.destination) {
        globalThis.ears ??= new AnalyserNode(this.context, { fftSize: 2048 });
        connect.call(this, globalThis.ears);
      }
      return connect.call(this, to, ...rest);
    };
    const samples = new Float32Array(2048);
    const look = () => {
      globalThis.ears?.getFloatTimeDomainData(samples);
      if (samples.some((v) => Math.abs(v) > 1e-4)) globalThis.sounded ??= performance.now();
      else setTimeout(look, 5);
    };
    look();
    // A picture is there where the page has drawn its place.
    const draw = () => {
      if (document.documentElement?.dataset.ready) globalThis.pictured ??= performance.now();
      else requestAnimationFrame(draw);
    };
    draw();
  });
  await page.goto(address, { waitUntil: "commit" });
  const listen = page.locator("#listen");
  await listen.waitFor({ timeout: 60_000 });
  for (let tries = 0; tries < 200; tries++) {
    if (await page.evaluate(() => globalThis.sounded !== undefined)) break;
    if ((await page.evaluate(() => document.documentElement.dataset.sound)) !== "running") {
      await listen.click({ timeout: 200 }).catch(() => {});
    }
    await page.waitForTimeout(300);
  }
  const moments = await page.evaluate(() => {
    const [painted] = performance.getEntriesByName("first-contentful-paint");
    return { painted: painted?.startTime, pictured: globalThis.pictured, sounded: globalThis.sounded };
  });
  found.push({ ...moments, bytes });
  await context.close();
}
await browser.close();
const median = (name) => found.map((visit) => visit[name] ?? Infinity).sort((a, b) => a - b)[Math.floor(found.length / 2)];
const seconds = (name) => `${(median(name) / 1000).toFixed(2)} s`;
console.log(
  `${mbit} Mbit/s: ${(median("bytes") / 1e6).toFixed(2)} MB until sound, first paint ${seconds("painted")}, ` +
    `the place drawn ${seconds("pictured")}, first sound ${seconds("sounded")}`,
);
