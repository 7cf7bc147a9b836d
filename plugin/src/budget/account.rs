//! What an instance and the allocator know of each other.

use super::{allocator::Claim, grant::Grant};
use std::sync::atomic::{AtomicU8, AtomicU32, Ordering};

/// One instance's share of the budget: the audio thread writes what it hears and takes, the allocator what it grants.
#[derive(Debug)]
pub struct Account {
    /// Mean square at the ears, by its bits.
    loudness: AtomicU32,
    /// Processor time over sound's time by grant, by its bits; 0 before it was measured.
    costs: [AtomicU32; Grant::ALL.len()],
    held: AtomicU8,
    most: AtomicU8,
}

impl Default for Account {
    fn default() -> Self {
        let full = Grant::default() as u8;
        Self {
            loudness: AtomicU32::new(0),
            costs: [const { AtomicU32::new(0) }; Grant::ALL.len()],
            held: AtomicU8::new(full),
            most: AtomicU8::new(full),
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

    /// What it takes as it plays now, share of one core.
    pub fn cost(&self) -> f32 {
        self.cost_of(self.held())
    }

    /// What a grant takes, share of one core; 0 before it was measured.
    ///
    /// # Real-time
    /// Any thread; no allocation, lock or I/O.
    pub(super) fn cost_of(&self, grant: Grant) -> f32 {
        f32::from_bits(self.costs[grant as usize].load(Ordering::Relaxed))
    }

    /// Notes what a grant takes.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(super) fn note_cost(&self, grant: Grant, cost: f32) {
        self.costs[grant as usize].store(cost.to_bits(), Ordering::Relaxed);
    }

    /// Notes how loud it is, mean square, and the most that its settings ask for.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(super) fn note(&self, loudness: f32, most: Grant) {
        self.loudness.store(loudness.to_bits(), Ordering::Relaxed);
        self.most.store(most as u8, Ordering::Relaxed);
    }

    pub(super) fn claim(&self) -> Claim {
        Claim {
            loudness: f32::from_bits(self.loudness.load(Ordering::Relaxed)),
            costs: Grant::ALL.map(|grant| self.cost_of(grant)),
            held: self.held(),
            most: Grant::of_index(self.most.load(Ordering::Relaxed)),
        }
    }

    pub(super) fn give(&self, grant: Grant) {
        self.held.store(grant as u8, Ordering::Relaxed);
    }
}
