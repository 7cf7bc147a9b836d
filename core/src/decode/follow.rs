//! Follows the listener's pose by the scene's decoder, and tells the render head what has changed.

use crate::decode::field::FieldDecoder;
use crate::decode::live::{DecodeWorker, Decoded, LiveDecoder};
use crate::decode::{Change, Decoder, Hops, TURNS};
use crate::{LiveParams, Pose, Scene, TransferFunction};
use std::sync::Arc;

/// Hops over which the time filters of a new pose are taken in, a share of them at each hop.
const REFRESH_HOPS: usize = 16;
/// Hops over which explicit taps at low frequencies take a new pose in ...
const QUICK_HOPS: usize = 8;
/// ... but the first, which are the loudest, follow at every hop.
const EARLY_TAPS: usize = 12;
/// Both where measured responses carry them: their interference moves, and its steps are heard beside a tone that it makes
/// faint.
const MEASURED_QUICK_HOPS: usize = 4;
const MEASURED_EARLY_TAPS: usize = 24;
/// These follow at high frequencies whenever it is the turn of their bins: high tones would flutter.
const MEASURED_TURNED_TAPS: usize = 16;

/// The decoders of one stream. Made with its voice; the audio thread asks it for a transfer function at each hop.
pub(crate) struct Follower {
    field: Option<FieldDecoder>,
    live: Option<LiveDecoder>,
    /// Heard where the scene has neither.
    silent: TransferFunction,
    /// Hops of the render head's time filters, and explicit taps among them.
    filter_hops: usize,
    taps: usize,
    /// Hops over which taps are taken in at low frequencies, and those of them that follow at every hop.
    quick_hops: usize,
    early_taps: usize,
    /// Explicit taps that follow at high frequencies with every turn.
    turned_taps: usize,
    /// Times as many hops that all take.
    refresh: usize,
    /// Shares of the time filters that still have to follow.
    stale_shares: usize,
}

impl Follower {
    /// For `filter_hops` hops of time filters, `taps` explicit ones first.
    pub(crate) fn new(scene: &Arc<Scene>, filter_hops: usize, taps: usize) -> Self {
        let (field, silent) = (FieldDecoder::new(scene, taps), scene.shape().silent());
        let measured = scene.measured().is_some();
        let quick_hops = if measured { MEASURED_QUICK_HOPS } else { QUICK_HOPS };
        let early_taps = if measured { MEASURED_EARLY_TAPS } else { EARLY_TAPS }.min(taps);
        let turned_taps = if measured { MEASURED_TURNED_TAPS.min(taps) } else { 0 };
        Self {
            field,
            live: None,
            silent,
            filter_hops,
            taps,
            quick_hops,
            early_taps,
            turned_taps,
            refresh: scene.parts().refresh,
            stale_shares: 0,
        }
    }

    /// Gives the stream a live decoder, which is heard in place of the table.
    pub(crate) fn set_live(&mut self, worker: Box<dyn DecodeWorker>, scene: &Scene, hop_s: f64) {
        self.live = Some(LiveDecoder::new(worker, scene, hop_s));
    }

    /// The transfer function that is heard now; time filters beyond the last [`Change`] may be those of an older pose.
    pub(crate) fn transfer(&self) -> &TransferFunction {
        match (&self.live, &self.field) {
            (Some(live), _) => live.transfer(),
            (_, Some(field)) => field.transfer(),
            _ => &self.silent,
        }
    }

    /// The newest result of the live decoder.
    pub(crate) fn decoded(&self) -> Option<&Decoded> {
        self.live.as_ref().map(LiveDecoder::shown)
    }

    /// Is as new again: the next pose is the first, and time filters begin with the same share.
    pub(crate) fn reset(&mut self) {
        self.stale_shares = 0;
        self.live.iter_mut().for_each(LiveDecoder::reset);
    }

    /// Brings all time filters up to date over the next hops, though the pose may stay.
    pub(crate) fn refresh(&mut self) {
        self.stale_shares = REFRESH_HOPS;
    }

    /// Follows to a pose: the direct sound at once, the time filters a share per hop, or all of them if `whole`; `share` counts
    /// hops.
    pub(crate) fn follow(&mut self, pose: &Pose, params: &LiveParams, (whole, share): (bool, usize)) -> Change {
        // Each group of bins keeps its turn, and leaves out all but every so many.
        let turn = share % TURNS;
        let round = share / TURNS + turn;
        let is_due = round.is_multiple_of(self.refresh);
        let share = if self.refresh > 1 { round / self.refresh * TURNS + turn } else { share } % REFRESH_HOPS;
        let turn = Some(turn);
        let decoder: &mut dyn Decoder = match (&mut self.live, &mut self.field) {
            (Some(live), _) => live,
            (None, Some(field)) => field,
            (None, None) => return Change { turn, ..Change::default() },
        };
        let direct = decoder.follow(pose, whole, params);
        if direct {
            self.stale_shares = REFRESH_HOPS;
        }
        let mut change = Change { direct, turn, ..Change::default() };
        if whole {
            self.stale_shares = 0;
            change = Change { direct, ..Change::whole(self.filter_hops, self.taps) };
        } else if self.stale_shares > 0 && is_due {
            self.stale_shares -= 1;
            // Taken by turns, so that a listener who turns hears the room follow in small steps rather than the early part in
            // one: each of the groups of bins has its turn with each class of hops.
            let (class, early) = ((share + share / TURNS) % TURNS, self.early_taps);
            let rest = Hops { first: class, end: self.filter_hops, step: TURNS };
            change.filters = [Hops::all(self.turned_taps), rest];
            let later = early + (class + share - share % TURNS) % self.quick_hops;
            change.quick = [Hops::all(early), Hops { first: later, end: self.taps, step: self.quick_hops }];
        }
        decoder.update_filters(&change);
        change
    }
}
