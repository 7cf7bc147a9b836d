// The page: opens the site, and connects controls, listener, stage and sounds.

import { compile, warmUp, SETTINGS } from "./engine/engine.js";
import { choices, slider, soundList, trims } from "./controls.js";
import { Figures, place } from "./figures.js";
import { Headset } from "./headset.js";
import { Listener } from "./listener.js";
import { Orientation, isHere } from "./orientation.js";
import { Output } from "./output.js";
import { PathWalk } from "./path.js";
import { Site } from "./site.js";
import { Stage } from "./stage.js";
import { Voices } from "./voices.js";
import { clear, say, show } from "./messages.js";
import { add } from "./turns.js";

const at = (id) => document.getElementById(id);
/** An added sound stands so far beside the one before, metres. */
const APART = 1;
/** Poses are sent for so long after the last move, seconds. */
const AFTER_S = 0.3;

at("no-modules").remove();

const failed = (name, error, again) =>
  show(name, `${error.message ?? error}.`.replace(/\.\.$/, "."), again && { action: ["Try again", again] });

let site;
try {
  site = await Site.open();
  if (site.scenes.length === 0) throw new Error("site.json names no scene");
} catch (error) {
  failed("site", error, () => location.reload());
  throw error;
}

/** The heading and the tab follow the place, after a title of the page's own. */
function entitle({ name }) {
  const own = site.title && site.title !== site.scenes[0].name ? `${site.title}: ` : "";
  document.title = at("title").textContent = own + name;
}
entitle(site.scenes[0]);
// What must have come before anything is heard.
const expected = (site.scenes[0].bytes ?? 0) + (site.sounds[0]?.bytes ?? 0);
site.progress = (received) => (at("loading").value = Math.min(received / Math.max(expected, 1), 1));

const canvas = at("stage");
const stage = new Stage(canvas);
if (stage.lost)
  show("picture", "This browser shows no picture of the place (WebGL is off); its sound plays all the same.", {
    calm: true,
  });
const listener = new Listener(stage, canvas, document.querySelector(".pad"));
const figures = new Figures();
const voices = new Voices(site);
const output = new Output(voices);
const walk = new PathWalk(site, voices, listener);
let shown = null;
let movedAt = -Infinity;

const touch = () => (movedAt = performance.now() / 1000);

// The place.

async function showPlace() {
  const voice =
    voices.voices.find((v) => v.loaded && (v.scene ?? voices.place) === voices.place) ??
    voices.voices.find((v) => v.loaded);
  if (!voice) return;
  const { place: found, number } = voice.loaded;
  const first = shown !== number;
  shown = number;
  const scene = site.scenes[number];
  const outline = scene.outline ? await site.json(scene.outline).catch(() => []) : [];
  if (first) walk.offer(number);
  const rows = await walk.rowsFor();
  stage.show(found, { outline, path: rows });
  if (first) {
    entitle(scene);
    listener.enter(found.description);
    walk.use(rows);
    about(found.description, scene);
    attempt("splats", () => showSplats(scene));
  }
  at("head-row").hidden = site.heads.length === 0;
  at("accuracy-row").hidden = !hasFront();
  drawSounds();
}

function drawSounds() {
  stage.sounds = voices.voices.flatMap((voice, i) => {
    const emitter = voice.loaded?.place.description.emitter;
    if (!emitter) return [];
    const name = voices.voices.length > 1 ? `${i + 1} ${voice.dry.name}` : voice.dry.name;
    return [{ position: add(emitter, voice.offset), name, voice: i > 0 ? voice : null }];
  });
}

function about(description, scene) {
  const lines = [scene.name === description.title ? description.title : `${scene.name}: ${description.title}`];
  if (description.credit) lines.push(description.credit);
  if (description.licence) lines.push(`Licence: ${description.licence}`);
  if (description.head) lines.push(`Measured with the head ${description.head}`);
  lines.push(...description.notes);
  for (const sound of site.sounds) if (sound.credit) lines.push(`${sound.name}: ${sound.credit}`);
  at("about").replaceChildren(
    ...lines.filter(Boolean).map((text) => Object.assign(document.createElement("p"), { textContent: text })),
  );
}

/** Photographs of a scene, if the site has any; what draws them is fetched with the first. */
async function showSplats(scene) {
  stage.splats?.close();
  stage.splats = null;
  if (!scene.splats || stage.lost) return;
  const { Splats } = await import("./splats.js");
  const splats = await Splats.load(stage.gl, scene.splats);
  if (site.scenes[shown] !== scene || stage.splats) splats.close();
  else stage.splats = splats;
}

/** Runs something that may fail, with a message and a way back. */
async function attempt(name, work) {
  try {
    await work();
    clear(name);
  } catch (error) {
    failed(name, error, () => attempt(name, work));
  }
}

choices(
  at("scene"),
  site.scenes.map((s, n) => [n, s.name]),
  0,
);
document.querySelector(".scene-choice").hidden = site.scenes.length < 2;
at("scene").addEventListener("change", () => {
  const before = voices.place;
  voices.place = Number(at("scene").value);
  walk.stop();
  attempt("scene", async () => {
    try {
      await voices.reload();
    } catch (error) {
      voices.place = before;
      at("scene").value = String(before);
      throw error;
    }
  }).then(showPlace);
});
voices.addEventListener("loaded", () => attempt("scene", showPlace));

// Sounds.

const ofSite = (number) =>
  site.sounds[number] ? { kind: "site", number, ...site.sounds[number] } : { kind: "none", name: "nothing" };

function listSounds() {
  soundList(at("sounds"), voices.voices, site, {
    dry: (voice, value) => {
      if (value === "own") return;
      voice.dry = value === "none" ? { kind: "none", name: "nothing" } : ofSite(Number(value));
      attempt("sound", () => voices.plug(voice)).then(listSounds);
    },
    scene: (voice, number) => {
      voice.scene = number;
      attempt("scene", () => voices.load(voice));
    },
    here: (voice) => {
      const ahead = [Math.cos(listener.heading), Math.sin(listener.heading), 0];
      putAt(voice, add(listener.position, ahead));
    },
    level: (voice, level) => voices.setLevel(voice, level),
    remove: (voice) => {
      voices.remove(voice);
      listSounds();
    },
  });
  drawSounds();
}

/** Puts an added sound at a place of the floor, at its height. */
function putAt(voice, [x, y]) {
  const emitter = voice.loaded?.place.description.emitter;
  if (emitter) voices.put(voice, [x - emitter[0], y - emitter[1], 0]);
  drawSounds();
}

at("add-sound").addEventListener("click", () =>
  attempt("sound", async () => {
    const count = voices.voices.length;
    const voice = await voices.add(ofSite(count % Math.max(site.sounds.length, 1)));
    voices.put(voice, [0, APART * count, 0]);
    listSounds();
  }),
);

/** The sound that a file or the microphone takes the place of: the last. */
const lastVoice = () => voices.voices[voices.voices.length - 1];

at("sound-file").addEventListener("change", async ({ target }) => {
  const file = target.files[0];
  target.value = "";
  if (!file) return;
  const voice = lastVoice();
  const before = voice.dry;
  voice.dry = { kind: "file", name: file.name, bytes: await file.arrayBuffer() };
  try {
    await output.ready;
    await voices.plug(voice);
    clear("sound");
  } catch (error) {
    voice.dry = before;
    failed("sound", error);
    await voices.plug(voice);
  }
  listSounds();
});

async function microphone() {
  const button = at("microphone");
  const playing = voices.voices.find((v) => v.dry.kind === "microphone");
  if (playing) {
    playing.dry.stream.getTracks().forEach((track) => track.stop());
    playing.dry = ofSite(0);
    button.setAttribute("aria-pressed", "false");
    await attempt("sound", () => voices.plug(playing));
    return listSounds();
  }
  if (!navigator.mediaDevices?.getUserMedia) {
    return show(
      "microphone",
      "Browsers lend a microphone to pages on https or on this machine only. The sounds of this page go on playing.",
    );
  }
  try {
    const plain = { echoCancellation: false, noiseSuppression: false, autoGainControl: false };
    const stream = await navigator.mediaDevices.getUserMedia({ audio: plain });
    const voice = lastVoice();
    voice.dry = { kind: "microphone", name: "microphone", stream };
    button.setAttribute("aria-pressed", "true");
    clear("microphone");
    await output.resume();
    await attempt("sound", () => voices.plug(voice));
    listSounds();
  } catch (error) {
    const why =
      { NotAllowedError: "The microphone was refused", NotFoundError: "There is no microphone" }[error.name] ??
      `The microphone cannot be used: ${error.message}`;
    show("microphone", `${why}. The sound that was playing goes on.`, { action: ["Ask again", microphone] });
  }
}
at("microphone").addEventListener("click", microphone);

// Hearing and changes.

let secondEmitter = false;
const change = (values) => {
  voices.set(values);
  if (values.stereoSpread > 0 && !secondEmitter) {
    secondEmitter = voices.beside.secondEmitter = true;
    attempt("scene", () => voices.reload());
  }
};
at("trims-reset").addEventListener("click", trims(at("trims"), change));
slider(at("volume"), SETTINGS.gain, "Volume", (value) =>
  output.setVolume(value <= SETTINGS.gain.from ? 0 : 10 ** (value / 20)),
);
/** Whether a file says what less of its scene costs; otherwise all of it is played. */
const hasFront = () => voices.voices.some((voice) => voice.loaded?.place.description.front);
/** What of a scene is played: within so many just noticeable differences; "auto" is what this device can afford. */
const ACCURACIES = ["all", "0.25", "0.5", "1", "2"];
const EASY = 0.5;
let wanted = document.documentElement.dataset.accuracy ?? "all";
const play = (accuracy) => {
  voices.beside.accuracy = accuracy === "all" ? 0 : Number(accuracy);
  return attempt("scene", () => voices.reload());
};
choices(at("accuracy"), [["auto", "what this device can afford"], ...ACCURACIES.map((a) => [a, a === "all" ? "all" : `within ${a} JND`])], wanted);
at("accuracy").addEventListener("change", () => {
  wanted = at("accuracy").value;
  play(wanted === "auto" ? "all" : wanted);
});
/** After a second that took too long the next cheaper one is played. */
function afford(load) {
  const now = ACCURACIES.findIndex((a) => (a === "all" ? 0 : Number(a)) === (voices.beside.accuracy ?? 0));
  if (wanted === "auto" && hasFront() && load > EASY && now + 1 < ACCURACIES.length) play(ACCURACIES[now + 1]);
}

choices(at("head"), [["", "as the place was measured"], ...site.heads.map((h, n) => [n, h.name])], "");
choices(at("headphones"), [["", "not corrected"], ...site.headphones.map((h, n) => [n, h.name])], "");
const bytesOf = async (list, value) => (value === "" ? undefined : site.bytes(list[Number(value)].file));
at("head").addEventListener("change", () =>
  attempt("head", async () => {
    voices.beside.head = await bytesOf(site.heads, at("head").value);
    await voices.reload();
  }),
);
async function useHeadphones(bytes) {
  const before = voices.beside.headphones;
  voices.beside.headphones = bytes;
  try {
    await voices.reload();
  } catch (error) {
    voices.beside.headphones = before;
    at("headphones").value = "";
    throw error;
  }
}
at("headphones").addEventListener("change", () =>
  attempt("headphones", async () => useHeadphones(await bytesOf(site.headphones, at("headphones").value))),
);
at("headphones-file").addEventListener("change", async ({ target }) => {
  const file = target.files[0];
  target.value = "";
  if (!file) return;
  const bytes = await file.arrayBuffer();
  await attempt("headphones", async () => {
    await useHeadphones(bytes);
    at("headphones").append(new Option(file.name, "own", false, true));
  });
});

// The listener.

listener.addEventListener("touched", () => {
  touch();
  if (walk.playing && !walk.ownHead) walk.stop();
});
listener.addEventListener("drag", ({ detail: { sound, to } }) => putAt(sound.voice, to));
walk.addEventListener("chosen", () => Object.assign(stage, { path: walk.rows, dirty: true }));
listener.addEventListener("jump", () => {
  walk.stop();
  voices.jump(listener.pose);
});
at("home").addEventListener("click", () => listener.goHome());
at("where").addEventListener("click", () => say(`You are ${place(listener.pose, stage.sounds[0]?.position)}`));
for (const [id, eyes] of [
  ["view-plan", false],
  ["view-eyes", true],
]) {
  at(id).addEventListener("click", () => {
    stage.eyes = eyes;
    at("view-plan").setAttribute("aria-pressed", String(!eyes));
    at("view-eyes").setAttribute("aria-pressed", String(eyes));
    canvas.setAttribute("aria-label", eyes ? "The place through your eyes" : "The place from above");
  });
}

const orientationNow = new Orientation(listener, touch);
at("orientation").hidden = !isHere();
at("orientation").addEventListener("click", () =>
  attempt("orientation", async () => {
    if (orientationNow.on) orientationNow.stop();
    else await orientationNow.start();
    at("orientation").setAttribute("aria-pressed", String(orientationNow.on));
  }),
);

const headset = new Headset(stage, listener);
Headset.isHere().then((here) => (at("headset").hidden = !here));
navigator.xr?.addEventListener("devicechange", async () => (at("headset").hidden = !(await Headset.isHere())));
at("headset").addEventListener("click", () =>
  attempt("headset", async () => {
    if (headset.session) return headset.leave();
    output.resume();
    walk.stop();
    await headset.enter(
      (time) => send(time),
      () => (at("headset").textContent = "Enter with a headset"),
    );
    at("headset").textContent = "Leave the headset";
  }),
);

// What is heard, drawn and shown.

voices.addEventListener("report", ({ detail }) => {
  if (detail.load !== undefined) afford(detail.load);
  figures.take(detail.room, detail);
  if (detail.room === voices.voices[0].room && detail.heard) walk.heard(detail.heard);
});
voices.addEventListener("closed", ({ detail }) => figures.forget(detail.room));

function send(time) {
  if (walk.playing && !walk.ownHead) return;
  voices.move(listener.pose, time);
}

let last = performance.now();
let frames = 0;
function frame(time) {
  requestAnimationFrame(frame);
  const seconds = Math.min(Math.max((time - last) / 1000, 0), 0.1);
  last = time;
  if (!headset.session) {
    const before = JSON.stringify(listener.pose);
    listener.advance(seconds);
    if (JSON.stringify(listener.pose) !== before) touch();
    if (time / 1000 - movedAt < AFTER_S) send(time / 1000);
    stage.draw(listener.pose);
  }
  if (frames++ % 4 === 0) {
    const engineLatency = output.latency;
    figures.show({
      context: output.started ? output.context : null,
      engineLatency,
      gain: output.volume,
      pose: listener.pose,
      emitter: stage.sounds[0]?.position,
    });
  }
}
requestAnimationFrame(frame);

// The beginning.

await voices.add(ofSite(0));
listSounds();
await attempt("engine", async () => {
  await compile();
  await output.open();
  at("loading").hidden = true;
  Object.assign(at("listen"), { textContent: "Listen", disabled: false });
});
output.connectControls();
// For whoever steers the page from outside, as its tests do.
globalThis.promenade = { site, voices, listener, stage, output, walk, headset, warmUp };
document.documentElement.dataset.ready = "true";
