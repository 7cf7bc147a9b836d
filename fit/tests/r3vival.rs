//! The measured room with changed walls.

mod needs_shared {
    use promenade_fit::{Convention, LoadOptions, Measurements, Split, all_figures, baselines, mean_rows};
    use promenade_testing::shared;

    #[test]
    #[ignore = "needs ../shared"]
    fn baselines_are_where_others_found_them() {
        let options = LoadOptions { rate_hz: Some(16_000), setting: Some("000".to_owned()), ..LoadOptions::default() };
        let set = Measurements::load(&shared("data/r3vival"), &options).unwrap();
        assert_eq!((set.all.len(), set.sample_rate_hz), (30, 16_000));
        let figures = all_figures(&set, Convention::AvDar);
        let tables: Vec<_> =
            (0..3).map(|seed| baselines(&set, &figures, &Split::drawn(30, 10, seed).unwrap(), Convention::AvDar)).collect();
        for row in mean_rows(&tables) {
            println!("{:28} {:?}", row.name, row.errors.row().map(|v| (100.0 * v).round() / 100.0));
        }
        let regression = &mean_rows(&tables)[3];
        assert!(regression.errors.c50_db < 0.6 && regression.errors.t60_percent < 6.0, "{regression:?}");
    }
}
