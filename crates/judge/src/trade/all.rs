//! A scene played with less and less of what it holds.

use super::heard::Turned;
use super::{Rendering, TradePoint, Way, best, costs, reduce, tiers};
use crate::cost::Setting;
use crate::error::JudgeError;
use promenade_core::{LiveParams, Quality, Scene, Tier};
use rayon::prelude::*;
use std::sync::Arc;

/// Decodes a second that are tried, besides the usual rate.
const DECODE_RATES_HZ: [f32; 4] = [5.0, 10.0, 20.0, 80.0];

/// Plays a scene in every tier, and with fewer taps, images, nodes and decodes as far as it has them; costs are for a host rate
/// and block. The cheapest comes first. On all processors.
///
/// # Errors
/// A setting that cannot be rendered, or whose responses cannot be measured.
pub fn trade(scene: &Arc<Scene>, sample_rate_hz: f64, block: usize) -> Result<Vec<TradePoint>, JudgeError> {
    trade_beside(scene, scene, sample_rate_hz, block)
}

/// [`trade`] with the errors to the best of another scene that is heard at the same rate and places, such as the one of which
/// this is a part.
///
/// # Errors
/// A setting that cannot be rendered, or whose responses cannot be measured.
pub fn trade_beside(
    scene: &Arc<Scene>,
    other: &Arc<Scene>,
    sample_rate_hz: f64,
    block: usize,
) -> Result<Vec<TradePoint>, JudgeError> {
    let settings = settings(scene);
    let best = best(other);
    let best_turned = Turned::of(&best)?;
    let best = Rendering::of(&best, &|| true)?;
    let all = settings.par_iter().map(|(setting, _)| Ok((Rendering::of(setting, &|| true)?, Turned::of(setting)?)));
    let heard: Result<Vec<_>, JudgeError> = all.collect();
    let costs = costs(&settings.iter().map(|(setting, _)| setting).collect::<Vec<_>>(), sample_rate_hz, block);
    let mut points = Vec::new();
    for (((setting, way), (heard, turned)), cost) in settings.iter().zip(heard?).zip(costs) {
        // A tier that only the scene's own rate has costs nothing at another.
        let Some(cost) = cost else { continue };
        let heard_off_deg = turned.zip(best_turned.as_ref()).map(|(turned, best)| turned.off_deg(best));
        points.push(TradePoint { heard_off_deg, ..TradePoint::new(setting, *way, &cost, &heard, &best)? });
    }
    points.sort_by(|a, b| a.real_time.total_cmp(&b.real_time));
    for i in 0..points.len() {
        let measures = |p: &TradePoint| [p.real_time, p.error_jnds(), p.walking_db];
        let own = measures(&points[i]);
        let no_worse = |other: &TradePoint| measures(other).iter().zip(own).all(|(other, own)| *other <= own);
        points[i].dominated = points.iter().enumerate().any(|(j, other)| j != i && no_worse(other));
    }
    Ok(points)
}

/// Every setting, and how it is had.
fn settings(scene: &Arc<Scene>) -> Vec<(Setting, Way)> {
    let mut out: Vec<(Setting, Way)> = Vec::new();
    for setting in tiers(scene) {
        let tier = setting.quality.tier;
        out.push((setting, Way::Tier));
        if tier >= Tier::High {
            for rate_hz in DECODE_RATES_HZ {
                let name = format!("{}, {rate_hz} decodes/s", tier.name());
                let live = LiveParams { rate_hz, ..LiveParams::default() };
                out.push((Setting { name, scene: Arc::clone(scene), quality: Quality { tier, live } }, Way::Decodes(rate_hz)));
            }
        }
    }
    // What is left out is left out of the best tier that plays it at every hop.
    let tier = scene.played_tier(Tier::Standard);
    for (less, reduced) in reduce::all(scene) {
        let name = format!("{}, {}", tier.name(), reduce::words(less, scene));
        out.push((Setting { name, scene: Arc::new(reduced), quality: tier.into() }, Way::Less(less)));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::Less;
    use super::*;
    use promenade_testing::scenes::room_with_images;

    #[test]
    fn what_costs_less_errs_more_and_the_scene_itself_errs_nothing() {
        let scene = room_with_images(8_000.0, 0.2, 0.05, 4);
        let points = trade(&scene, 8_000.0, 256).unwrap();
        let off = |name: &str| points.iter().find(|p| p.name == name).and_then(|p| p.heard_off_deg).unwrap();
        assert!(off("standard") < 0.5 && off("standard, half of the directions") > 2.0 * off("standard"), "{points:?}");
        assert!(points.windows(2).all(|pair| pair[0].real_time <= pair[1].real_time));
        let get = |name: &str| points.iter().find(|p| p.name == name).unwrap_or_else(|| panic!("{name} in {points:?}"));
        let (draft, standard) = (get("draft"), get("standard"));
        assert!([draft, standard].iter().all(|point| point.way == Way::Tier));
        assert_eq!(get("standard, 6 of 24 taps").way, Way::Less(Less::Taps(6)));
        assert!(standard.error_jnds() < 1e-6 && standard.walking_db < 1e-6, "{standard:?}");
        assert!(draft.error_jnds() > 1.0 && draft.walking_db > 1.0, "{draft:?}");
        for p in &points {
            let better =
                |q: &TradePoint| q.real_time < p.real_time && q.error_jnds() < p.error_jnds() && q.walking_db < p.walking_db;
            assert!(p.dominated || !points.iter().any(better), "{}", p.name);
        }
    }
}
