// A study from its welcome to its thanks.

import { Answers } from "./answers.js";
import * as headphones from "./headphones.js";
import { trials } from "./order.js";
import { button, element, paragraphs, progress, say, shortcuts, show } from "./parts.js";
import { chance, personName } from "./random.js";
import { run } from "./trials.js";

let context = null;

/** The audio context; it may begin after a click. */
async function sound() {
  context ??= new AudioContext({ latencyHint: "interactive" });
  if (context.state !== "running") await context.resume();
  context.onstatechange = () => {
    if (context.state === "interrupted" || context.state === "suspended") say("The sound is paused.");
  };
  return context;
}

/** Shows a page and waits for its one button. */
function page(title, text, label, ...more) {
  return new Promise((resolve) => {
    const go = button(label, () => resolve(), { className: "go" });
    show(title, ...paragraphs(text), ...more.map((make) => make(go)), element("div", { className: "row" }, go));
  });
}

async function consent(study, answers) {
  if (answers.kept.consent) {
    await page("Welcome back", "Your answers so far are kept in this browser. You go on where you stopped.", "Go on");
    return;
  }
  const agree = (go) => {
    if (!study.consent) return null;
    const box = element("input", { type: "checkbox" });
    go.disabled = true;
    box.addEventListener("change", () => (go.disabled = !box.checked));
    return element("label", { className: "check" }, box, element("span", {}, study.consent));
  };
  await page(study.title, study.welcome ?? "", "Begin", agree);
  answers.kept.consent = true;
  answers.save();
}

/** Asks for headphones, and finds out; three times at most. */
async function screen(answers, random) {
  if (answers.kept.headphones) return;
  for (let round = 0; round < 3; round++) {
    await page(
      "Headphones",
      "This study needs headphones. Put them on, and set a level at which speech would be comfortable. " +
        "You will now hear three tones, six times. Say each time which one is the softest.",
      "Begin",
    );
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
          "Headphones",
          element(
            "p",
            {},
            `You found the softest tone ${right} times of ${headphones.TRIALS}. Through loudspeakers one of the tones ` +
              "cancels itself. Please use headphones, or turn the level up a little.",
          ),
          element(
            "div",
            { className: "row" },
            button("Try again", () => resolve(true), { className: "go" }),
            button("Go on without", () => resolve(false)),
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
    const made = [1, 2, 3].map((n) => button(`Tone ${n}`, () => done(n - 1), { disabled: true }));
    const replay = button("Play", () => begin(), { className: "go" });
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
        say("Which was the softest?");
      });
    };
    show(
      "Which tone is the softest?",
      element("p", { className: "soft" }, `${number + 1} of ${headphones.TRIALS}. Keys: P plays, 1, 2 and 3 answer.`),
      element("div", { className: "row" }, replay),
      element("div", { className: "row sounds", role: "group", "aria-label": "Answer" }, ...made),
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
      await page("The sounds cannot be played", `${error.message}.`, "Try again");
    }
  }
}

/** Questions beside the sounds, each with choices or a text; gives their rows. */
function questions(asked) {
  return new Promise((resolve) => {
    progress("");
    const fields = asked.map(({ text, choices }) => {
      const options = choices && ["", ...choices].map((choice) => element("option", { value: choice }, choice));
      const field = choices ? element("select", {}, ...options) : element("textarea", { maxlength: "1000", rows: "3" });
      return { field, line: element("label", { className: "question" }, element("span", {}, text), field) };
    });
    // Tables on a screen take cells that begin so for formulas.
    const plain = (text) => text.replace(/\s+/g, " ").replace(/^[\s=+\-@]+/, "");
    const rows = () =>
      asked.map(({ name }, i) => ({ method: "question", item: name, answer: plain(fields[i].field.value) }));
    const go = button("Next", () => resolve(rows().filter((row) => row.answer !== "")), { className: "go" });
    show("Some questions", ...fields.map(({ line }) => line), element("div", { className: "row" }, go));
  });
}

async function thank(study, answers) {
  progress("");
  const state = element("p", { role: "status" });
  const again = button("Send again", () => send(), { hidden: true });
  const code = study.code && element("p", { hidden: Boolean(study.post) }, "Your code: ", element("strong", {}, study.code));
  const send = async () => {
    again.hidden = true;
    state.textContent = "Sending your answers …";
    try {
      await answers.post();
      state.textContent = "Your answers have been sent. You can close this page.";
      if (code) code.hidden = false;
    } catch (error) {
      state.textContent =
        `Your answers could not be sent: ${error.message}. They are kept in this browser; ` +
        "send them again, or save them and send them by mail.";
      again.hidden = false;
    }
  };
  show(
    "Thank you",
    ...paragraphs(study.thanks ?? "You have answered everything."),
    study.post ? state : null,
    code,
    element(
      "div",
      { className: "row" },
      again,
      button("Save my answers", () => answers.download(), { className: study.post ? "" : "go" }),
      button("Forget me on this browser", () => {
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
    progress(`${number + 1} of ${all.length}`);
    if (trial.number !== part && trial.part.intro)
      await page(trial.part.title ?? "Next part", trial.part.intro, "Go on");
    part = trial.number;
    answers.add(number + 1, await attempt(trial));
  }
  if (study.questions && answers.kept.done === all.length) answers.add(all.length + 1, await questions(study.questions));
  await thank(study, answers);
}

addEventListener("error", ({ message }) => console.error(message));
begin();
document.documentElement.dataset.ready = "yes";
