//! What is heard, and what is not.

use super::*;
use promenade_core::Setting;
use promenade_testing::scenes::room_with_images;

fn figure(errors: &[Audible], measure: Measure) -> f32 {
    errors.iter().find(|e| e.measure == measure).unwrap_or_else(|| panic!("{measure:?} in {errors:?}")).jnds
}

#[test]
fn a_scene_is_as_itself_and_less_of_it_is_not() {
    let scene = room_with_images(8_000.0, 0.2, 0.05, 8);
    let course = Course::new(&scene, 3, 1, 1);
    let heard = |scene: &Arc<Scene>| Heard::of(scene, &course, &|| true).unwrap();
    let less = |setting| Arc::new(scene.with_setting(setting).unwrap());
    let full = heard(&scene);
    let same: Vec<Audible> = Measure::ALL.iter().map(|measure| Audible { jnds: 0.0, measure: *measure }).collect();
    assert_eq!(heard(&scene).errors(&full), same);
    let one = heard(&less(Setting { images: 1, ..Setting::ALL })).errors(&full);
    assert!(figure(&one, Measure::T20) > 1.0 && figure(&one, Measure::Levels) > 0.5, "{one:?}");
    let slow = heard(&less(Setting { refresh: 4, ..Setting::ALL })).errors(&full);
    assert!(figure(&slow, Measure::C50) < 0.02 && figure(&slow, Measure::MovingLevels) > 1e-3, "{slow:?}");
    assert_eq!(Heard::of(&scene, &course, &|| false).err(), Some(JudgeError::Unwanted));
}

#[test]
fn a_change_counts_as_many_times_as_it_is_noticed() {
    let measures = ResponseMeasures { itd_s: 1e-4, ild_db: 3.0, t20_s: Some(0.5), edt_s: Some(0.4), c50_db: Some(9.0) };
    let standing = |measures: Option<ResponseMeasures>, level: f64, coherence| {
        let itds_s: Vec<f64> = measures.iter().map(|m: &ResponseMeasures| m.itd_s).collect();
        let (levels_db, coherence) = (vec![level, level - 1.0, level - 90.0], vec![coherence]);
        [Standing { measures, itds_s, levels_db, first: 1.0, coherence }]
    };
    let changed = ResponseMeasures { itd_s: 6e-5, ild_db: 0.0, t20_s: None, edt_s: Some(0.44), c50_db: Some(11.0) };
    let found =
        at_most_poses(standing_errors(&standing(Some(changed), -8.0, 0.35), &standing(Some(measures), -6.0, 0.5)), OF_POSES);
    let wanted = [
        (Measure::Itd, 2.0),
        (Measure::Ild, 3.0),
        (Measure::T20, 20.0),
        (Measure::Edt, 2.0),
        (Measure::C50, 2.0),
        (Measure::Coherence, 2.0),
        (Measure::Levels, 2.0),
    ];
    assert_eq!(found.len(), wanted.len());
    for (measure, jnds) in wanted {
        assert!((figure(&found, measure) - jnds).abs() < 1e-4, "{measure:?}: {found:?}");
    }
    assert_eq!(largest(&found).measure, Measure::T20);
    // A lag that may be heard as well.
    let [mut other] = standing(Some(changed), -8.0, 0.35);
    other.itds_s.push(1.1e-4);
    let found = at_most_poses(standing_errors(&[other], &standing(Some(measures), -6.0, 0.5)), OF_POSES);
    assert!((figure(&found, Measure::Itd) - 0.5).abs() < 1e-4, "{found:?}");
    // Silence has nothing to compare but its levels.
    let silent = at_most_poses(standing_errors(&standing(None, -200.0, 1.0), &standing(Some(measures), -6.0, 1.0)), OF_POSES);
    assert_eq!((silent.len(), figure(&silent, Measure::Levels)), (2, MOST_DB as f32));
}

#[test]
fn critical_bands_are_those_of_zwicker() {
    let bands = critical_bands(16_000.0);
    let width = |hz: f64| bands.iter().find(|(low, high)| (*low..*high).contains(&hz)).map(|(low, high)| high - low).unwrap();
    // Zwicker (1961): 100 Hz wide at 250 Hz, 160 at 1 kHz, 550 at 4 kHz, 1800 at 9.5 kHz.
    for (hz, wanted) in [(250.0, 100.0), (1_000.0, 160.0), (3_400.0, 550.0), (8_500.0, 1_800.0)] {
        assert!((width(hz) / wanted - 1.0).abs() < 0.25, "{hz}: {}", width(hz));
    }
}

#[test]
fn a_tone_is_as_deeply_modulated_as_it_is() {
    let (rate, hz) = (16_000.0, 1_600.0);
    for depth in [0.02, 0.1, 0.3] {
        let tone: Vec<f32> = (0..20_000)
            .map(|i| f64::from(i) / rate)
            .map(|t| ((1.0 + depth * (TAU * 31.0 * t).sin()) * (TAU * hz * t).sin()) as f32)
            .collect();
        let found = modulation(&tone, hz, rate);
        assert!((found / depth - 1.0).abs() < 0.05, "{found} of {depth}");
    }
}
