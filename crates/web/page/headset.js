// A headset by WebXR: its pose is the listener's, and the place is drawn for both eyes.

import { add, angles, multiply, ofAngles, product, turn } from "./turns.js";

/** A headset's axes (x right, y up, z back) in ours. */
export const position = ({ x, y, z }) => [-z, -x, y];
export const orientation = ({ x, y, z, w }) => [-z, -x, y, w];

/** Our world in a headset's axes, as a matrix of columns. */
const WORLD = [0, 0, -1, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1];

export class Headset {
  constructor(stage, listener) {
    Object.assign(this, { stage, listener, session: null });
  }

  /** Whether there is one. */
  static async isHere() {
    return Boolean(await navigator.xr?.isSessionSupported("immersive-vr").catch(() => false));
  }

  /** Begins; `moved` is called with each frame's time in seconds, `ended` at the end. Throws where it is refused. */
  async enter(moved, ended) {
    const session = await navigator.xr.requestSession("immersive-vr", { optionalFeatures: ["local-floor"] });
    const { stage, listener } = this;
    await stage.gl.makeXRCompatible();
    session.updateRenderState({ baseLayer: new XRWebGLLayer(session, stage.gl) });
    const space = await session.requestReferenceSpace("local");
    this.session = session;
    // The headset begins where the listener stands, and faces as the listener does.
    const origin = [...listener.position];
    const yaw = ofAngles(listener.heading, 0, 0);
    let first = null;
    const frame = (time, xr) => {
      if (this.session !== session) return;
      session.requestAnimationFrame(frame);
      const pose = xr.getViewerPose(space);
      if (!pose) return;
      const at = position(pose.transform.position);
      const turned = orientation(pose.transform.orientation);
      first ??= { at, back: ofAngles(-angles(turned)[0], 0, 0) };
      const base = multiply(yaw, first.back);
      listener.position = listener.within(
        add(
          origin,
          turn(
            base,
            at.map((v, i) => v - first.at[i]),
          ),
        ),
      );
      listener.head = multiply(base, turned);
      moved(time / 1000);
      this.draw(session, pose, origin, base, first.at);
    };
    session.requestAnimationFrame(frame);
    session.addEventListener("end", () => {
      this.session = null;
      [listener.yaw, listener.pitch, listener.roll] = angles(listener.head ?? yaw);
      listener.head = null;
      ended();
    });
  }

  leave() {
    return this.session?.end();
  }

  draw(session, pose, origin, base, first) {
    const { stage } = this;
    const { gl } = stage;
    const layer = session.renderState.baseLayer;
    if (!layer || stage.lost) return;
    gl.bindFramebuffer(gl.FRAMEBUFFER, layer.framebuffer);
    stage.clear();
    // From our world to the headset's: to the origin, turned back, moved by where the headset was first, axes exchanged.
    const back = [-base[0], -base[1], -base[2], base[3]];
    const columns = [turn(back, [1, 0, 0]), turn(back, [0, 1, 0]), turn(back, [0, 0, 1])];
    const at = add(
      turn(
        back,
        origin.map((v) => -v),
      ),
      first,
    );
    const world = product(WORLD, [...columns.flatMap((c) => [...c, 0]), ...at, 1]);
    for (const view of pose.views) {
      const { x, y, width, height } = layer.getViewport(view);
      gl.viewport(x, y, width, height);
      const camera = product(Array.from(view.projectionMatrix), product(Array.from(view.transform.inverse.matrix), world));
      stage.drawWith(camera, height, this.listener.pose, false);
    }
  }
}
