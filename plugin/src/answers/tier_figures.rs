//! What each tier of a scene costs and how far it is off, measured once for all instances that play it.

use crate::answers::settled::Question;
use crate::worker::lock::lock;
use promenade_core::Scene;
use promenade_judge::JudgeError;
use promenade_judge::trade::{TradePoint, tier_points};
use std::sync::{Arc, Mutex, Weak};
use std::time::Duration;

/// Block that costs are measured in, samples.
const BLOCK: usize = 512;

/// The tiers of a scene, cheapest first, or why there are no figures.
pub type Figures = Result<Vec<TradePoint>, JudgeError>;

/// Figures of a scene at a sample rate.
type Held = (Weak<Scene>, f64, Arc<Figures>);

/// What was measured in this process, as long as the scenes are in memory.
static MEASURED: Mutex<Vec<Held>> = Mutex::new(Vec::new());

/// A scene that is judged.
#[derive(Clone, Debug)]
pub struct Judged {
    /// The scene, which is not kept in memory.
    pub scene: Weak<Scene>,
    /// The host's sample rate, Hz.
    pub sample_rate_hz: f64,
}

impl Question for Judged {
    type Answer = Arc<Figures>;
    // A room that is being drawn is another scene with each picture.
    const REST: Duration = Duration::from_secs(1);

    fn is_like(&self, other: &Self) -> bool {
        Weak::ptr_eq(&self.scene, &other.scene) && self.sample_rate_hz == other.sample_rate_hz
    }

    fn answer(&self, wanted: &dyn Fn() -> bool) -> Option<Arc<Figures>> {
        let same = |of: &Weak<Scene>, rate: f64| Weak::ptr_eq(of, &self.scene) && rate == self.sample_rate_hz;
        let held = lock(&MEASURED).iter().find(|(of, rate, _)| same(of, *rate)).map(|(.., figures)| Arc::clone(figures));
        if held.is_some() {
            return held;
        }
        let figures = tier_points(&self.scene.upgrade()?, self.sample_rate_hz, BLOCK, wanted);
        if figures == Err(JudgeError::Unwanted) {
            return None;
        }
        let figures = Arc::new(figures);
        let mut measured = lock(&MEASURED);
        measured.retain(|(of, ..)| of.strong_count() > 0);
        measured.push((Weak::clone(&self.scene), self.sample_rate_hz, Arc::clone(&figures)));
        Some(figures)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::Tier;
    use promenade_testing::scenes::room_with_images;

    #[test]
    fn a_scene_is_measured_once_and_the_costlier_tier_is_nearer() {
        let scene = room_with_images(8_000.0, 0.2, 0.05, 4);
        let judged = Judged { scene: Arc::downgrade(&scene), sample_rate_hz: 8_000.0 };
        assert!(judged.answer(&|| false).is_none(), "given up, and not kept as an error");
        let figures = judged.answer(&|| true).unwrap();
        let [draft, standard] = figures.as_ref().as_ref().unwrap().as_slice() else { panic!("{figures:?}") };
        assert_eq!((draft.tier, standard.tier), (Tier::Draft, Tier::Standard));
        assert!(draft.error_jnds() > 1.0 && standard.error_jnds() < 1e-6, "{figures:?}");
        assert!(Arc::ptr_eq(&figures, &judged.answer(&|| false).unwrap()), "measured again");
        assert!(judged.answer(&|| true).unwrap().as_ref().as_ref().unwrap()[0].real_time > 0.0);
    }
}
