// Pieces of the page.

/** An element with properties and children. */
export function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name in made && typeof value !== "string") made[name] = value;
    else made.setAttribute(name === "className" ? "class" : name, value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

export const button = (text, onclick, properties = {}) =>
  element("button", { type: "button", onclick, ...properties }, text);

/** A paragraph for each empty line between. */
export const paragraphs = (text) => text.split(/\n\s*\n/).map((part) => element("p", {}, part));

const main = document.getElementById("main");

/** Shows a page, and tells who cannot see. */
export function show(title, ...children) {
  const head = element("h2", { tabIndex: -1 }, title);
  main.replaceChildren(head, ...children.filter(Boolean));
  head.focus({ preventScroll: true });
  scrollTo(0, 0);
}

/** Says something to who cannot see. */
export function say(text) {
  document.getElementById("said").textContent = text;
}

export function progress(text) {
  document.getElementById("progress").textContent = text;
}

/** Shortcuts by digit, letter or Enter, by the place of the key, as long as the page is shown. */
export function shortcuts(keys) {
  const listen = (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
    // A button that has the focus is pressed by Enter itself, and texts are written.
    if (event.target.matches?.("input[type=text], textarea, select")) return;
    if (event.key === "Enter" && event.target.matches?.("button, summary, a")) return;
    const press = keys[event.code.replace(/^(Key|Digit|Numpad)/, "").toLowerCase()];
    if (!press || press.disabled || press.hidden) return;
    event.preventDefault();
    press.click();
  };
  addEventListener("keydown", listen);
  return () => removeEventListener("keydown", listen);
}
