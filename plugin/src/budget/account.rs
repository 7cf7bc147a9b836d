//! What an instance and the allocator know of each other.

use super::allocator::{BANDS, Claim, Point};
use super::grant::Grant;
use super::limit::limit_percent;
use crate::parameter::choices::AccuracyChoice;
use crate::worker::lock::lock;
use promenade_core::FrontPoint;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU8, AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// Time for which another accuracy is kept at least: while two are cross-faded both take their time.
const KEPT: Duration = Duration::from_secs(3);

/// One instance's share of the budget: the audio thread writes what it hears and takes, the loader what its scene can be played
/// for, the allocator what it grants.
#[derive(Debug)]
pub struct Account {
    /// Mean squares at the ears by band, by their bits.
    powers: [AtomicU32; BANDS],
    /// Processor time of all of the scene over sound's time, by its bits; 0 before it was measured.
    whole: AtomicU32,
    /// What is played takes so much of that, by its bits.
    share: AtomicU32,
    held: AtomicU8,
    accuracy: AtomicU8,
    most: AtomicU8,
    front: Mutex<Front>,
}

/// What the scene can be played for.
#[derive(Debug)]
struct Front {
    points: Vec<FrontPoint>,
    /// When the accuracy was changed last.
    changed: Option<Instant>,
}

impl Default for Account {
    fn default() -> Self {
        let full = || AtomicU8::new(Grant::FULL.index());
        Self {
            powers: [const { AtomicU32::new(0) }; BANDS],
            whole: AtomicU32::new(0),
            share: AtomicU32::new(1.0_f32.to_bits()),
            held: full(),
            accuracy: full(),
            most: full(),
            front: Mutex::new(Front { points: Vec::new(), changed: None }),
        }
    }
}

impl Account {
    /// What it may play.
    ///
    /// # Real-time
    /// Any thread; no allocation, lock or I/O.
    pub fn held(&self) -> Grant {
        Grant::of_index(self.held.load(Ordering::Relaxed))
    }

    /// How near to all of its scene it is to be played within the budget, also while it waits.
    ///
    /// # Real-time
    /// Any thread; no allocation, lock or I/O.
    pub fn accuracy(&self) -> AccuracyChoice {
        let granted = Grant::of_index(self.accuracy.load(Ordering::Relaxed)).accuracy();
        granted.filter(|_| limit_percent().is_some()).unwrap_or(AccuracyChoice::All)
    }

    /// What it takes as it plays now, share of one core; 0 before it was measured.
    pub fn cost(&self) -> f32 {
        if self.held() == Grant::WAITS { 0.0 } else { self.whole() * f32::from_bits(self.share.load(Ordering::Relaxed)) }
    }

    /// What all of its scene takes, share of one core; 0 before it was measured.
    fn whole(&self) -> f32 {
        f32::from_bits(self.whole.load(Ordering::Relaxed))
    }

    /// Takes the settings that its scene can be played with.
    pub(crate) fn offer(&self, points: Vec<FrontPoint>) {
        lock(&self.front).points = points;
    }

    /// Takes the share of the cost of all of its scene that is played from now on.
    pub(crate) fn play(&self, share: f32) {
        self.share.store(share.to_bits(), Ordering::Relaxed);
    }

    /// Notes what a block took, share of one core, `times` of the time over which it is measured.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(super) fn note_cost(&self, took: f32, times: f32) {
        let (known, found) = (self.whole(), took / f32::from_bits(self.share.load(Ordering::Relaxed)).max(0.01));
        let whole = if known > 0.0 { known + (1.0 - (-times).exp()) * (found - known) } else { found };
        self.whole.store(whole.to_bits(), Ordering::Relaxed);
    }

    /// Notes how loud it is, mean squares by band, and the most that its settings ask for.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(super) fn note(&self, powers: [f32; BANDS], most: AccuracyChoice) {
        self.powers.iter().zip(powers).for_each(|(held, power)| held.store(power.to_bits(), Ordering::Relaxed));
        self.most.store(Grant::from(most).index(), Ordering::Relaxed);
    }

    pub(super) fn claim(&self) -> Claim {
        let front = lock(&self.front);
        let point = |grant: Grant| {
            let jnds = grant.accuracy().and_then(AccuracyChoice::jnds).unwrap_or(0.0);
            let point = FrontPoint::within(&front.points, jnds);
            point.map_or(Point { share: 1.0, jnds: 0.0 }, |point| Point { share: point.cost, jnds: point.error.jnds })
        };
        let mut points = [Point { share: 0.0, jnds: 0.0 }; Grant::COUNT];
        Grant::all().skip(1).for_each(|grant| points[usize::from(grant.index())] = point(grant));
        let accuracy = Grant::of_index(self.accuracy.load(Ordering::Relaxed));
        let is_kept = front.changed.is_some_and(|changed| changed.elapsed() < KEPT);
        Claim {
            powers: self.powers.each_ref().map(|power| f32::from_bits(power.load(Ordering::Relaxed))),
            whole: self.whole(),
            points,
            held: self.held(),
            kept: is_kept.then_some(accuracy),
            most: Grant::of_index(self.most.load(Ordering::Relaxed)),
        }
    }

    pub(super) fn give(&self, grant: Grant) {
        self.held.store(grant.index(), Ordering::Relaxed);
        let accuracy = grant.index();
        if grant > Grant::WAITS && self.accuracy.swap(accuracy, Ordering::Relaxed) != accuracy {
            lock(&self.front).changed = Some(Instant::now());
        }
    }
}
