//! Tests that draw their cases.

use fastrand::Rng;

/// Says which seed failed.
struct Case(u64);

impl Drop for Case {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("this was seed {0}: PROMENADE_SEED={0} PROMENADE_CASES=1 runs it alone", self.0);
        }
    }
}

/// Runs a test for the seeds 1 to `cases`, and names the one that fails. `PROMENADE_SEED` sets the first seed and
/// `PROMENADE_CASES` how many follow, to see a failure again or to search further.
///
/// # Panics
/// The test does; one of the variables is no number.
pub fn for_seeds(cases: u64, test: impl Fn(&mut Rng)) {
    let number = |name: &str, default: u64| {
        std::env::var(name)
            .map_or(default, |text| text.parse().unwrap_or_else(|_| panic!("{name}: expected a number, found {text}")))
    };
    let first = number("PROMENADE_SEED", 1);
    for seed in first..first + number("PROMENADE_CASES", cases) {
        let case = Case(seed);
        test(&mut Rng::with_seed(seed));
        drop(case);
    }
}
