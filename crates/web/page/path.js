// Walking a camera path: in the audio thread, to the sample; the page only shows where it is.

import { choices } from "./controls.js";

const at = (id) => document.getElementById(id);

export class PathWalk extends EventTarget {
  constructor(site, voices, listener) {
    super();
    Object.assign(this, { site, voices, listener, rows: [], playing: false });
    at("path-play").addEventListener("click", () => (this.playing ? this.stop() : this.play()));
    for (const id of ["path-loop", "path-head"])
      at(id).addEventListener("change", () => this.playing && this.play(this.along));
    at("path").addEventListener("change", async () => {
      this.use(await this.rowsFor());
      this.dispatchEvent(new Event("chosen"));
    });
    at("along").addEventListener("input", () => this.play(Number(at("along").value)));
  }

  get ownHead() {
    return at("path-head").checked;
  }

  /** Offers the paths of a scene, by its number, and no others: they would lead through its walls. */
  offer(scene) {
    const paths = this.site.paths.flatMap((path, n) => (path.scene === scene ? [[n, path.name]] : []));
    choices(at("path"), paths, paths[0]?.[0]);
  }

  /** Rows of the path that is chosen. */
  async rowsFor() {
    const { value } = at("path");
    const path = value === "" ? null : this.site.paths[Number(value)];
    return path ? this.site.json(path.file) : [];
  }

  use(rows) {
    this.stop();
    this.rows = rows;
    this.voices.setPath(rows);
    const none = rows.length < 2;
    at("path-row").hidden = at("along-row").hidden = none;
    if (!none) at("along").max = this.length;
    this.show(0);
  }

  get length() {
    return this.rows.at(-1)[0] - this.rows[0][0];
  }

  play(from = 0) {
    if (this.rows.length < 2) return;
    this.playing = true;
    this.along = from;
    this.voices.each((engine) => engine.walk({ from, loop: at("path-loop").checked, ownHead: this.ownHead }));
    at("path-play").setAttribute("aria-pressed", "true");
    at("path-play").textContent = "Leave the path";
  }

  stop() {
    if (!this.playing) return;
    this.playing = false;
    this.voices.each((engine) => engine.stop());
    at("path-play").setAttribute("aria-pressed", "false");
    at("path-play").textContent = "Walk the path";
  }

  /** Takes the pose that is heard, and the seconds along the path. */
  heard([x, y, z, qx, qy, qz, qw, along]) {
    if (!this.playing || along < 0) return;
    if (this.ownHead) this.listener.position = [x, y, z];
    else this.listener.set([x, y, z], [qx, qy, qz, qw]);
    const loop = at("path-loop").checked;
    this.along = loop ? along % this.length : Math.min(along, this.length);
    this.show(this.along);
    if (!loop && along >= this.length) this.stop();
  }

  show(along) {
    at("along").value = along;
    const text = `${along.toFixed(1)} s`;
    at("along-row").querySelector("output").textContent = text;
    at("along").setAttribute("aria-valuetext", text);
  }
}
