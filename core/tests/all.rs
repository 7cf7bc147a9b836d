//! The integration tests of this package in one program: what they share is compiled and linked once.

use assert_no_alloc::AllocDisabler;

mod cloud_clip;
mod cloud_decoders;
mod cloud_stream;
mod conventions;
mod extremes;
mod further;
mod head;
mod headphones;
mod images;
mod knob;
mod latency;
mod limits;
mod live;
mod measured;
mod mixing;
mod oracle;
mod realtime;
mod reset;
mod scene_file;
mod setting;
mod sound;
mod stereo;
mod tail_modulation;
mod trim;
mod waves;

/// Aborts a test that allocates where it must not.
#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;
