//! What is done to a frame of the source: its direct sound filtered, its time filters and late part added.

pub(crate) mod ahead;
pub(crate) mod ambisonic;
pub(crate) mod at_once;
pub(crate) mod bass;
pub(crate) mod beside_waves;
pub(crate) mod block;
pub(crate) mod carrier;
pub(crate) mod carrier_set;
pub(crate) mod carriers;
pub(crate) mod crossover;
pub(crate) mod decay;
pub(crate) mod decay_curve;
pub(crate) mod direct;
pub(crate) mod head;
pub(crate) mod images;
pub(crate) mod lanes;
pub(crate) mod late;
pub(crate) mod later;
pub(crate) mod low;
pub(crate) mod low_cut;
pub(crate) mod meeting;
pub(crate) mod phasor;
pub(crate) mod ring;
pub(crate) mod taps;
pub(crate) mod undelayed;
pub(crate) mod waves;
