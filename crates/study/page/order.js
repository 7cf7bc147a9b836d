// From a study to the trials of one person, in order.

import { chance, shuffled } from "./random.js";

/** All trials: parts in the study's order, their trials by chance. What is A and what is B is chance too. */
export function trials(study, person) {
  const random = chance(`${study.seed}/${study.study}/${person}`);
  const all = [];
  study.parts.forEach((part, number) => {
    const made = [];
    for (const item of part.items) made.push(...KINDS[part.method](part, item, random));
    all.push(...shuffled(made, random).map((trial) => ({ ...trial, part, number, method: part.method })));
  });
  return all;
}

const KINDS = {
  paired(part, item, random) {
    const pairs = [];
    item.conditions.forEach((one, i) => {
      for (const other of item.conditions.slice(i + 1)) pairs.push(shuffled([one, other], random));
    });
    const repeated = Array.from({ length: part.repeats ?? 1 }, () => pairs).flat();
    return repeated.map(([a, b]) => ({
      item,
      sounds: [named("Reference", item.reference, "reference"), named("A", a), named("B", b)].filter(Boolean),
    }));
  },
  abx(part, item, random) {
    return Array.from({ length: part.repeats ?? 8 }, () => {
      const [a, b] = shuffled(item.conditions, random);
      const x = random() < 0.5 ? a : b;
      return { item, sounds: [named("A", a), named("B", b), named("X", x, "x")] };
    });
  },
  rating(part, item, random) {
    const hidden = item.reference
      ? [{ ...item.reference, name: item.reference.name ?? "Reference", role: "reference" }]
      : [];
    const anchors =
      part.anchor && item.reference ? [{ ...item.reference, name: "Anchor", role: "anchor", cut: 3500 }] : [];
    const rated = shuffled([...item.conditions, ...hidden, ...anchors], random);
    const letters = rated.map((sound, i) => named(String.fromCharCode(65 + i), sound, sound.role ?? "rated"));
    return [{ item, sounds: [named("Reference", item.reference, "open"), ...letters].filter(Boolean) }];
  },
};

/** A sound under the name that the listener sees. */
function named(label, sound, role = "rated") {
  return sound ? { label, role, name: sound.name, file: sound.file, gain: sound.gain ?? 1, cut: sound.cut } : null;
}
