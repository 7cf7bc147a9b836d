// From a study to the trials of one person, in order.

import { chance, shuffled } from "./random.js";
import { text } from "./texts.js";

/** Hidden anchors of a rating and their low-pass, hertz (ITU-R BS.1534-3). */
const ANCHORS = { "Low anchor": 3500, "Mid anchor": 7000 };

/** All trials: parts in the study's order, their trials by chance. What is A and what is B is chance too. */
export function trials(study, person) {
  const random = chance(`${study.seed}/${study.study}/${person}`);
  return study.parts.flatMap((part, number) => {
    const kinds = part.items.flatMap((item) => KINDS[part.method](part, item, random));
    const repeats = part.repeats ?? (part.method === "abx" ? 8 : 1);
    return rounds(kinds, repeats, random).map((trial) => ({ ...trial, part, number, method: part.method }));
  });
}

/** Each kind of trial once a round, so that repeats are apart: none follows itself where there is another. */
function rounds(kinds, repeats, random) {
  const all = [];
  for (let round = 0; round < repeats; round++) {
    let order = shuffled(kinds, random);
    while (order.length > 1 && order[0] === all.at(-1)?.kind) order = shuffled(kinds, random);
    all.push(...order.map((kind) => ({ kind, ...kind(round) })));
  }
  return all.map(({ kind, ...trial }) => trial);
}

/** Two sounds that take sides by chance and then in turn: over an even number of repeats each is A as often as B. */
function sides(pair, random) {
  let order = null;
  return (round) => {
    order = round % 2 === 0 ? shuffled(pair, random) : [...order].reverse();
    return order;
  };
}

const KINDS = {
  paired(part, item, random) {
    const { conditions } = item;
    const all = conditions.flatMap((one, i) => conditions.slice(i + 1).map((other) => [one, other]));
    const chosen = part.pairs?.map((names) => names.map((name) => conditions.find((sound) => sound.name === name)));
    return (chosen ?? all).map((pair) => {
      const of = sides(pair, random);
      return (round) => {
        const [a, b] = of(round);
        const open = named(text("reference"), item.reference, "reference");
        return { item, sounds: [open, named("A", a), named("B", b)].filter(Boolean) };
      };
    });
  },
  abx(part, item, random) {
    const of = sides(item.conditions, random);
    return [
      (round) => {
        const [a, b] = of(round);
        // X is a coin's, whatever came before: else it could be told without listening.
        const x = random() < 0.5 ? a : b;
        return { item, sounds: [named("A", a), named("B", b), named("X", x, "x")] };
      },
    ];
  },
  rating(part, item, random) {
    const { reference } = item;
    const hidden = reference ? [{ ...reference, role: "reference" }] : [];
    const anchors = part.anchor && reference ? Object.entries(ANCHORS) : [];
    const all = [
      ...item.conditions,
      ...hidden,
      ...anchors.map(([name, cut]) => ({ ...reference, name, role: "anchor", cut })),
    ];
    return [
      () => {
        const letters = shuffled(all, random).map((sound, i) =>
          named(String.fromCharCode(65 + i), sound, sound.role ?? "rated"),
        );
        return { item, sounds: [named(text("reference"), reference, "open"), ...letters].filter(Boolean) };
      },
    ];
  },
};

/** A sound under the name that the listener sees. */
function named(label, sound, role = "rated") {
  return sound ? { gain: 1, ...sound, label, role } : null;
}
