//! The measured room with changed walls.

mod needs_shared {
    use promenade_fit::{Convention, LoadOptions, Measurements, Split, Walls, all_figures, baselines, quick_row};
    use promenade_testing::shared;

    fn load(setting: &str) -> Measurements {
        let options = LoadOptions { rate_hz: Some(16_000), setting: Some(setting.to_owned()), ..LoadOptions::default() };
        Measurements::load(&shared("data/r3vival"), &options).unwrap()
    }

    #[test]
    #[ignore = "needs ../shared"]
    fn the_quick_fit_of_a_measured_room_foretells_other_places() {
        let set = load("000");
        assert_eq!((set.all.len(), set.sample_rate_hz), (30, 16_000));
        let figures = all_figures(&set, Convention::AvDar);
        let split = Split::drawn(30, 10, 0).unwrap();
        let rows = baselines(&set, &figures, &split, Convention::AvDar);
        let walls = Walls::of_size([9.7, 5.5, 2.7]).unwrap();
        let fit = quick_row(&walls, &set, &figures, &split, Convention::AvDar, 1).unwrap().errors;
        let [nearest, mean, _, regression] = [0, 1, 2, 3].map(|i: usize| rows[i].errors);
        assert!(regression.c50_db < 0.6 && regression.t60_percent < 5.0, "{regression:?}");
        assert!(fit.loudness_db < 0.8 && fit.c50_db < 0.9 && fit.t60_percent < 4.5, "{fit:?}");
        assert!(fit.early_db < nearest.early_db && fit.early_db < mean.early_db + 0.1, "{fit:?} {mean:?}");
    }
}
