//! What an input has that a host does not feed.

/// Longer blocks get no silence, samples.
const LONGEST: usize = 8192;

static SILENCE: [f32; LONGEST] = [0.0; LONGEST];

/// A pointer to a pointer, to be shared between threads.
struct Channel(*mut f32);

#[expect(unsafe_code, reason = "what it points to is never written")]
// SAFETY: it points to a constant.
unsafe impl Sync for Channel {}

static CHANNEL: Channel = Channel(SILENCE.as_ptr().cast_mut());

/// One silent channel of so many samples, as hosts hand over channels; nobody may write to it. Null where there are too many
/// samples, which the framework takes for silence too, and says so in development builds.
pub(super) fn channel(samples: usize) -> *mut *mut f32 {
    if samples <= LONGEST { (&raw const CHANNEL.0).cast_mut() } else { std::ptr::null_mut() }
}
