// A Web Worker that reads scenes and decodes poses, so that the audio thread does neither.
//
// A scene is read in an instance of the module here; its whole memory is then handed to the audio thread, where another
// instance goes on with it. No shared memory is needed, so any static server will do.

import { Instance } from "./module.js";

let module = null;
/** Instances that decode for a slot of an engine, by name. */
const decoders = new Map();

const answers = {
  module({ module: compiled }) {
    module = compiled;
    return {};
  },

  /** Reads a scene; gives its description, points to draw, and the memory of an instance that is ready to play it. */
  prepare({ name, rate, scene, head, headphones, secondEmitter, inline, further, accuracy }) {
    const made = new Instance(module);
    made.f.start(rate);
    if (head) made.take("head", head);
    if (headphones) made.take("headphones", headphones);
    made.take("load", scene, (secondEmitter ? 1 : 0) + (inline ? 2 : 0), further ?? 0, accuracy ?? 0);
    made.f.describe();
    const description = JSON.parse(made.text());
    const anchors = made.row(made.f.points(0));
    const images = made.row(made.f.points(1));
    decoders.delete(name);
    if (description.live && !inline) decoders.set(name, made);
    else made.f.lighten();
    made.f.room(0);
    const memory = made.f.memory.buffer.slice(0);
    return { description, anchors, images, memory };
  },

  /** Connects a port of an audio thread, which asks for poses. */
  connect({ port }) {
    port.onmessage = ({ data: { closed, name, slot, voice, pose } }) => {
      if (closed) return port.close();
      const decoder = decoders.get(name);
      if (!decoder) return;
      const row = decoder.row(decoder.f.decode(...pose));
      port.postMessage({ slot, voice, row }, [row.buffer]);
    };
    return {};
  },

  forget({ name }) {
    decoders.delete(name);
    return {};
  },
};

onmessage = ({ data }) => {
  try {
    const answer = answers[data.kind](data);
    const moved = [answer.memory, answer.anchors?.buffer, answer.images?.buffer].filter(Boolean);
    postMessage({ id: data.id, answer }, moved);
  } catch (error) {
    postMessage({ id: data.id, error: String(error.message ?? error) });
  }
};
