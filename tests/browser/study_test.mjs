// The page of `promenade study` in Chromium: a study from its welcome to the report of its answers.
//
//   node tests/browser/study_test.mjs PROMENADE ENGINE [NAME]
//
// In the root of the repository. PROMENADE is the program, ENGINE the module; NAME runs the tests whose names contain it.
// With PROMENADE_PICTURES each kind of page is photographed into that folder.

import { spawn } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { noise, tone, writeWav } from "./sound.mjs";
import { check, launch, open, run, runTests } from "./steps.mjs";

const [program, engine, only] = process.argv.slice(2);
const pictures = process.env.PROMENADE_PICTURES;
const root = process.cwd();
const folder = mkdtempSync(join(tmpdir(), "promenade-study-"));
const RATE = 48_000;

[
  ["reference", 220, 0.2],
  ["near", 220, 0.1],
  ["far", 660, 0.3],
].forEach(([name, hz, gain]) => writeWav(join(folder, `${name}.wav`), RATE, [tone(hz, RATE, RATE, gain)]));
const files = { name: "tones", reference: "reference.wav", conditions: { near: "near.wav", far: "far.wav" } };
const scene = (name) => join(root, `presets/library/${name}.promenade`);
const rooms = {
  name: "rooms",
  dry: "reference.wav",
  reference: scene("living-room"),
  conditions: { living: scene("living-room"), studio: scene("dry-studio") },
};
const quick = { listen_s: 0.2 };
const study = {
  study: "both",
  title: "Which room is nearer?",
  welcome: "You compare sounds.\n\nIt takes five minutes.",
  consent: "I take part of my own will.",
  seed: 5,
  post: true,
  parts: [
    { method: "paired", title: "Pairs", intro: "The reference comes before each.", seconds: 0.3, items: [files] },
    { method: "abx", repeats: 2, ...quick, items: [{ name: "tones", conditions: files.conditions }] },
    { method: "rating", anchor: true, ...quick, items: [files] },
    { method: "paired", ...quick, items: [rooms] },
    { method: "rating", anchor: true, ...quick, items: [rooms] },
  ],
};
/** Rows of a person: two pairs, two ABX, two times five ratings. */
const ROWS = 2 + 2 + 10;

/** Writes a study and starts its server; gives its address, its file of answers, and what ends it. */
async function serve(made) {
  const [file, site, answers] = ["json", "site", "csv"].map((kind) => join(folder, `${made.study}.${kind}`));
  writeFileSync(file, JSON.stringify(made));
  run(program, "study", file, "-o", site, "--engine", engine);
  const server = spawn(program, ["study", "serve", site, "--answers", answers, "--listen", "127.0.0.1:0"]);
  const port = await new Promise((resolve) => server.stdout.once("data", (said) => resolve(/:(\d+)\//.exec(said)[1])));
  return { address: `http://localhost:${port}/`, answers, stop: () => server.kill() };
}

const browser = await launch();
const server = await serve(study);
/** What is sent to the ears is seen by an analyser too. */
const listen = `{
  const connect = AudioNode.prototype.connect;
  AudioNode.prototype.connect = function (to, ...rest) {
    if (to === this.context.destination && this.context instanceof AudioContext) {
      globalThis.heard ??= new AnalyserNode(this.context, { fftSize: 32768 });
      connect.call(this, globalThis.heard);
    }
    return connect.call(this, to, ...rest);
  };
}`;

let photographs = 0;
async function photograph(page, name) {
  if (pictures) await page.screenshot({ path: join(pictures, `${++photographs}-${name}.png`), fullPage: true });
}

const heading = (page) => page.locator("h2").innerText();
const click = (page, name) => page.getByRole("button", { name, exact: true }).click();

async function begin(page) {
  await page.getByRole("checkbox").check();
  await click(page, "Begin");
}

/** The headphone check, answered rightly or always with the antiphase tone, as through loudspeakers. */
async function screen(page, person, rightly) {
  await page.waitForSelector("text=This study needs headphones");
  await click(page, "Begin");
  const trials = await page.evaluate(
    async ([seed, name]) => {
      const [{ screening }, { chance }] = await Promise.all([import("./headphones.js"), import("./random.js")]);
      return screening(chance(`${seed}/headphones/${name}`));
    },
    [study.seed, person],
  );
  for (const [number, { soft, antiphase }] of trials.entries()) {
    await page.waitForSelector(`text=${number + 1} of 6`);
    await click(page, "Play");
    if (number === 0) await photograph(page, "headphones");
    await page.locator(`.sounds button:nth-child(${(rightly ? soft : antiphase) + 1}):enabled`).click();
  }
}

/** Hears every sound of a trial by its key. */
async function hearAll(page, pause = "Pause") {
  await page.waitForSelector(".sounds button", { timeout: 30_000 });
  const count = await page.locator(`.sounds button:not(:text-is('${pause}'))`).count();
  for (let i = 0; i < count; i++) {
    await page.keyboard.press(String(i + 1));
    await page.waitForFunction((at) => document.querySelectorAll(".sounds button.heard").length > at, i);
  }
}

async function pair(page, name, answer) {
  const begin = page.getByRole("button", { name: "Begin", exact: true });
  await begin.or(page.getByText("Keys:")).first().waitFor({ timeout: 60_000 });
  if (await begin.count()) await click(page, "Begin");
  await page.waitForSelector("text=Keys:", { timeout: 30_000 });
  if (await page.locator("canvas").count()) await hearAll(page);
  await photograph(page, name);
  await choose(page, answer);
}

/** Chooses an answer by its key, and goes on. */
async function choose(page, answer) {
  await page.waitForSelector("button.answer:enabled");
  await page.keyboard.press(answer);
  await page.waitForSelector("button.answer[aria-pressed=true]");
  await page.evaluate(() => document.activeElement.blur());
  await page.keyboard.press("Enter");
}

async function rate(page, name, next = "Next", pause = "Pause") {
  await page.waitForSelector(".rating input[type=range]", { timeout: 30_000 });
  await hearAll(page, pause);
  const sliders = page.locator("input[type=range]");
  check(await page.getByRole("button", { name: next }).isDisabled(), "a rating must be given");
  for (let i = 0; i < (await sliders.count()); i++) {
    await sliders.nth(i).focus();
    for (let k = 0; k <= 5 * i; k++) await page.keyboard.press("ArrowRight");
  }
  await photograph(page, name);
  await click(page, next);
}

/** A whole study of one person. */
async function answer(page) {
  const titled = (words) => page.waitForSelector(`h2:text("${words}")`);
  await titled("Pairs");
  await click(page, "Go on");
  await titled("Which of A and B");
  await pair(page, "paired", "j");
  for (const place of [4, 5]) {
    await page.waitForSelector(`text=${place - 2} of 6`);
    await titled("Is X");
    await hearAll(page);
    await page.waitForSelector("button.answer:enabled");
    if (place === 4) await photograph(page, "abx");
    await choose(page, "k");
  }
  await titled("How close");
  await rate(page, "rating");
  await page.waitForSelector("text=5 of 6");
  await titled("Which of A and B");
  await pair(page, "live-paired", "k");
  await page.waitForSelector("text=6 of 6");
  await titled("How close");
  await rate(page, "live-rating");
  await titled("Thank you");
}

const lines = (file) => readFileSync(file, "utf8").trim().split("\n").slice(1);

const tests = {
  async "a study of files and of two scenes ends in answers that the report reads"() {
    const page = await open(browser, `${server.address}?person=p1`, { script: listen });
    await photograph(page, "welcome");
    check(await page.getByRole("button", { name: "Begin" }).isDisabled(), "nobody begins without consent");
    await begin(page);
    await screen(page, "p1", true);
    await answer(page);
    await page.waitForSelector("text=have been sent");
    await photograph(page, "thanks");
    const rows = lines(server.answers);
    check(rows.length === ROWS, `${rows.length} rows, expected ${ROWS}`);
    check(
      rows.every((row) => row.endsWith(",passed")),
      "the headphone check is not in the rows",
    );
    const report = join(folder, "report.json");
    run(program, "study", "report", server.answers, "--keep-all", "--json", report);
    const said = JSON.parse(readFileSync(report));
    const of = ({ paired, abx, ratings }) =>
      `${paired?.items.map(({ item, scores }) => [item, scores.reduce((a, b) => a + b)])} ${abx[0]?.trials} ${ratings.length}`;
    const parts = said.parts.map(of).join();
    check(parts === "tones,1 undefined 0,undefined 2 0,undefined undefined 1,rooms,1 undefined 0,undefined undefined 1", parts);
    const rated = said.parts[2].ratings[0].conditions.map((c) => c.condition).sort();
    check(rated.join() === "Low anchor,Mid anchor,Reference,far,near", rated.join());
    check(page.foreign.length + page.errors.length === 0, [...page.foreign, ...page.errors].join());
    await page.close();
    return `${rows.length} rows`;
  },

  async "who hears through loudspeakers is found out"() {
    const page = await open(browser, `${server.address}?person=p2`);
    await begin(page);
    await screen(page, "p2", false);
    await page.waitForSelector("text=You found the softest tone 0 times of 6");
    await click(page, "Go on without");
    await page.waitForSelector("h2:text('Pairs')");
    const kept = await page.evaluate(() => {
      const place = Object.keys(localStorage).find((key) => key.startsWith("promenade-study/both/") && key.endsWith("/p2"));
      return JSON.parse(localStorage.getItem(place)).headphones;
    });
    check(kept === "failed", kept);
    await page.close();
  },

  async "scenes change without a gap while the listener walks"() {
    const made = { ...study, study: "gap", headphones: false, parts: [study.parts[3]] };
    const own = await serve(made);
    const page = await open(browser, own.address, { script: listen });
    await begin(page);
    await page.waitForSelector(".sounds button", { timeout: 30_000 });
    await page.keyboard.press("2");
    await page.locator("canvas").focus();
    await page.keyboard.down("ArrowUp");
    await page.waitForTimeout(700);
    const where = () => page.locator("canvas").getAttribute("data-place");
    const before = await where();
    await page.locator(".sounds button").nth(2).dispatchEvent("click");
    await page.waitForTimeout(350);
    const { quietest, steepest, loudest, rate } = await page.evaluate(() => {
      const samples = new Float32Array(32768);
      globalThis.heard.getFloatTimeDomainData(samples);
      // A tone of 220 Hz: windows of two of its periods, and its steepest slope.
      const rate = globalThis.heard.context.sampleRate;
      const window = 2 * Math.round(rate / 220);
      let [least, most, step] = [Infinity, 0, 0];
      for (let at = 0; at + window <= samples.length; at += window / 2) {
        const level = Math.hypot(...samples.subarray(at, at + window)) / Math.sqrt(window);
        [least, most] = [Math.min(least, level), Math.max(most, level)];
      }
      for (let i = 1; i < samples.length; i++) step = Math.max(step, Math.abs(samples[i] - samples[i - 1]));
      return { quietest: least, steepest: step, loudest: most, rate };
    });
    for (let tries = 0; tries < 50 && before === (await where()); tries++) await page.waitForTimeout(100);
    await page.keyboard.up("ArrowUp");
    const slope = steepest / (loudest * Math.SQRT2 * 2 * Math.sin((Math.PI * 220) / rate));
    const gap = 20 * Math.log10(quietest / loudest);
    check(quietest > 0 && gap > -20, `${gap.toFixed(1)} dB between the quietest and the loudest moment`);
    check(slope < 1.5, `a slope ${slope.toFixed(2)} times that of the tone: a click`);
    check(before !== (await where()), "the listener does not walk");
    await page.close();
    own.stop();
    return `quietest ${gap.toFixed(1)} dB, slope ${slope.toFixed(2)} of the tone's at ${rate} Hz`;
  },

  async "every control is reached by keys and has a name"() {
    const made = { ...study, study: "keys", headphones: false, parts: [study.parts[4]] };
    const own = await serve(made);
    const page = await open(browser, own.address);
    // Consent by keys alone.
    await page.keyboard.press("Tab");
    await page.keyboard.press("Space");
    await page.keyboard.press("Tab");
    await page.keyboard.press("Enter");
    await page.waitForSelector("input[type=range]", { timeout: 30_000 });
    await hearAll(page);
    await page.evaluate(() => document.querySelector("h2").focus());
    const reached = new Set();
    for (let i = 0; i < 40; i++) {
      await page.keyboard.press("Tab");
      const at = await page.evaluate(() => {
        const all = [...document.querySelectorAll("button, input, canvas")];
        return all.indexOf(document.activeElement);
      });
      reached.add(at);
    }
    const nameless = await page.evaluate(
      () =>
        [...document.querySelectorAll("button, input, canvas")].filter(
          (e) => !(e.getAttribute("aria-label") || e.textContent.trim() || e.closest("label")?.textContent.trim()),
        ).length,
    );
    const controls = await page.locator("button:enabled, input, canvas").count();
    reached.delete(-1);
    check(reached.size === controls, `${reached.size} of ${controls} controls are reached`);
    check(nameless === 0, `${nameless} controls have no name`);
    await page.close();
    own.stop();
    return `${controls} controls`;
  },

  async "a study that is left goes on where it was, and answers wait for a server"() {
    const made = { ...study, study: "left", headphones: false, parts: [study.parts[1]] };
    const own = await serve(made);
    const page = await open(browser, own.address);
    await begin(page);
    await hearAll(page);
    await choose(page, "j");
    await page.waitForSelector("text=2 of 2");
    await page.waitForTimeout(300);
    check(lines(own.answers).length === 1, "the first answer is sent at once");
    await page.reload();
    await click(page, "Go on");
    await page.waitForSelector("text=2 of 2");
    await hearAll(page);
    await page.route("**/answers", (route) => route.abort());
    await choose(page, "j");
    await page.waitForSelector("text=could not be sent");
    check(lines(own.answers).length === 1, "the second has not been sent");
    const [download] = await Promise.all([page.waitForEvent("download"), click(page, "Save my answers")]);
    const saved = readFileSync(await download.path(), "utf8");
    check(saved.trim().split("\n").length === 3, saved);
    await page.unroute("**/answers");
    await click(page, "Send again");
    await page.waitForSelector("text=have been sent");
    check(saved.includes(lines(own.answers).join("\n")), "what is saved is what is sent");
    await page.close();
    own.stop();
  },

  async "walking works wherever the focus is, and answers can be changed until the next trial"() {
    const made = { ...study, study: "focus", headphones: false, parts: [study.parts[3]] };
    const own = await serve(made);
    const page = await open(browser, own.address);
    await begin(page);
    await hearAll(page);
    await page.waitForSelector("button.answer:enabled");
    // A click leaves the focus on a sound.
    await page.locator(".sounds button").nth(1).click();
    const where = () => page.locator("canvas").getAttribute("data-place");
    for (const key of ["w", "ArrowDown", "a"]) {
      const before = await where();
      await page.keyboard.down(key);
      // A busy machine draws, and walks, a few times a second.
      for (let tries = 0; tries < 50 && before === (await where()); tries++) await page.waitForTimeout(100);
      await page.keyboard.up(key);
      check(before !== (await where()), `${key} does not walk`);
    }
    check((await heading(page)).startsWith("Which"), "a walk is no answer");
    await page.keyboard.press("j");
    await page.keyboard.press("k");
    const pressed = await page.locator("button.answer[aria-pressed=true]").allInnerTexts();
    check(pressed.join() === "My answer: B", pressed.join());
    await click(page, "Next");
    await page.waitForSelector("text=have been sent");
    const [, , , , , part, , , , b, , answer] = lines(own.answers)[0].split(",");
    check(part === "1" && answer === b, `part ${part}, ${answer} of ${b}`);
    await page.close();
    own.stop();
  },

  async "nothing of a live ABX tells A from B"() {
    const item = { name: "rooms", dry: rooms.dry, conditions: rooms.conditions };
    const parts = [{ method: "abx", repeats: 1, ...quick, items: [item] }];
    const made = { ...study, study: "blind", headphones: false, parts };
    const own = await serve(made);
    const seen = new Map();
    for (let i = 0; seen.size < 2; i++) {
      const page = await open(browser, `${own.address}?person=p${i}`);
      const first = await page.evaluate(async (person) => {
        const { trials } = await import("./order.js");
        return trials(await (await fetch("study.json")).json(), person)[0].sounds[0].name;
      }, `p${i}`);
      if (!seen.has(first)) {
        await begin(page);
        await page.waitForSelector(".sounds button", { timeout: 30_000 });
        await page.waitForTimeout(300);
        const shown = await page.evaluate(() => ({
          place: document.querySelector("canvas").dataset.place,
          picture: document.querySelector("canvas").toDataURL(),
          text: document.body.innerHTML,
        }));
        seen.set(first, shown);
      }
      await page.close();
    }
    own.stop();
    const [one, other] = [...seen.values()];
    for (const what of ["place", "picture", "text"]) check(one[what] === other[what], `the ${what} tells A`);
    return `from ${one.place} in both`;
  },

  async "sides are balanced over repeats, and repeats are apart"() {
    const page = await open(browser, server.address);
    const [sides, neighbours, count] = await page.evaluate(async () => {
      const { trials } = await import("./order.js");
      const conditions = ["x", "y", "z"].map((name) => ({ name, file: name }));
      const parts = [{ method: "paired", repeats: 4, items: [{ name: "i", conditions }] }];
      const [sides, all] = [{}, []];
      let neighbours = 0;
      for (let person = 0; person < 50; person++) {
        const names = trials({ study: "s", seed: 1, parts }, `p${person}`).map(({ sounds }) => sounds.map((s) => s.name));
        for (const [a, b] of names) sides[[a, b].sort()] = (sides[[a, b].sort()] ?? 0) + (a < b ? 1 : -1);
        const pairs = names.map((pair) => [...pair].sort().join());
        neighbours += pairs.filter((pair, i) => pair === pairs[i - 1]).length;
        all.push(...pairs);
      }
      return [sides, neighbours, all.length];
    });
    await page.close();
    check(count === 600 && neighbours === 0, `${neighbours} neighbours of ${count}`);
    check(Object.values(sides).every((side) => side === 0), JSON.stringify(sides));
  },

  async "a study without a reference asks of none, and a changed one begins anew"() {
    const bare = { name: "tones", conditions: files.conditions };
    const part = { method: "paired", ...quick, no_preference: true, repeats: 2, items: [bare] };
    const practice = { ...part, training: true, repeats: 1 };
    const questions = [{ name: "age", text: "How old are you?", choices: ["under 30", "30 or more"] }];
    const made = { ...study, study: "bare", headphones: false, parts: [practice, part], questions, code: "PQ7" };
    const own = await serve(made);
    const page = await open(browser, `${own.address}?person=p`);
    await begin(page);
    await page.waitForSelector('h2:text("Which of A and B is better?")');
    for (const key of ["j", "l", "k"]) {
      await hearAll(page);
      await choose(page, key);
    }
    await page.getByLabel("How old").selectOption("30 or more");
    await click(page, "Next");
    await page.waitForSelector("text=have been sent");
    await page.waitForSelector("text=Your code: PQ7");
    const rows = lines(own.answers).map((row) => row.split(","));
    check(rows.map((row) => row[6]).join() === "paired,paired,question", "practice is not kept, questions are");
    check(rows[0][11] === "" && rows[1][11] === rows[1][9] && rows[2][11] === "30 or more", rows.join("\n"));
    own.stop();
    const again = await serve({ ...made, title: "Another" });
    const second = await open(browser, `${again.address}?person=p`);
    await begin(second);
    await second.waitForSelector("text=1 of 3");
    // Who is still in the old one is told so, and keeps the answers.
    const refused = await second.evaluate(async (row) => {
      const headers = { "content-type": "application/json" };
      const answer = await fetch("answers", { method: "POST", headers, body: JSON.stringify({ rows: [row] }) });
      return `${answer.status} ${await answer.text()}`;
    }, rows[1]);
    check(/^422 .*answers to its version v/.test(refused), refused);
    await page.close();
    await second.close();
    again.stop();
  },

  async "the report of three listeners has the figures of their answers"() {
    const bare = { name: "tones", conditions: files.conditions };
    const live = { ...rooms, reference: undefined };
    const parts = [
      { method: "paired", ...quick, repeats: 2, items: [bare] },
      { method: "abx", ...quick, repeats: 3, items: [bare] },
      { method: "rating", ...quick, items: [files] },
      { method: "paired", ...quick, items: [live] },
      { method: "rating", ...quick, items: [live] },
    ];
    const own = await serve({ ...study, study: "three", headphones: false, parts });
    for (const [number, keys] of ["jjjkjk", "kjkkjj", "jkkjjj"].entries()) {
      const page = await open(browser, `${own.address}?person=l${number}`);
      await begin(page);
      const next = (place) => page.waitForSelector(`text=/^${place} of 8$/`, { timeout: 30_000 });
      for (let place = 1; place <= 8; place++) {
        await next(place);
        await page.waitForSelector(".sounds button", { timeout: 30_000 });
        if (place === 6 || place === 8) {
          await rate(page, "three");
          continue;
        }
        await hearAll(page);
        await choose(page, keys[place < 6 ? place - 1 : 5]);
      }
      await page.waitForSelector("text=have been sent");
      await page.close();
    }
    const file = join(folder, "three.json");
    run(program, "study", "report", own.answers, "--keep-all", "--json", file);
    own.stop();
    const said = JSON.parse(readFileSync(file)).parts;
    // Outside: by counting, and by the binomial's sum.
    const head = readFileSync(own.answers, "utf8").split("\n")[0].split(",");
    const rows = lines(own.answers).map((line) => Object.fromEntries(line.split(",").map((cell, i) => [head[i], cell])));
    const of = (part) => rows.filter((row) => row.part === String(part));
    for (const part of [1, 4]) {
      const { conditions, scores } = said[part - 1].paired.items[0];
      const counted = conditions.map((name) => of(part).filter(({ answer }) => answer === name).length);
      check(counted.join() === scores.join(), `part ${part}: ${counted} votes, ${scores} reported`);
    }
    const right = of(2).filter(({ x, answer }) => x === answer).length;
    const choose9 = [1, 9, 36, 84, 126, 126, 84, 36, 9, 1];
    const chance = choose9.slice(right).reduce((a, b) => a + b) / 512;
    const [abx] = said[1].abx;
    check(abx.trials === 9 && abx.right === right && Math.abs(abx.chance - chance) < 1e-8, JSON.stringify(abx));
    for (const part of [3, 5]) {
      for (const { condition, mean, quartiles, ratings } of said[part - 1].ratings[0].conditions) {
        const all = of(part).filter(({ a }) => a === condition).map(({ rating }) => Number(rating));
        all.sort((a, b) => a - b);
        check(all.join() === ratings.join() && quartiles[1] === all[1], `${condition}: ${all} and ${ratings}`);
        check(Math.abs(mean - (all[0] + all[1] + all[2]) / 3) < 1e-8, `${condition}: ${mean}`);
      }
    }
    return `${rows.length} rows, X told ${right} of 9 times`;
  },

  async "a stretch goes round, the same of all sounds"() {
    const made = { ...study, study: "stretch", headphones: false, parts: [study.parts[1]] };
    const own = await serve(made);
    const script = `{
      const start = AudioBufferSourceNode.prototype.start;
      AudioBufferSourceNode.prototype.start = function (...rest) {
        (globalThis.sources ??= []).push(this);
        return start.apply(this, rest);
      };
    }`;
    const page = await open(browser, own.address, { script });
    await begin(page);
    await page.waitForSelector(".sounds button");
    await page.keyboard.press("1");
    await page.getByLabel("from", { exact: true }).fill("0.2");
    await page.getByLabel("to", { exact: true }).fill("0.45");
    const stretches = await page.evaluate(() => globalThis.sources.slice(-3).map((s) => [s.loop, s.loopStart, s.loopEnd]));
    check(stretches.length === 3 && stretches.every((s) => s.join() === "true,0.2,0.45"), JSON.stringify(stretches));
    await page.keyboard.press("2");
    await page.waitForSelector(".sounds button:nth-child(2)[aria-pressed=true]");
    await page.close();
    own.stop();
  },

  async "pictures beside a sound blend at each moment's weight of it, as the frames of the command do"() {
    // One colour each; drawn by the browser itself, since Node has no encoder of pictures.
    const colours = { gold: [200, 180, 40], uniform: [90, 90, 90], image: [20, 60, 220], ear: [230, 120, 10] };
    const draw = await browser.newPage();
    for (const [name, rgb] of Object.entries(colours)) {
      const url = await draw.evaluate((colour) => {
        const canvas = Object.assign(document.createElement("canvas"), { width: 64, height: 48 });
        const pen = canvas.getContext("2d");
        pen.fillStyle = `rgb(${colour})`;
        pen.fillRect(0, 0, 64, 48);
        return canvas.toDataURL();
      }, rgb);
      writeFileSync(join(folder, `${name}.png`), Buffer.from(url.split(",")[1], "base64"));
    }
    await draw.close();
    // Silence, a burst, silence.
    const burst = noise(RATE / 2, 0.3);
    const sound = Float32Array.from({ length: 3 * RATE }, (_, i) => burst[i - RATE] ?? 0);
    writeWav(join(folder, "mix.wav"), RATE, [sound, sound]);
    const conditions = { Uni: "uniform.png", Sal: "image.png", Mix: ["image.png", "ear.png"] };
    const item = { name: "room", sound: "mix.wav", reference: "gold.png", conditions };
    const parts = [
      { method: "paired", seconds: 3, pairs: [["Sal", "Mix"]], items: [item] },
      { method: "rating", ...quick, items: [item] },
    ];
    const own = await serve({ ...study, study: "composite", headphones: false, parts });
    const frames = join(folder, "frames");
    const of = (name) => join(folder, name);
    run(program, "map", "composite", of("image.png"), of("ear.png"), "--sound", of("mix.wav"), "-o", frames);
    run(program, "map", "saliency", of("mix.wav"), "-o", of("weights.json"));
    const weights = JSON.parse(readFileSync(of("weights.json"))).frames.map(({ saliency }) => saliency);
    // What each frame of the first trial shows, with its time in the sound and its weight.
    const script = `{
      globalThis.seen = [];
      const draw = WebGL2RenderingContext.prototype.drawArrays;
      WebGL2RenderingContext.prototype.drawArrays = function (...rest) {
        draw.apply(this, rest);
        const pixel = new Uint8Array(4);
        this.readPixels(30, 20, 1, 1, this.RGBA, this.UNSIGNED_BYTE, pixel);
        queueMicrotask(() => {
          const [cue, { weight, seconds }] = [document.querySelector(".cue")?.textContent, this.canvas.dataset];
          globalThis.seen.push({ cue, weight: Number(weight), seconds: Number(seconds), pixel: [...pixel] });
        });
      };
    }`;
    const page = await open(browser, own.address, { script });
    await begin(page);
    await page.waitForSelector("text=You will hear the reference, A, the reference, B, 3 seconds each.");
    await click(page, "Begin");
    await page.waitForSelector("text=Keys:", { timeout: 60_000 });
    const seen = await page.evaluate(() => globalThis.seen);
    const order = await page.evaluate(
      async () => {
        const [{ trials }, made] = await Promise.all([import("./order.js"), (await fetch("study.json")).json()]);
        const person = JSON.parse(Object.values(localStorage)[0]).person;
        return trials(made, person)[0].sounds.map(({ label, name }) => [label, name]);
      },
    );
    const light = (v) => (v <= 0.04045 * 255 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4);
    const code = (l) => 255 * (l <= 0.0031308 ? 12.92 * l : 1.055 * l ** (1 / 2.4) - 0.055);
    let [least, most, off] = [1, 0, 0];
    for (const [label, name] of order) {
      const those = seen.filter(({ cue }) => cue === label);
      check(those.length > 5, `${label}: ${those.length} frames`);
      for (const { weight, seconds, pixel } of those) {
        const at = Math.min(seconds * 25, weights.length - 1);
        const wanted = weights[Math.floor(at)] * (1 - (at % 1)) + weights[Math.ceil(at)] * (at % 1);
        const blend = name === "Mix" ? wanted : 0;
        check(Math.abs(weight - blend) < 2e-3, `${name} at ${seconds} s: weight ${weight}, expected ${blend}`);
        const [a, b] = { Mix: ["image", "ear"], Sal: ["image", "image"] }[name] ?? ["gold", "gold"];
        const colour = [0, 1, 2].map((i) => code(light(colours[a][i]) * (1 - weight) + light(colours[b][i]) * weight));
        off = Math.max(off, ...colour.map((v, i) => Math.abs(v - pixel[i])));
        if (name === "Mix") [least, most] = [Math.min(least, weight), Math.max(most, weight)];
      }
    }
    check(least < 0.02 && most > 0.8, `weights from ${least} to ${most}`);
    check(off <= 1.01, `${off} of 255 beside the blend of light`);
    await photograph(page, "composite");
    await choose(page, "j");
    await page.waitForSelector("text=2 of 2");
    await rate(page, "composite-rating");
    await page.waitForSelector("text=have been sent");
    const rows = lines(own.answers).map((line) => line.split(","));
    const named = rows.map((row) => row.slice(6, 9).join(" ")).sort().join();
    check(rows.length === 5, named);
    check(named.includes("rating room Mix") && rows[0].slice(8, 10).sort().join() === "Mix,Sal", named);
    check(page.errors.length === 0, page.errors.join());
    await page.close();
    own.stop();
    return `${seen.length} frames, weights ${least.toFixed(2)} to ${most.toFixed(2)}, at most ${off.toFixed(2)} of 255 off`;
  },

  async "the page speaks the study's language, and one of its author's own"() {
    const item = { ...files };
    const parts = [
      { method: "paired", intro: "Vier Klänge.", seconds: 0.2, no_preference: true, items: [item] },
      { method: "rating", ...quick, items: [item] },
      { method: "paired", ...quick, items: [rooms] },
    ];
    const texts = JSON.parse(readFileSync(join(root, "crates/study/page/texts.json")));
    // A language that has nothing in common with English: every text is turned round, but for its values.
    const turned = (text) => text.split(/(\{\w+\}|, )/).map((part) => (/^[{,]/.test(part) ? part : [...part].reverse().join("")));
    const own = Object.fromEntries(Object.entries(texts.en).map(([name, text]) => [name, turned(text).join("")]));
    writeFileSync(join(folder, "tlh.json"), JSON.stringify(own));
    const said = [];
    for (const [language, of] of [["de", texts.de], ["tlh.json", own]]) {
      const title = "…";
      const name = `in-${language.split(".")[0]}`;
      const headphones = language === "de";
      const made = { ...study, study: name, title, language, headphones, consent: undefined, welcome: "…", parts };
      const site = await serve(made);
      const page = await open(browser, `${site.address}?person=p1`);
      const words = new Set();
      const read = async () => {
        const found = await page.evaluate(() => {
          const labelled = [...document.querySelectorAll("[aria-label]")].map((e) => e.getAttribute("aria-label"));
          const valued = [...document.querySelectorAll("[aria-valuetext]")].map((e) => e.getAttribute("aria-valuetext"));
          return [document.body.innerText, ...labelled, ...valued].join("\n");
        });
        found.split(/[^\p{L}]+/u).forEach((word) => words.add(word));
      };
      check((await page.getAttribute("html", "lang")) === language.split(".")[0], "the page's language");
      await read();
      const press = async (name) => {
        await page.getByRole("button", { name: of[name], exact: true }).waitFor({ timeout: 30_000 });
        await read();
        await click(page, of[name]);
      };
      await press("begin");
      if (made.headphones) {
        await page.waitForSelector(`text=${of["wear headphones"].slice(0, 20)}`);
        await press("begin");
        for (let trial = 1; trial <= 6; trial++) {
          await page.waitForSelector(`text=${trial} von 6`);
          await press("play");
          await page.locator(".sounds button:nth-child(1):enabled").click();
        }
        await press("go on without");
      }
      await press("go on");
      await press("begin");
      await page.waitForSelector("button.answer:enabled");
      await read();
      await choose(page, "l");
      await rate(page, `rating-${language}`, of.next, of.pause);
      await read();
      await hearAll(page, of.pause);
      await read();
      await photograph(page, `walk-${language}`);
      await choose(page, "j");
      await page.waitForSelector(`text=${of.sent}`);
      await read();
      // What is English in the texts and nothing else in this language.
      const mine = new Set(Object.values(of).flatMap((text) => text.split(/[^\p{L}]+/u)));
      const english = Object.values(texts.en).flatMap((text) => text.split(/[^\p{L}]+/u));
      const left = [...new Set(english)].filter((word) => word.length > 1 && !mine.has(word) && words.has(word));
      check(left.length === 0, `${language}: ${left.join(", ")}`);
      said.push(words.size);
      await page.close();
      site.stop();
    }
    return `${said.join(" and ")} words read`;
  },

  async "sounds that are missing are said, and can be tried again"() {
    const made = { ...study, study: "missing", headphones: false, parts: [study.parts[1]] };
    const own = await serve(made);
    const page = await open(browser, own.address);
    await page.route("**/stimuli/*", (route) => route.fulfill({ status: 503, body: "" }));
    await begin(page);
    await page.waitForSelector("text=the server answers 503");
    await page.unroute("**/stimuli/*");
    await click(page, "Try again");
    await hearAll(page);
    await page.close();
    own.stop();
  },
};

const passed = await runTests(tests, only);
server.stop();
await browser.close();
rmSync(folder, { recursive: true });
process.exit(passed ? 0 : 1);
