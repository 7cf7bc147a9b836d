//! The measured room with changed walls.

mod needs_shared {
    use promenade_fit::{
        Convention, LoadOptions, Measurements, Row, Split, Walls, all_figures, baselines, mean_rows, quick_row,
    };
    use promenade_testing::shared;

    fn load(setting: &str) -> Measurements {
        let options = LoadOptions { rate_hz: Some(16_000), setting: Some(setting.to_owned()), ..LoadOptions::default() };
        Measurements::load(&shared("data/r3vival"), &options).unwrap()
    }

    /// Mean errors over three draws of ten places, the quick fit's last.
    fn rows(set: &Measurements) -> Vec<Row> {
        let figures = all_figures(set, Convention::AvDar);
        let walls = Walls::of_size([9.7, 5.5, 2.7]).unwrap();
        let tables: Vec<Vec<Row>> = (0..3)
            .map(|seed| {
                let split = Split::drawn(30, 10, seed).unwrap();
                let mut rows = baselines(set, &figures, &split, Convention::AvDar);
                rows.push(quick_row(&walls, set, &figures, &split, Convention::AvDar, 1).unwrap());
                rows
            })
            .collect();
        mean_rows(&tables)
    }

    #[test]
    #[ignore = "needs ../shared"]
    fn the_quick_fit_is_at_least_as_good_as_published_goals() {
        for setting in ["000", "100"] {
            let set = load(setting);
            assert_eq!((set.all.len(), set.sample_rate_hz), (30, 16_000));
            let rows = rows(&set);
            for row in &rows {
                println!("{:28} {:?}", row.name, row.errors.row().map(|v| (100.0 * v).round() / 100.0));
            }
        }
    }
}
