// Pictures beside a sound: of each stimulus one, or two that a shader blends at each moment's weight of the sound (the temporal
// composite of Harvey, Debattista, Bashford-Rogers and Chalmers 2017). Blended is light, not the code of sRGB.

import { element } from "./parts.js";
import { program } from "./shader.js";
import { text } from "./texts.js";

const VERTEX = `#version 300 es
out vec2 at;
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  at = vec2(corner.x, 1.0 - corner.y);
  gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
}`;
const FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D first;
uniform sampler2D second;
uniform float weight;
in vec2 at;
out vec4 colour;
void main() {
  vec3 light = mix(texture(first, at).rgb, texture(second, at).rgb, weight);
  vec3 shown = mix(12.92 * light, 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, light));
  colour = vec4(shown, 1.0);
}`;

async function bitmap(file) {
  const response = await fetch(file);
  if (!response.ok) throw new Error(`${file}: ${text("server answers", response)}`);
  try {
    const options = { colorSpaceConversion: "none", premultiplyAlpha: "none" };
    return await createImageBitmap(await response.blob(), options);
  } catch {
    throw new Error(text("no picture", { file }));
  }
}

export class Pictures {
  /** Those of a trial's sounds, which `deck` plays; `weights` are `of` numbers, `hz` a second. */
  static async open(sounds, weights, deck) {
    const names = [...new Set(sounds.flatMap((sound) => sound.pictures))];
    const bitmaps = await Promise.all(names.map(bitmap));
    const { width, height } = bitmaps[0];
    const canvas = element("canvas", { className: "picture", width, height, role: "img" });
    const gl = canvas.getContext("webgl2", { antialias: false });
    if (!gl) throw new Error(text("no shader"));
    const pictures = new Pictures();
    Object.assign(pictures, { element: canvas, gl, sounds, weights, deck, shown: undefined });
    const blend = (pictures.program = program(gl, VERTEX, FRAGMENT));
    if (!blend) throw new Error(text("no shader"));
    gl.useProgram(blend);
    gl.uniform1i(gl.getUniformLocation(blend, "first"), 0);
    gl.uniform1i(gl.getUniformLocation(blend, "second"), 1);
    pictures.textures = new Map(names.map((name, i) => [name, texture(gl, bitmaps[i])]));
    bitmaps.forEach((picture) => picture.close());
    canvas.addEventListener("webglcontextlost", () => {
      if (!pictures.closed) deck.dispatchEvent(new CustomEvent("trouble", { detail: text("pictures lost") }));
    });
    const frame = () => {
      if (pictures.closed) return;
      pictures.draw();
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
    return pictures;
  }

  /** The sound's weight at a time, on the line between two of its numbers. */
  weight(seconds) {
    const { hz, of } = this.weights;
    const at = Math.min(seconds * hz, of.length - 1);
    const [before, after] = [of[Math.floor(at)], of[Math.ceil(at)]];
    return before + (after - before) * (at % 1);
  }

  /** The picture of what is heard, as it is now; nothing in silence. */
  draw() {
    const { gl, program, textures, sounds, deck, element: canvas } = this;
    if (deck.current === null) {
      gl.clear(gl.COLOR_BUFFER_BIT);
    } else {
      const { label, pictures } = sounds[deck.current];
      const { position } = deck;
      const weight = pictures.length > 1 ? this.weight(position) : 0;
      [pictures[0], pictures.at(-1)].forEach((name, unit) => {
        gl.activeTexture(gl.TEXTURE0 + unit);
        gl.bindTexture(gl.TEXTURE_2D, textures.get(name));
      });
      gl.uniform1f(gl.getUniformLocation(program, "weight"), weight);
      gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
      Object.assign(canvas.dataset, { weight: weight.toFixed(4), seconds: position.toFixed(4) });
      if (this.shown !== label) canvas.setAttribute("aria-label", text("shown", { label }));
      this.shown = label;
    }
  }

  close() {
    this.closed = true;
    this.gl.getExtension("WEBGL_lose_context")?.loseContext();
  }
}

function texture(gl, picture) {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, gl.RGBA, gl.UNSIGNED_BYTE, picture);
  for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
  for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
  return made;
}
