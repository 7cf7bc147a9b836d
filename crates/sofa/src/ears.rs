//! Ears that contradict the directions.

/// A response of a source to one side.
#[derive(Clone, Copy, Debug)]
pub struct Sided {
    /// Part of the direction towards the left ear, -1 to 1.
    pub lateral: f32,
    /// Interaural time difference, seconds, positive when the left ear is later.
    pub itd_s: f64,
    /// Interaural level difference, dB, positive when the left ear is louder.
    pub ild_db: f64,
}

/// Whether most sources well to one side are both earlier and louder at the other side's ear: mirrored azimuths or swapped
/// ears, which real files have. Small differences are no evidence.
pub fn ears_contradict(responses: impl IntoIterator<Item = Sided>) -> bool {
    let (mut agree, mut contradict) = (0, 0);
    for r in responses {
        let side = f64::from(r.lateral.signum());
        if r.itd_s * side > 50e-6 && r.ild_db * side < -0.5 {
            contradict += 1;
        } else {
            agree += 1;
        }
    }
    contradict > 3 * agree
}
