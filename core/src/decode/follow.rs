//! Brings the render head to the listener's pose, from a field or from a live decoder.

use crate::decode::field::{Cell, Field};
use crate::decode::live::{DecodeWorker, Decoded, Live};
use crate::render::head::RenderHead;
use crate::{Pose, Quality, Scene, Tier, TransferFunction};

/// Hops over which the time filters of a new pose are taken in, a share of them at each hop.
const REFRESH_HOPS: usize = 4;

/// Decoder of one stream.
pub(crate) struct Decoding {
    cell: Option<Cell>,
    live: Option<Live>,
    hop_s: f64,
    /// What the field says.
    transfer: TransferFunction,
    /// Where the head stands: the pose of the field, and whether the live decoder was heard last.
    decoded: Pose,
    was_live: bool,
    /// Shares of the time filters that still have to follow.
    stale_shares: usize,
    share: usize,
}

impl Decoding {
    pub(crate) fn new(scene: &Scene, hop_s: f64) -> Self {
        Self {
            cell: scene.field().map(Field::cell),
            live: None,
            hop_s,
            transfer: scene.shape().silent(),
            decoded: Pose::IDENTITY,
            was_live: false,
            stale_shares: 0,
            share: 0,
        }
    }

    /// Gives the stream a live decoder for the tiers that need one.
    pub(crate) fn set_live(&mut self, decoder: Box<dyn DecodeWorker>, scene: &Scene) {
        self.live = Some(Live::new(decoder, scene));
    }

    /// Whether poses can be decoded live.
    pub(crate) fn has_live(&self) -> bool {
        self.live.is_some()
    }

    /// What is heard now.
    pub(crate) fn heard(&self) -> &TransferFunction {
        match &self.live {
            Some(live) if self.was_live => &live.shown().transfer,
            _ => &self.transfer,
        }
    }

    /// What the live decoder says now.
    pub(crate) fn shown(&self) -> Option<&Decoded> {
        self.live.as_ref().map(Live::shown)
    }

    /// Follows to a pose in a tier that can be played: the direct sound at once, the time filters a share per hop unless `whole`.
    pub(crate) fn follow(&mut self, scene: &Scene, head: &mut RenderHead, pose: Pose, quality: &Quality, whole: bool) {
        let live = self.live.as_mut().filter(|_| quality.tier >= Tier::High);
        let whole = whole || live.is_some() != self.was_live;
        self.was_live = live.is_some();
        let field = scene.field().zip(self.cell.as_mut());
        // Where a scene has neither, nothing is heard.
        match (live, field) {
            (Some(live), _) => {
                if live.follow(&pose, whole, self.hop_s, &quality.live) || whole {
                    self.stale_shares = REFRESH_HOPS;
                    head.set_direct(&live.shown().transfer);
                }
            }
            (None, Some((field, cell))) => {
                if whole || pose != self.decoded {
                    self.decoded = pose;
                    self.stale_shares = REFRESH_HOPS;
                    field.locate(&pose, cell);
                    field.masks(cell, &mut self.transfer);
                    head.set_direct(&self.transfer);
                }
            }
            (None, None) => return,
        }
        self.refresh(scene, head, whole);
    }

    /// Without a room its filters wait; they catch up while it fades in.
    fn refresh(&mut self, scene: &Scene, head: &mut RenderHead, whole: bool) {
        let shares = match (whole, head.has_room()) {
            (true, _) => REFRESH_HOPS,
            (false, true) => self.stale_shares.min(1),
            (false, false) => 0,
        };
        let (explicit, hops) = (scene.shape().taps, head.filter_hops());
        for _ in 0..shares {
            let range = hops * self.share / REFRESH_HOPS..hops * (self.share + 1) / REFRESH_HOPS;
            match (&self.live, scene.field().zip(self.cell.as_mut())) {
                (Some(live), _) if self.was_live => head.set_taps(&live.shown().transfer, range),
                (_, Some((field, cell))) => {
                    let last = if range.end > explicit { explicit + 1 } else { range.end };
                    field.taps(cell, range.start..last, &mut self.transfer);
                    head.set_taps(&self.transfer, range);
                }
                _ => (),
            }
            self.share = (self.share + 1) % REFRESH_HOPS;
            self.stale_shares = self.stale_shares.saturating_sub(1);
        }
    }
}
