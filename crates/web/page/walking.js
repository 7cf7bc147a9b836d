// How fast one walks and turns, and the keys of both; for every page on which a listener walks.

/** Metres and radians a second. */
export const WALK = 1.4;
export const TURN = 1.6;
/** Time in which a walk takes up, seconds. */
export const EASE_S = 0.12;
export const KEYS = {
  ArrowUp: "forward",
  KeyW: "forward",
  ArrowDown: "back",
  KeyS: "back",
  ArrowLeft: "left",
  KeyA: "left",
  ArrowRight: "right",
  KeyD: "right",
  KeyQ: "turn-left",
  KeyE: "turn-right",
};

/** Where a pressed key leads, wherever the focus is: not where a control has that key for itself. */
export function keyOf({ code, target, ctrlKey, metaKey, altKey }) {
  if (ctrlKey || metaKey || altKey || target.matches?.("select, textarea, input[type=text]")) return undefined;
  if (code.startsWith("Arrow") && target.matches?.("input[type=range], input[type=radio]")) return undefined;
  return KEYS[code];
}
