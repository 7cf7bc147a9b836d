// The pages in Firefox, by hand: a place that is heard while somebody walks, and a study of pictures beside a sound and of two
// scenes, to its last answer.
//
//   node --experimental-websocket tests/browser/firefox.mjs PROMENADE ENGINE [FIREFOX] [PICTURES]
//
// In the root of the repository. FIREFOX is the program, 128 or newer; it is driven by WebDriver BiDi, whose commands are those
// of its standard, since Playwright drives a Firefox of its own making alone. It needs a sound server (PulseAudio with a null sink
// will do). Where it has no WebGL 2, the study has files of sound in place of pictures, and that is said. PICTURES is a folder for what was seen.

import { spawn } from "node:child_process";
import { copyFileSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { noise, writeWav } from "./sound.mjs";
import { check, run, runTests, serve } from "./steps.mjs";

const [program, engine, firefox = "/usr/bin/firefox-esr", pictures] = process.argv.slice(2);
const root = process.cwd();
const folder = mkdtempSync(join(tmpdir(), "promenade-firefox-"));
const scene = (name) => join(root, `presets/library/${name}.promenade`);
const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const CLICK = { type: "pointer", id: "mouse", parameters: { pointerType: "mouse" } };

/** A Firefox and one page of it. */
class Firefox {
  static async launch() {
    const profile = join(folder, "profile");
    const args = ["--headless", "--no-remote", "--remote-debugging-port", "0", "--profile", profile, "--new-instance"];
    mkdirSync(profile);
    const browser = new Firefox();
    browser.process = spawn(firefox, args, { stdio: ["ignore", "ignore", "pipe"] });
    const address = await new Promise((resolve, reject) => {
      let said = "";
      browser.process.on("exit", () => reject(new Error(`${firefox} ended: ${said.slice(-500)}`)));
      browser.process.stderr.on("data", (more) => {
        said += more;
        const found = /BiDi listening on (ws:\S+)/.exec(said);
        if (found) resolve(found[1]);
      });
    });
    Object.assign(browser, { waiting: new Map(), errors: [], socket: new WebSocket(`${address}/session`) });
    await new Promise((resolve) => browser.socket.addEventListener("open", resolve));
    browser.socket.addEventListener("message", ({ data }) => {
      const { id, type, error, message, result, method, params } = JSON.parse(data);
      if (method === "log.entryAdded" && params.level === "error") browser.errors.push(params.text);
      const waits = browser.waiting.get(id);
      browser.waiting.delete(id);
      if (waits) type === "error" ? waits.reject(new Error(`${error}: ${message}`)) : waits.resolve(result);
    });
    const { capabilities } = await browser.send("session.new", { capabilities: {} });
    browser.version = capabilities.browserVersion;
    await browser.send("session.subscribe", { events: ["log.entryAdded"] });
    browser.context = (await browser.send("browsingContext.getTree", {})).contexts[0].context;
    await browser.send("browsingContext.setViewport", { context: browser.context, viewport: { width: 1280, height: 860 } });
    return browser;
  }

  send(method, params) {
    const id = (this.count = (this.count ?? 0) + 1);
    this.socket.send(JSON.stringify({ id, method, params }));
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
  }

  open(url) {
    this.errors.length = 0;
    return this.send("browsingContext.navigate", { context: this.context, url, wait: "complete" });
  }

  /** The value of an expression in the page, as JSON. */
  async value(expression) {
    const target = { context: this.context };
    const code = `(async () => JSON.stringify(await (${expression})) ?? "null")()`;
    const { type, result, exceptionDetails } = await this.send("script.evaluate", { expression: code, target, awaitPromise: true });
    if (type === "exception") throw new Error(`${expression}: ${exceptionDetails.text}`);
    return JSON.parse(result.value);
  }

  async until(expression, what = expression) {
    for (const end = Date.now() + 40_000; Date.now() < end; await pause(100)) {
      const value = await this.value(expression).catch(() => null);
      if (value) return value;
    }
    const said = await this.value("document.body.innerText.slice(0, 400)");
    throw new Error(`not within 40 s: ${what}; the page says: ${said} ${this.errors.join()}`);
  }

  act(...actions) {
    return this.send("input.performActions", { context: this.context, actions });
  }

  /** Clicks an element as somebody does. */
  async click(selector) {
    await this.until(`document.querySelector(${JSON.stringify(selector)})?.disabled === false`, `${selector} is enabled`);
    const middle = `(() => {
      const element = document.querySelector(${JSON.stringify(selector)});
      element.scrollIntoView({ block: "center" });
      const { x, y, width, height } = element.getBoundingClientRect();
      return [x + width / 2, y + height / 2].map(Math.round);
    })()`;
    const [x, y] = await this.value(middle);
    const press = ["pointerDown", "pointerUp"].map((type) => ({ type, button: 0 }));
    await this.act({ ...CLICK, actions: [{ type: "pointerMove", x, y }, ...press] });
  }

  /** Holds a key for some time. */
  key(value, duration = 30) {
    const actions = [{ type: "keyDown", value }, { type: "pause", duration }, { type: "keyUp", value }];
    return this.act({ type: "key", id: "keys", actions });
  }

  async photograph(name) {
    if (!pictures) return;
    const { data } = await this.send("browsingContext.captureScreenshot", { context: this.context });
    writeFileSync(join(pictures, `firefox-${name}.png`), Buffer.from(data, "base64"));
  }

  close() {
    this.socket.close();
    this.process.removeAllListeners("exit");
    this.process.kill();
  }
}

const browser = await Firefox.launch();
console.log(`Firefox ${browser.version}`);

const tests = {
  async "a place is heard while somebody walks in it"() {
    const site = join(folder, "site");
    run(program, "web", scene("living-room"), "--dry", join(root, "data/speech.wav"), "--engine", engine, "-o", site);
    const server = await serve(site);
    await browser.open(server.address);
    await browser.until("document.documentElement.dataset.ready");
    await browser.click("#listen");
    await browser.until("document.documentElement.dataset.sound === 'running'", "sound");
    await browser.value(`promenade.voices.addEventListener("report", ({ detail }) =>
      (globalThis.loudest = Math.max(globalThis.loudest ?? 0, ...detail.peaks))) ?? true`);
    const where = () => browser.value("promenade.listener.position");
    const before = await where();
    await browser.value("document.querySelector('canvas').focus() ?? true");
    await browser.key("\uE013", 1500);
    const after = await where();
    const loudest = await browser.until("globalThis.loudest > 1e-3 && globalThis.loudest", "a level");
    await browser.photograph("place");
    const far = Math.hypot(...after.map((v, i) => v - before[i]));
    check(far > 0.5, `the listener walks ${far.toFixed(2)} m`);
    check(browser.errors.length === 0, browser.errors.join("\n"));
    server.stop();
    return `${far.toFixed(2)} m, peak ${loudest.toFixed(3)}`;
  },

  async "a study of pictures and of scenes ends with its answers in the file"() {
    const burst = noise(24_000, 0.3);
    const sound = Float32Array.from({ length: 3 * 48_000 }, (_, i) => burst[i - 48_000] ?? 0);
    writeWav(join(folder, "mix.wav"), 48_000, [sound, sound]);
    writeWav(join(folder, "other.wav"), 48_000, [sound.toReversed()]);
    for (const name of ["walk", "editor"]) copyFileSync(join(root, "docs/pictures/orbit-dark.png"), join(folder, `${name}.png`));
    const shown = { name: "room", sound: "mix.wav", conditions: { one: "walk.png", two: ["walk.png", "editor.png"] } };
    const rooms = { living: scene("living-room"), studio: scene("dry-studio") };
    const live = { name: "rooms", dry: "mix.wav", reference: scene("living-room"), conditions: rooms };
    const draws = await browser.value("document.createElement('canvas').getContext('webgl2') !== null");
    const files = { name: "files", conditions: { one: "mix.wav", two: "other.wav" } };
    const parts = [draws ? shown : files, live].map((item) => ({ method: "paired", listen_s: 0.3, items: [item] }));
    const study = { study: "firefox", title: "Which is nearer?", headphones: false, post: true, language: "de", parts };
    const [file, site, answers] = ["json", "study", "csv"].map((kind) => join(folder, `study.${kind}`));
    writeFileSync(file, JSON.stringify(study));
    run(program, "study", file, "-o", site, "--engine", engine);
    const server = spawn(program, ["study", "serve", site, "--answers", answers, "--listen", "127.0.0.1:0"]);
    const port = await new Promise((resolve) => server.stdout.once("data", (said) => resolve(/:(\d+)\//.exec(said)[1])));
    await browser.open(`http://localhost:${port}/`);
    await browser.click("button.go");
    const first = draws ? "canvas.picture" : ".sounds";
    for (const [trial, view] of [["1 von 2", first], ["2 von 2", ".plan canvas"]]) {
      await browser.until(`document.body.innerText.includes("${trial}") && document.querySelector("${view}") !== null`, trial);
      for (let i = 1; i <= (view.startsWith(".plan") ? 3 : 2); i++) {
        await browser.key(String(i));
        await browser.until(`document.querySelectorAll(".sounds button.heard").length >= ${i}`, `sound ${i} is heard`);
      }
      const weight = "Number(document.querySelector('canvas.picture').dataset.weight)";
      if (view === "canvas.picture") await browser.until(`${weight} > 0.5`);
      if (view === ".plan canvas") await browser.key("\uE013", 600);
      await browser.photograph(trial.replaceAll(" ", "-"));
      await browser.key("j");
      await browser.until("document.querySelector('button.answer[aria-pressed=true]')", "an answer");
      await browser.value("document.activeElement.blur() ?? true");
      await browser.key("\uE006");
    }
    await browser.until("document.body.innerText.includes('Ihre Antworten sind gesendet')", "answers are sent");
    const rows = readFileSync(answers, "utf8").trim().split("\n").slice(1);
    check(rows.length === 2, rows.join("\n"));
    check(browser.errors.length === 0, browser.errors.join("\n"));
    server.kill();
    return `${rows.length} answers${draws ? "" : "; pictures were not tried: no WebGL 2"}`;
  },
};

const passed = await runTests(tests);
browser.close();
await pause(500);
rmSync(folder, { recursive: true, force: true });
process.exit(passed ? 0 : 1);
