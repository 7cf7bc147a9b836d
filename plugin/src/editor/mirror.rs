//! Tells the host of values that have come over Open Sound Control, as only an open editor can.

use super::ctx::Ctx;
use super::host::landed;
use crate::remote::Knob;

/// Sets every remote value that the host does not know of; values in quick succession are one gesture.
pub(super) fn mirror(ctx: &mut Ctx<'_>) {
    for knob in Knob::ALL {
        let params = &ctx.instance.params;
        if let Some(value) = params.remote.pending(knob, params.hosted(knob)) {
            params.remote.tell(knob, landed(params, knob, value));
            ctx.gestures.nudge(&ctx.host, knob, value, ctx.now_s);
        }
    }
}
