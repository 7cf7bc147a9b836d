// A study from its welcome to its thanks.

import { Answers } from "./answers.js";
import * as headphones from "./headphones.js";
import { trials } from "./order.js";
import { button, element, paragraphs, progress, say, shortcuts, show } from "./parts.js";
import { chance, personName } from "./random.js";
import { take, text } from "./texts.js";
import { run } from "./trials.js";

let context = null;

/** The audio context; it may begin after a click. */
async function sound() {
  context ??= new AudioContext({ latencyHint: "interactive" });
  if (context.state !== "running") await context.resume();
  context.onstatechange = () => {
    if (context.state === "interrupted" || context.state === "suspended") say(text("paused"));
  };
  return context;
}

/** Shows a page and waits for its one button. */
function page(title, words, label, ...more) {
  return new Promise((resolve) => {
    const go = button(label, () => resolve(), { className: "go" });
    show(title, ...paragraphs(words), ...more.map((make) => make(go)), element("div", { className: "row" }, go));
  });
}

async function consent(study, answers) {
  if (answers.kept.consent) {
    await page(text("back"), text("kept"), text("go on"));
    return;
  }
  const agree = (go) => {
    if (!study.consent) return null;
    const box = element("input", { type: "checkbox" });
    go.disabled = true;
    box.addEventListener("change", () => (go.disabled = !box.checked));
    return element("label", { className: "check" }, box, element("span", {}, study.consent));
  };
  await page(study.title, study.welcome ?? "", text("begin"), agree);
  answers.kept.consent = true;
  answers.save();
}

/** Asks for headphones, and finds out; three times at most. */
async function screen(answers, random) {
  if (answers.kept.headphones) return;
  for (let round = 0; round < 3; round++) {
    await page(text("headphones"), text("wear headphones"), text("begin"));
    await sound();
    let right = 0;
    for (const [number, trial] of headphones.screening(random).entries()) {
      right += (await softest(trial, number)) === trial.soft ? 1 : 0;
    }
    answers.kept.headphones = right >= headphones.PASS ? "passed" : "failed";
    if (right >= headphones.PASS) break;
    const again =
      round < 2 &&
      (await new Promise((resolve) => {
        show(
          text("headphones"),
          element("p", {}, text("through loudspeakers", { right, all: headphones.TRIALS })),
          element(
            "div",
            { className: "row" },
            button(text("try again"), () => resolve(true), { className: "go" }),
            button(text("go on without"), () => resolve(false)),
          ),
        );
      }));
    if (!again) break;
  }
  answers.save();
}

function softest(trial, number) {
  return new Promise((resolve) => {
    let stop = null;
    const made = [1, 2, 3].map((n) => button(text("tone", { number: n }), () => done(n - 1), { disabled: true }));
    const replay = button(text("play"), () => begin(), { className: "go" });
    const unlisten = shortcuts({ 1: made[0], 2: made[1], 3: made[2], p: replay });
    const done = (place) => {
      unlisten();
      stop?.();
      resolve(place);
    };
    const begin = () => {
      replay.disabled = true;
      stop = headphones.play(context, trial, (place) => {
        made.forEach((b, i) => b.setAttribute("aria-pressed", String(i === place)));
        if (place !== null) return;
        made.forEach((b) => (b.disabled = false));
        made[0].focus();
        say(text("softest now"));
      });
    };
    show(
      text("which softest"),
      element("p", { className: "soft" }, text("softest keys", { number: number + 1, all: headphones.TRIALS })),
      element("div", { className: "row" }, replay),
      element("div", { className: "row sounds", role: "group", "aria-label": text("answer") }, ...made),
    );
    replay.focus();
  });
}

async function attempt(trial) {
  for (;;) {
    try {
      return await run(await sound(), trial);
    } catch (error) {
      console.error(error);
      await page(text("cannot play"), `${error.message}.`, text("try again"));
    }
  }
}

/** Questions beside the sounds, each with choices or a text; gives their rows. */
function questions(asked) {
  return new Promise((resolve) => {
    progress("");
    const fields = asked.map(({ text: question, choices }) => {
      const options = choices && ["", ...choices].map((choice) => element("option", { value: choice }, choice));
      const field = choices ? element("select", {}, ...options) : element("textarea", { maxlength: "1000", rows: "3" });
      return { field, line: element("label", { className: "question" }, element("span", {}, question), field) };
    });
    // Tables on a screen take cells that begin so for formulas.
    const plain = (written) => written.replace(/\s+/g, " ").replace(/^[\s=+\-@]+/, "");
    const rows = () =>
      asked.map(({ name }, i) => ({ method: "question", item: name, answer: plain(fields[i].field.value) }));
    const go = button(text("next"), () => resolve(rows().filter((row) => row.answer !== "")), { className: "go" });
    show(text("questions"), ...fields.map(({ line }) => line), element("div", { className: "row" }, go));
  });
}

async function thank(study, answers) {
  progress("");
  const state = element("p", { role: "status" });
  const again = button(text("send again"), () => send(), { hidden: true });
  const code = study.code && element("p", { hidden: Boolean(study.post) }, text("code"), element("strong", {}, study.code));
  const send = async () => {
    again.hidden = true;
    state.textContent = text("sending");
    try {
      await answers.post();
      state.textContent = text("sent");
      if (code) code.hidden = false;
    } catch (error) {
      state.textContent = text("not sent", { why: error.message });
      again.hidden = false;
    }
  };
  show(
    text("thank you"),
    ...paragraphs(study.thanks ?? text("thanks")),
    study.post ? state : null,
    code,
    element(
      "div",
      { className: "row" },
      again,
      button(text("save"), () => answers.download(), { className: study.post ? "" : "go" }),
      button(text("forget"), () => {
        answers.forget();
        location.reload();
      }),
    ),
  );
  if (study.post) await send();
}

async function begin() {
  let study;
  try {
    const response = await fetch("study.json");
    if (!response.ok) throw new Error(`the server answers ${response.status}`);
    study = await response.json();
  } catch (error) {
    show("The study cannot be opened", element("p", {}, `study.json: ${error.message}.`));
    return;
  }
  take(study.texts);
  document.documentElement.lang = study.language;
  document.title = study.title;
  document.getElementById("title").textContent = study.title;
  // A study's own list of persons may give each a link with a name.
  const named = new URLSearchParams(location.search)
    .get("person")
    ?.replace(/[^A-Za-z0-9_-]/g, "")
    .slice(0, 64);
  const answers = new Answers(study, named);
  answers.kept.person ??= named || personName();
  await consent(study, answers);
  if (study.headphones) await screen(answers, chance(`${study.seed}/headphones/${answers.kept.person}`));
  const all = trials(study, answers.kept.person);
  let part = null;
  for (let number = answers.kept.done; number < all.length; number++) {
    const trial = all[number];
    progress(text("count", { number: number + 1, all: all.length }));
    if (trial.number !== part && trial.part.intro)
      await page(trial.part.title ?? text("next part"), trial.part.intro, text("go on"));
    part = trial.number;
    answers.add(number + 1, await attempt(trial));
  }
  if (study.questions && answers.kept.done === all.length) answers.add(all.length + 1, await questions(study.questions));
  await thank(study, answers);
}

addEventListener("error", ({ message }) => console.error(message));
begin();
document.documentElement.dataset.ready = "yes";
