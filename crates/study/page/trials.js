// One trial on the page. Each gives its rows once it is answered.

import { FileDeck, LiveDeck } from "./deck.js";
import { button, element, say, shortcuts, show } from "./parts.js";
import { Pictures } from "./pictures.js";
import { text } from "./texts.js";
import { Walker } from "./walker.js";

/** Keys of answers, beside those that walk (W A S D Q E) and those that play (digits). */
const ANSWER_KEYS = ["j", "k", "l"];
/** The shortest stretch that goes round, seconds. */
const LEAST_ROUND = 0.1;
/** Seconds for which a name is shown before its sound. */
const CUE_S = 1.2;

/** Runs a trial to its answer. */
export async function run(context, trial) {
  const without = trial.method === "abx" || trial.item.reference ? "" : " without";
  const question = trial.part.question ?? text(`${trial.method} question${without}`);
  show(question, element("p", { className: "soft", role: "status" }, text("loading")));
  const { item, sounds } = trial;
  const deck = item.dry ? await LiveDeck.open(context, sounds, item.dry) : await FileDeck.open(context, sounds);
  const pictures = item.weights && (await Pictures.open(sounds, item.weights, deck));
  const stage = new Stage(deck, trial, question, pictures);
  const begun = context.currentTime;
  try {
    const rows = await VIEWS[trial.method](stage);
    const seconds = (context.currentTime - begun).toFixed(1);
    const part = trial.number + 1;
    return trial.part.training ? [] : rows.map((row) => ({ part, method: trial.method, item: item.name, seconds, ...row }));
  } finally {
    stage.close();
  }
}

/** The sounds of a trial, their buttons, and the plan of a live one. */
class Stage {
  constructor(deck, trial, question, pictures) {
    Object.assign(this, { deck, trial, question, pictures });
    this.least = trial.part.listen_s ?? 2;
    this.buttons = trial.sounds.map((sound, i) =>
      button(sound.label, () => this.select(i), { "aria-pressed": "false" }),
    );
    this.over = element("input", { type: "checkbox" });
    this.loop = element("input", { type: "checkbox", checked: true });
    this.trouble = element("p", { className: "message", role: "alert", hidden: true });
    deck.addEventListener("change", () => this.mark());
    deck.addEventListener("trouble", ({ detail }) =>
      Object.assign(this.trouble, { textContent: detail, hidden: false }),
    );
    if (trial.item.dry) {
      this.walker = new Walker(trial.item.place, (position, quaternion) => deck.pose(position, quaternion));
      deck.jump(this.walker.position, this.walker.quaternion);
    }
    this.view = (this.walker ?? pictures)?.element;
    this.timer = setInterval(() => this.mark(), 100);
  }

  close() {
    clearInterval(this.timer);
    this.unlisten?.();
    this.walker?.close();
    this.pictures?.close();
    this.deck.close();
  }

  select(index) {
    this.deck.select(index, { over: this.over.checked, loop: this.loop.checked });
    this.mark();
  }

  isHeard(index) {
    return this.deck.seconds(index) >= this.deck.least(index, this.least);
  }

  /** Marks what is heard and what has been heard, and opens the answers when all has. */
  mark() {
    this.buttons.forEach((b, i) => {
      b.setAttribute("aria-pressed", String(this.deck.current === i));
      const heard = this.isHeard(i);
      if (heard && !b.classList.contains("heard")) b.setAttribute("aria-label", text("heard", { label: b.textContent }));
      b.classList.toggle("heard", heard);
    });
    const all = this.buttons.every((_, i) => this.isHeard(i));
    if (all && !this.all) {
      this.all = true;
      say(text("all heard"));
    }
    this.changed?.(this.all === true);
  }

  get controls() {
    const stop = button(text("pause"), () => this.deck.stop());
    return element("div", { className: "row sounds", role: "group", "aria-label": text("sounds") }, ...this.buttons, stop);
  }

  get options() {
    if (this.walker) return null;
    const check = (input, words) => element("label", { className: "check" }, input, words);
    const { length } = this.deck;
    const [from, to] = [0, length].map((value) =>
      element("input", { type: "range", min: "0", max: String(length), step: "0.05", value: String(value) }),
    );
    const take = () => {
      const end = Math.max(Number(to.value), LEAST_ROUND);
      this.deck.goRound(Math.min(Number(from.value), end - LEAST_ROUND), end);
    };
    for (const end of [from, to]) end.addEventListener("input", take);
    return element(
      "div",
      { className: "row" },
      check(this.loop, text("again and again")),
      element("label", { className: "check" }, text("from"), from),
      element("label", { className: "check" }, text("to"), to),
      check(this.over, text("from the beginning")),
    );
  }

  get hint() {
    const words = [text("listen", { seconds: this.least }), text("every sound heard")];
    const hint = element("p", { className: "soft" }, words[0]);
    const before = this.changed;
    this.changed = (all) => {
      before?.(all);
      hint.textContent = words[all ? 1 : 0];
    };
    return hint;
  }
}

/** Answers, which open once everything has been heard: one is chosen, can be changed, and counts with "Next". */
function choice(stage, labels) {
  return new Promise((resolve) => {
    let chosen = null;
    const next = button(text("next"), () => resolve(chosen), { className: "go", disabled: true });
    const choose = (place) => {
      chosen = place;
      made.forEach((b, i) => b.setAttribute("aria-pressed", String(i === place)));
      next.disabled = false;
      say(text("chosen", { answer: labels[place] }));
    };
    const made = labels.map((label, i) =>
      button(label, () => choose(i), { className: "answer", disabled: true, "aria-pressed": "false" }),
    );
    stage.changed = (all) => made.forEach((b) => (b.disabled = !all));
    const numbers = Object.fromEntries(stage.buttons.map((b, i) => [String(i + 1), b]));
    const letters = Object.fromEntries(made.map((b, i) => [ANSWER_KEYS[i], b]));
    stage.unlisten = shortcuts({ ...numbers, ...letters, enter: next });
    const hint = stage.hint;
    const keys = { last: stage.buttons.length, letters: Object.keys(letters).join(", ").toUpperCase() };
    const answers = element("div", { className: "row", role: "group", "aria-label": text("answer") }, ...made, next);
    show(
      stage.question,
      stage.trouble,
      stage.view,
      stage.controls,
      stage.options,
      hint,
      answers,
      element("p", { className: "soft" }, text("answer keys", keys)),
    );
    stage.mark();
  });
}

/** Plays reference, A, reference, B or another order by itself, each for the same time. */
async function sequence(stage, order, seconds) {
  const { deck, trial } = stage;
  const cue = element("div", { className: "card cue", "aria-live": "assertive" });
  const begin = new Promise((resolve) => {
    const go = button(text("begin"), resolve, { className: "go" });
    const names = order.map((label) => (label === "R" ? text("the reference") : label)).join(", ");
    show(
      stage.question,
      stage.trouble,
      element("p", {}, text("will hear", { names, seconds })),
      stage.view,
      element("div", { className: "row" }, go),
    );
    go.focus();
  });
  await begin;
  show(stage.question, stage.trouble, cue, stage.view);
  const wait = (s) => new Promise((resolve) => setTimeout(resolve, 1000 * s));
  for (const label of order) {
    const index = label === "R" ? 0 : trial.sounds.findIndex((sound) => sound.label === label);
    cue.textContent = trial.sounds[index].label;
    await wait(CUE_S);
    deck.select(index, { over: true, loop: true });
    await wait(seconds);
    deck.stop();
  }
}

const VIEWS = {
  async paired(stage) {
    const { part, sounds } = stage.trial;
    const [a, b] = sounds.slice(-2);
    const order = part.sequence ?? (stage.walker || sounds.length === 2 ? null : ["R", "A", "R", "B"]);
    if (order) await sequence(stage, order, part.seconds ?? 5);
    if (order) {
      // Everything has been heard; who wants to hear more may.
      stage.isHeard = () => true;
    }
    const none = part.no_preference ? [text("no preference")] : [];
    const labels = ["A", "B"].map((label) => text("my answer", { label }));
    const answer = [a.name, b.name, ""][await choice(stage, [...labels, ...none])];
    return [{ a: a.name, b: b.name, answer }];
  },

  async abx(stage) {
    const [a, b, x] = stage.trial.sounds;
    const labels = ["A", "B"].map((label) => text("X is", { label }));
    const answer = (await choice(stage, labels)) === 0 ? a : b;
    return [{ a: a.name, b: b.name, x: x.name, answer: answer.name }];
  },

  rating(stage) {
    return new Promise((resolve) => {
      const { sounds, part } = stage.trial;
      const scale = part.words ?? text("scale").split(", ");
      const touched = new Set();
      const done = button(text("next"), () => finish(), { className: "go", disabled: true });
      const rated = sounds.map((sound, i) => ({ sound, i })).filter(({ sound }) => sound.role !== "open");
      const sliders = rated.map(({ sound, i }) => {
        const out = element("output", {}, "–");
        const slider = element("input", {
          type: "range",
          className: "untouched",
          min: "0",
          max: "100",
          step: "1",
          value: "50",
          "aria-label": text("rating of", { label: sound.label }),
        });
        const take = () => {
          touched.add(i);
          slider.classList.remove("untouched");
          out.textContent = slider.value;
          // A rating of what is heard: who moves a slider hears its sound.
          if (stage.deck.current !== i) stage.select(i);
          const word = scale[Math.min(scale.length - 1, Math.floor((slider.value * scale.length) / 100))];
          slider.setAttribute("aria-valuetext", `${slider.value}, ${word}`);
          stage.mark();
        };
        slider.addEventListener("input", take);
        slider.addEventListener("change", take);
        slider.addEventListener("pointerdown", () => stage.deck.current !== i && stage.select(i));
        return { sound, slider, line: element("div", { className: "rating" }, stage.buttons[i], slider, out) };
      });
      const finish = () =>
        resolve(
          sliders.map(({ sound, slider }) => ({
            a: sound.name,
            rating: slider.value,
            role: sound.role === "rated" ? "" : sound.role,
          })),
        );
      stage.changed = (all) => (done.disabled = !all || touched.size < sliders.length);
      const hint = stage.hint;
      const open = stage.buttons.filter((_, i) => sounds[i].role === "open");
      stage.unlisten = shortcuts(Object.fromEntries(stage.buttons.map((b, i) => [String(i + 1), b])));
      const words = element(
        "div",
        { className: "words", "aria-hidden": "true" },
        element("div", {}, ...scale.map((word) => element("span", {}, word))),
      );
      show(
        stage.question,
        stage.trouble,
        stage.view,
        element(
          "div",
          { className: "row sounds", role: "group", "aria-label": text(open.length > 0 ? "reference" : "sound") },
          ...open,
          button(text("pause"), () => stage.deck.stop()),
        ),
        stage.options,
        element("div", { className: "card sounds" }, words, ...sliders.map(({ line }) => line)),
        hint,
        element(
          "p",
          { className: "soft" },
          [text("move every slider"), ...(open.length > 0 ? [text("one is the reference")] : [])].join(" "),
        ),
        element("div", { className: "row" }, done),
      );
      stage.mark();
    });
  },
};
