// A browser, a plain static server, and tests one after the other.

import { spawn, spawnSync } from "node:child_process";
import { createServer } from "node:net";
import { chromium } from "playwright-core";

const CHROMIUM = process.env.PROMENADE_CHROMIUM ?? "/usr/bin/chromium";

const freePort = () =>
  new Promise((resolve) => {
    const probe = createServer().listen(0, "127.0.0.1", () => {
      const { port } = probe.address();
      probe.close(() => resolve(port));
    });
  });

/** Python's own server on a folder: it sends no header that helps. Gives its address and what ends it. */
export async function serve(folder) {
  const port = await freePort();
  const server = spawn("python3", ["-m", "http.server", String(port), "--bind", "127.0.0.1", "--directory", folder], {
    stdio: "ignore",
  });
  const address = `http://localhost:${port}/`;
  for (let i = 0; i < 100; i++) {
    if (
      await fetch(address).then(
        () => true,
        () => false,
      )
    )
      return { address, stop: () => server.kill() };
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  server.kill();
  throw new Error("python3 -m http.server does not answer");
}

export const launch = () =>
  chromium.launch({
    executablePath: CHROMIUM,
    args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--use-fake-device-for-media-stream"],
  });

/** A page that has been opened and is ready; requests to other hosts fail the test. */
export async function open(browser, address, options = {}) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 860 }, ...options });
  page.foreign = [];
  page.errors = [];
  page.on("request", (request) => {
    const url = new URL(request.url());
    if (url.hostname !== "localhost" && !["data:", "blob:"].includes(url.protocol)) page.foreign.push(request.url());
  });
  page.on("pageerror", (error) => page.errors.push(error.message));
  if (options.script) await page.addInitScript(options.script);
  await page.goto(address);
  await page.waitForFunction(() => document.documentElement.dataset.ready, null, { timeout: 60_000 });
  return page;
}

/** Runs a program; gives what it printed, or throws with what it complained of. */
export function run(program, ...args) {
  const done = spawnSync(program, args.map(String), { encoding: "utf8" });
  if (done.status !== 0) throw new Error(`${program} ${args.join(" ")}: ${done.error ?? done.stderr}`);
  return done.stdout;
}

export function check(holds, words) {
  if (!holds) throw new Error(words);
}

/** Waits until something holds in the page. */
export async function until(page, what, test, argument) {
  try {
    await page.waitForFunction(test, argument, { timeout: 30_000 });
  } catch {
    const messages = await page.locator("#messages").innerText();
    throw new Error(`${what}: not within 30 s; messages: ${messages || "none"}`);
  }
}

/** Runs tests by name and counts them. */
export async function runTests(tests, only) {
  const counts = { passed: 0, failed: 0 };
  for (const [name, test] of Object.entries(tests)) {
    if (only && !name.includes(only)) continue;
    const began = Date.now();
    try {
      const said = await test();
      counts.passed++;
      const seconds = ((Date.now() - began) / 1000).toFixed(1);
      console.log(`ok      ${name}${said ? `: ${said}` : ""} (${seconds} s)`);
    } catch (error) {
      counts.failed++;
      console.log(`FAILED  ${name}: ${error.message.split("\n").slice(0, 4).join("\n")}`);
    }
  }
  console.log(`${counts.passed} passed, ${counts.failed} failed`);
  return counts.failed === 0;
}
