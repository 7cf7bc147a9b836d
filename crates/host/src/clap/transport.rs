//! The transport as CLAP reports it to a plugin.

use crate::rounded;
use crate::setup::Position;
use clack_host::events::EventFlags;
use clack_host::events::event_types::{TransportEvent, TransportFlags};
use clack_host::prelude::EventHeader;
use clack_host::utils::{BeatTime, SecondsTime};

/// The transport at the first sample of a block.
pub(crate) fn at(position: Position, tempo: Option<f64>) -> TransportEvent {
    let mut flags = TransportFlags::HAS_SECONDS_TIMELINE | TransportFlags::IS_PLAYING;
    if tempo.is_some() {
        flags |= TransportFlags::HAS_TEMPO | TransportFlags::HAS_BEATS_TIMELINE | TransportFlags::HAS_TIME_SIGNATURE;
    }
    let tempo = tempo.unwrap_or(0.0);
    let beats = position.seconds * tempo / 60.0;
    let bar = (beats / 4.0).floor();
    let bar_number = i32::try_from(rounded(bar)).unwrap_or(i32::MAX);
    TransportEvent {
        header: EventHeader::new_core(0, EventFlags::empty()),
        flags,
        song_pos_beats: BeatTime::from_float(beats),
        song_pos_seconds: SecondsTime::from_float(position.seconds),
        tempo,
        tempo_inc: 0.0,
        loop_start_beats: BeatTime::from_float(0.0),
        loop_end_beats: BeatTime::from_float(0.0),
        loop_start_seconds: SecondsTime::from_float(0.0),
        loop_end_seconds: SecondsTime::from_float(0.0),
        bar_start: BeatTime::from_float(bar * 4.0),
        bar_number,
        time_signature_numerator: 4,
        time_signature_denominator: 4,
    }
}
