// Builds the controls that come in numbers: sliders of settings, choices, and the list of sounds.

import { SETTINGS } from "./engine/settings.js";

/** Settings to change, with their names. */
const TRIMS = {
  direct: "Direct sound",
  early: "Early reflections",
  late: "Late sound",
  decay: "Decay",
  distanceLaw: "Fall with distance",
  width: "Width of the room",
  lowCut: "Low cut",
  stereoSpread: "Stereo spread",
};

const number = new Intl.NumberFormat("en", { maximumFractionDigits: 2, signDisplay: "auto" });

function words(setting, value) {
  if (setting.unit === "dB" && value <= setting.from) return "off";
  return `${number.format(value)}${setting.unit === "°" ? "" : " "}${setting.unit}`.trim();
}

/** Makes a range a setting's; `changed` is called with its value. */
export function slider(input, setting, name, changed) {
  const output = input.parentElement.querySelector("output");
  Object.assign(input, { min: setting.from, max: setting.to, step: setting.step, value: setting.at });
  const show = () => {
    const text = words(setting, Number(input.value));
    output.textContent = text;
    input.setAttribute("aria-valuetext", text);
  };
  input.setAttribute("aria-label", name);
  input.addEventListener("input", () => {
    show();
    changed(Number(input.value));
  });
  show();
  return (value) => {
    input.value = value;
    show();
  };
}

/** Sliders of all trims; gives what puts them back. */
export function trims(box, changed) {
  const back = Object.entries(TRIMS).map(([name, title]) => {
    const label = document.createElement("label");
    label.className = "slider";
    label.append(
      title,
      Object.assign(document.createElement("input"), { type: "range" }),
      document.createElement("output"),
    );
    box.append(label);
    const put = slider(label.querySelector("input"), SETTINGS[name], title, (value) => changed({ [name]: value }));
    return () => {
      put(SETTINGS[name].at);
      changed({ [name]: SETTINGS[name].at });
    };
  });
  return () => back.forEach((put) => put());
}

/** Fills a choice with pairs of value and text. */
export function choices(select, pairs, chosen) {
  select.replaceChildren(...pairs.map(([value, text]) => new Option(text, value, false, String(value) === String(chosen))));
}

/** The list of sounds, made anew. `on` has what happens: dry, scene, level, remove, here. */
export function soundList(list, voices, site, on) {
  list.replaceChildren(
    ...voices.map((voice, i) => {
      const item = document.createElement("li");
      const title = `Sound ${i + 1}`;
      const dry = document.createElement("select");
      dry.setAttribute("aria-label", `${title}: dry sound`);
      const own = voice.dry.kind === "site" || voice.dry.kind === "none" ? [] : [["own", voice.dry.name]];
      const kept = site.sounds.map((s, n) => [n, s.name]);
      const chosen = voice.dry.kind === "site" ? voice.dry.number : voice.dry.kind === "none" ? "none" : "own";
      choices(dry, [...own, ...kept, ["none", "nothing"]], chosen);
      dry.addEventListener("change", () => on.dry(voice, dry.value));
      item.append(dry);
      const level = Object.assign(document.createElement("input"), {
        type: "range",
        min: -40,
        max: 12,
        step: 1,
        value: voice.level,
      });
      level.style.width = "6rem";
      level.setAttribute("aria-label", `${title}: level`);
      const spoken = () => level.setAttribute("aria-valuetext", `${level.value} dB`);
      level.addEventListener("input", () => {
        spoken();
        on.level(voice, Number(level.value));
      });
      spoken();
      item.append(level);
      const remove = document.createElement("button");
      Object.assign(remove, { type: "button", textContent: "✕", disabled: voices.length < 2 });
      remove.setAttribute("aria-label", `Remove ${title.toLowerCase()}`);
      remove.addEventListener("click", () => on.remove(voice));
      item.append(remove);
      if (i > 0) {
        const here = Object.assign(document.createElement("button"), { type: "button", textContent: "Put here" });
        here.setAttribute("aria-label", `Put here: ${title.toLowerCase()}`);
        here.addEventListener("click", () => on.here(voice));
        item.append(here);
      }
      if (site.scenes.length > 1 && voices.length > 1) {
        const scene = document.createElement("select");
        scene.className = "where";
        scene.setAttribute("aria-label", `${title}: where it is played`);
        choices(scene, [["", "in this place"], ...site.scenes.map((s, n) => [n, s.name])], voice.scene ?? "");
        scene.addEventListener("change", () => on.scene(voice, scene.value === "" ? null : Number(scene.value)));
        item.append(scene);
      }
      return item;
    }),
  );
}
