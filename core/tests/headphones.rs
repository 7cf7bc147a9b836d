//! Headphones' compensation: what it does to an impulse.

use promenade_core::headphones::{HEADPHONE_POINTS, HeadphoneStage, Headphones, headphone_point_hz};
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::spectrum;

const TEXT: &str = "Preamp: -6.2 dB\nFilter 1: ON LSC Fc 105 Hz Gain 5.5 dB Q 0.70\nFilter 2: ON PK Fc 2300 Hz Gain -4.1 dB Q \
    1.8\n\
                    Filter 3: OFF PK Fc 500 Hz Gain 9 dB Q 1\nFilter 4: ON HSC Fc 9000 Hz Gain 3.0 dB Q 0.70\n";

/// Levels of one ear, dB, by frequency; `None` beyond half the rate.
fn heard(headphones: &Headphones, rate: f64, ear: usize) -> impl Fn(f64) -> Option<f64> + use<> {
    let length = rate as usize;
    let mut ears = [vec![0.0_f32; length], vec![0.0; length]];
    ears.iter_mut().for_each(|ear| ear[0] = 1.0);
    let mut filter = headphones.filter(rate);
    let [left, right] = &mut ears;
    // Blocks of any size are the same.
    for start in (0..length).step_by(1_000) {
        let span = start..length.min(start + 1_000);
        filter.process([&mut left[span.clone()], &mut right[span]]);
    }
    let bins = spectrum(ears[ear].iter().copied().map(f64::from), length);
    move |hz: f64| bins.get(hz.round() as usize).filter(|_| hz < 0.49 * rate).map(|x: &Complex64| 10.0 * x.norm_sqr().log10())
}

/// Levels of the analogue filters that the cookbook transforms, dB.
fn analogue(rate: f64, hz: f64) -> f64 {
    let bent = |hz: f64| (std::f64::consts::PI * hz / rate).tan();
    let of = |centre: f64, gain_db: f64, q: f64, kind: &str| {
        if centre >= 0.49 * rate {
            return 0.0;
        }
        let (s, a) = (Complex64::new(0.0, bent(hz) / bent(centre)), 10.0_f64.powf(gain_db / 40.0));
        let (top, bottom) = match kind {
            "PK" => (s * s + s * a / q + 1.0, s * s + s / (a * q) + 1.0),
            "LSC" => ((s * s + s * a.sqrt() / q + a) * a, s * s * a + s * a.sqrt() / q + 1.0),
            _ => ((s * s * a + s * a.sqrt() / q + 1.0) * a, s * s + s * a.sqrt() / q + a),
        };
        20.0 * (top / bottom).norm().log10()
    };
    -6.2 + of(105.0, 5.5, 0.7, "LSC") + of(2300.0, -4.1, 1.8, "PK") + of(9000.0, 3.0, 0.7, "HSC")
}

#[test]
fn an_equaliser_s_filters_have_the_levels_of_their_formulas_at_every_rate() {
    let headphones = Headphones::from_text(TEXT).unwrap();
    for rate in [8_000.0, 44_100.0, 48_000.0, 96_000.0, 384_000.0] {
        for ear in 0..2 {
            let level = heard(&headphones, rate, ear);
            for hz in (0..40).map(|i| 20.0 * 2.0_f64.powf(f64::from(i) / 4.0).round()) {
                if let Some(found) = level(hz) {
                    assert!((found - analogue(rate, hz)).abs() < 0.05, "{rate} {hz}: {found} dB, {}", analogue(rate, hz));
                }
            }
        }
    }
}

#[test]
fn levels_are_met_at_every_rate_and_each_ear_has_its_own() {
    let bump = |hz: f64, centre: f64, octaves: f64| (-0.5 * ((hz / centre).log2() / octaves).powi(2)).exp();
    let wanted = |hz: f64, ear: usize| {
        let side = if ear == 0 { 1.0 } else { -0.6 };
        side * (6.0 * bump(hz, 90.0, 0.8) - 9.0 * bump(hz, 3_100.0, 0.3) + 8.0 * bump(hz, 8_000.0, 0.35))
    };
    let levels = [0, 1].map(|ear| std::array::from_fn(|i| wanted(headphone_point_hz(i), ear) as f32));
    let headphones = Headphones::from_levels(levels).unwrap();
    for rate in [8_000.0, 44_100.0, 48_000.0, 192_000.0] {
        let mut worst = 0.0_f64;
        for ear in 0..2 {
            let level = heard(&headphones, rate, ear);
            for i in 0..HEADPHONE_POINTS {
                let hz = headphone_point_hz(i).round();
                if let Some(found) = level(hz).filter(|_| hz < 0.42 * rate) {
                    worst = worst.max((found - wanted(hz, ear)).abs());
                }
            }
        }
        println!("{rate} Hz: {worst:.3} dB");
        assert!(worst < 0.1, "{rate}: {worst} dB");
    }
}

#[test]
fn a_graphic_equaliser_is_levels() {
    let headphones = Headphones::from_text("GraphicEQ: 20 0.0; 1000 -6; 20000 -6").unwrap();
    let level = heard(&headphones, 48_000.0, 1);
    assert!((level(5_000.0).unwrap() + 6.0).abs() < 0.1 && level(141.0).unwrap() + 3.0 < 0.2, "{:?}", level(141.0));
}

#[test]
fn what_is_no_compensation_is_refused_by_line() {
    let of = |text: &str| Headphones::from_text(text).unwrap_err().to_string();
    for (text, clue) in [
        ("", "text: expected lines such as"),
        ("Preamp: -6 dB", "text: expected lines such as"),
        ("hello", "line 1: expected"),
        ("Preamp: loud dB\nFilter 1: ON PK Fc 105 Hz Gain 5.5 dB Q 0.70", "line 1: expected \"Preamp: X dB\""),
        ("Preamp: -6 dB\n\nFilter 1: ON PK Fc 105 Hz Gain 5.5 dB", "line 3: expected \"ON TYPE"),
        ("Filter 1: ON NO Fc 105 Hz Gain 5.5 dB Q 0.70", "BP, NO or AP, found \"Filter 1: ON NO"),
        ("Filter 1: ON XX Fc 105 Hz Gain 5.5 dB Q 0.70", "of the types PK, LS, LSC"),
        ("Filter 1: ON PK Fc 105 Hz Gain 5.5 dB BW Oct 10", "a bandwidth of 0.015 to 8.5 octaves"),
        ("Filter 1: ON PK Fc 105 Hz Gain 5.5 dB BW 1", "line 1: expected \"ON TYPE"),
        ("Filter 1: ON LS 0dB Fc 105 Hz Gain 5.5 dB", "a slope of 0.1 to 48 dB"),
        ("Include: other.txt", "line 1: expected \"Preamp:\", \"Filter N:\", \"Channel:\""),
        ("Preamp: 40 dB\nPreamp: 30 dB", "found 70 dB"),
        ("Channel: R\nGraphicEQ: 20 0; 30 0\nGraphicEQ: 20 0; 30 0", "once for an ear"),
        ("Filter 1: ON PK Fc 0 Hz Gain 5.5 dB Q 0.70", "a frequency of 1 to 100000 Hz"),
        ("Filter 1: ON PK Fc 105 Hz Gain NaN dB Q 0.70", "a gain of at most 60 dB"),
        ("Filter 1: ON PK Fc 105 Hz Gain 5 dB Q 0", "a Q of 0.05 to 100"),
        ("GraphicEQ: 20 0; 10 1", "rising frequencies"),
        ("GraphicEQ: 20 0", "at least two points"),
    ] {
        assert!(of(text).contains(clue), "{text:?}: {}", of(text));
    }
    assert!(of(&"Filter 1: ON PK Fc 105 Hz Gain 5.5 dB Q 0.70\n".repeat(65)).contains("at most 64 filters"));
    assert!(of(&"#\n".repeat(40_000)).contains("at most 65536 bytes"));
    assert!(Headphones::from_levels([[f32::NAN; HEADPHONE_POINTS]; 2]).is_err());
}

#[test]
fn gains_beyond_reason_are_refused_with_their_number() {
    let of = |text: &str| Headphones::from_text(text).unwrap_err().to_string();
    let says = "gain of all filters: expected at most 40 dB at any frequency, found";
    for (text, found) in [
        ("Filter 1: ON PK Fc 1000 Hz Gain 20 dB Q 1\n".repeat(64), "1280 dB at 1000 Hz"),
        ("Preamp: 60 dB\nFilter 1: ON PK Fc 3150 Hz Gain 60 dB Q 9".to_owned(), "120 dB at 3150 Hz"),
        ("Filter 1: ON HPQ Fc 50 Hz Q 100\n".repeat(2), "80 dB at 50 Hz"),
        ("GraphicEQ: 20 0; 1000 41; 20000 0".to_owned(), "41 dB at"),
        ("Channel: R\nFilter 1: ON LSC Fc 100 Hz Gain 41 dB Q 0.7".to_owned(), "41 dB at 1 Hz"),
    ] {
        assert!(of(&text).starts_with(says) && of(&text).contains(found), "{}", of(&text));
    }
    // What is lowered first may be raised.
    Headphones::from_text("Preamp: -30 dB\nFilter 1: ON PK Fc 1000 Hz Gain 60 dB Q 1").unwrap();
    assert!(serde_json::from_str::<Headphones>(r#"{"equaliser":{"preamp_db":50.0,"filters":[]}}"#).is_err());
}

#[test]
fn nothing_is_louder_than_the_bound_after_headphones() {
    let mut filter =
        Headphones::from_text("Preamp: 39 dB\nFilter 1: ON PK Fc 8000 Hz Gain 0.1 dB Q 1").unwrap().filter(48_000.0);
    let mut ears = [vec![0.9e6_f32; 500], vec![-0.9e6; 500]];
    let [left, right] = &mut ears;
    filter.process([left, right]);
    assert!(ears.iter().flatten().all(|x| x.abs() <= 1e6) && ears[0].contains(&1e6), "{:?}", &ears[0][..4]);
}

#[test]
fn what_equalisers_write_is_read() {
    let rate = 48_000.0;
    // Filters of a room equaliser, with slots that hold none, and ears of their own.
    let text = "# made by hand\nDevice: all\nPreamp: -2 dB\nFilter  1: ON  HP  Fc 30 Hz\nFilter  2: ON  None\n\
                Filter  3: OFF LP Fc 100 Hz\nChannel: L\nPreamp: -4 dB\nFilter: ON LPQ Fc 12000 Hz Q 0.7071\n\
                Channel: R\nFilter: ON PK Fc 1000 Hz Gain 6 dB BW Oct 1\nChannel: C LFE\nFilter: ON NO Fc 2000 Hz\n";
    let headphones = Headphones::from_text(text).unwrap();
    let [left, right] = [0, 1].map(|ear| heard(&headphones, rate, ear));
    let near = |found: Option<f64>, db: f64| assert!((found.unwrap() - db).abs() < 0.15, "{found:?} dB for {db}");
    near(left(1_000.0), -6.0);
    near(left(12_000.0), -9.0);
    near(left(30.0), -9.0);
    near(right(1_000.0), 4.0);
    near(right(12_000.0), -2.0);
    near(right(2_000.0), right(500.0).unwrap());
    // Shelves: where one of a stated corner begins, most of it is there; the centre has half of it.
    let corner = Headphones::from_text("Filter 1: ON LS Fc 200 Hz Gain 8 dB").unwrap();
    let level = heard(&corner, rate, 0);
    near(level(20.0), 8.0);
    near(level(200.0 * 10.0_f64.powf(8.0 / 80.0 / 0.9)), 4.0);
    let centre = heard(&Headphones::from_text("Filter 1: ON HSC 9 dB Fc 2000 Hz Gain -8 dB").unwrap(), rate, 0);
    near(centre(2_000.0), -4.0);
    near(centre(20_000.0), -8.0);
    // Ears that differ are kept, and UTF-16 of either order is UTF-8.
    let json = serde_json::to_string(&headphones).unwrap();
    assert_eq!(serde_json::from_str::<Headphones>(&json).unwrap(), headphones);
    let units: Vec<u16> = text.encode_utf16().collect();
    let low: Vec<u8> = units.iter().flat_map(|u| u.to_le_bytes()).collect();
    let high: Vec<u8> = units.iter().flat_map(|u| u.to_be_bytes()).collect();
    for bytes in [
        text.as_bytes().to_vec(),
        low.clone(),
        high.clone(),
        [vec![0xff, 0xfe], low].concat(),
        [vec![0xfe, 0xff], high].concat(),
    ] {
        assert_eq!(Headphones::from_bytes(&bytes).unwrap(), headphones);
    }
    for damaged in [&b"\xff\xfe\x00\xd8"[..], b"Preamp: \xe4", b"\xff\xfe", b""] {
        assert!(Headphones::from_bytes(damaged).is_err());
    }
}

#[test]
fn what_is_saved_is_read_again_and_damage_is_refused() {
    let levels = [0, 1].map(|ear| std::array::from_fn(|i| (i as f32 - 60.0) * [0.1, -0.05][ear]));
    for headphones in [Headphones::from_text(TEXT).unwrap(), Headphones::from_levels(levels).unwrap()] {
        let json = serde_json::to_string(&headphones).unwrap();
        assert_eq!(serde_json::from_str::<Headphones>(&json).unwrap(), headphones, "{json}");
        assert!(json.len() < 4_000, "{} bytes", json.len());
    }
    for damaged in [
        r#"{"equaliser":{"preamp_db":0.0,"filters":[["Peak",0.0,1.0,1.0]]}}"#,
        r#"{"equaliser":{"preamp_db":1e9,"filters":[]}}"#,
        r#"{"levels":[[0.0],[0.0]]}"#,
        "{}",
    ] {
        assert!(serde_json::from_str::<Headphones>(damaged).is_err(), "{damaged}");
    }
}

/// A low tone through a stage that is told what to do at every block.
fn through(mut act: impl FnMut(usize, &mut HeadphoneStage) -> bool) -> (Vec<f32>, Vec<f32>) {
    let mut stage = HeadphoneStage::default();
    assert!(stage.install(None, 48_000.0).iter().all(Option::is_none));
    let dry: Vec<f32> = (0..48_000).map(|i| 0.5 * (0.013 * i as f32).sin()).collect();
    let mut ears = [dry.clone(), dry.clone()];
    let [left, right] = &mut ears;
    for (block, (left, right)) in left.chunks_mut(100).zip(right.chunks_mut(100)).enumerate() {
        let on = act(block, &mut stage);
        stage.process([left, right], on);
        drop(stage.take_retired());
    }
    assert!(ears[0] == ears[1]);
    (dry, ears[0].clone())
}

#[test]
fn a_stage_without_a_filter_changes_nothing_and_exchanges_are_no_steps() {
    let (dry, plain) = through(|_, _| true);
    assert!(dry == plain);
    let filter = |text: &str| Some(Box::new(Headphones::from_text(text).unwrap().filter(48_000.0)));
    let quiet = "Preamp: -6.0206 dB\nFilter 1: ON PK Fc 8000 Hz Gain 1 dB Q 1";
    let (dry, heard) = through(|block, stage| {
        match block {
            50 => drop(stage.swap_in(filter(quiet))),
            150 => drop(stage.swap_in(filter("Preamp: 3 dB\nFilter 1: ON PK Fc 8000 Hz Gain 1 dB Q 1"))),
            350 => drop(stage.swap_in(None)),
            _ => (),
        }
        !(250..300).contains(&block)
    });
    let ratio = |blocks: std::ops::Range<usize>| {
        let span = 100 * blocks.start..100 * blocks.end;
        let energy = |x: &[f32]| x[span.clone()].iter().map(|v| v * v).sum::<f32>();
        10.0 * (energy(&heard) / energy(&dry)).log10()
    };
    for (blocks, db) in [(0..50, 0.0), (80..150, -6.02), (180..250, 3.0), (270..300, 0.0), (320..350, 3.0), (380..480, 0.0)] {
        assert!((ratio(blocks.clone()) - db).abs() < 0.05, "{blocks:?}: {} dB", ratio(blocks.clone()));
    }
    assert!((&dry[..5_000], &dry[40_000..]) == (&heard[..5_000], &heard[40_000..]), "not bit for bit without a filter");
    // The tone's own largest step is 0.0065, 0.0092 at 3 dB more; the fades add a thousandth of what they pass.
    let step = heard.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f32::max);
    assert!(step < 0.0105, "{step}");
}

#[test]
fn every_bandwidth_that_is_read_is_kept() {
    for octaves in ["0.015", "1", "8.5"] {
        let text = format!("Filter 1: ON PK Fc 2300 Hz Gain -4.1 dB BW Oct {octaves}\n");
        let headphones = Headphones::from_bytes(text.as_bytes()).unwrap();
        let kept = serde_json::to_string(&headphones).unwrap();
        assert_eq!(serde_json::from_str::<Headphones>(&kept).unwrap(), headphones, "{octaves} octaves");
    }
}
