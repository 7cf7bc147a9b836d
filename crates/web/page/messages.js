// States that the listener must know of: a sentence, and a button that leads back.

const box = document.getElementById("messages");
const shown = new Map();

/** Shows a message in place of an older one of the same name. `action` is a label and what to do. */
export function show(name, text, { action, calm = false } = {}) {
  clear(name);
  const message = document.createElement("div");
  message.className = calm ? "message calm" : "message";
  message.dataset.name = name;
  if (!calm) message.setAttribute("role", "alert");
  const words = document.createElement("span");
  words.textContent = text;
  message.append(words);
  if (action) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = action[0];
    button.addEventListener("click", () => {
      clear(name);
      action[1]();
    });
    message.append(button);
  }
  box.append(message);
  shown.set(name, message);
}

/** Takes a message away. */
export function clear(name) {
  shown.get(name)?.remove();
  shown.delete(name);
}

/** Says something to who cannot see. */
export function say(text) {
  document.getElementById("said").textContent = text;
}
