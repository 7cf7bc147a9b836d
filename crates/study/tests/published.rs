//! The figures of Harvey, Debattista, Bashford-Rogers and Chalmers, "Multi-modal perception for selective rendering", Computer
//! Graphics Forum 2017, from its tables 3 to 5: 28 persons, each pair of four conditions once, in three scenes.

use promenade_study::{groups, paired, read};

fn tables() -> Vec<(String, promenade_study::Preferences)> {
    read(&[concat!(env!("CARGO_MANIFEST_DIR"), "/tests/harvey.csv")]).unwrap().tables
}

#[test]
fn agreement_and_chi2_are_those_of_table_7() {
    let found = paired(&tables(), &[]).unwrap().unwrap();
    for (item, (u, chi2)) in found.items.iter().zip([("0.1658", "32.86"), ("0.1825", "35.57"), ("0.1975", "38.00")]) {
        let agreement = item.agreement.unwrap();
        assert_eq!((format!("{:.4}", agreement.u), format!("{:.2}", agreement.chi2)), (u.to_owned(), chi2.to_owned()));
        assert!(agreement.chance < 0.001 && agreement.scores_chance < 0.001);
        assert!(item.consistency.is_none(), "tables do not tell persons apart");
    }
    // The last row: the means .18195 and 35.476. The paper prints the mean of its rounded u, .1819, and the chi2 of that.
    let (u, chi2, zeta) = found.means.unwrap();
    let printed = (0.1658 + 0.1825 + 0.1975) / 3.0;
    assert!((u - printed).abs() < 5e-5 && format!("{printed:.4}") == "0.1819" && zeta.is_none());
    assert_eq!(format!("{:.2}", 6.0 * (1.0 + 0.1819 * 27.0)), "35.47");
    assert!((chi2 - 35.47).abs() < 0.01, "{chi2}");
}

#[test]
fn votes_are_those_of_table_6_but_for_its_misprint() {
    let all = paired(&tables(), &[]).unwrap().unwrap().all.unwrap().votes;
    assert_eq!(all.names(), ["Uni", "Sal", "SoSal", "Mix"]);
    assert_eq!(all.scores(), [74, 101, 137, 192]);
    let rows: Vec<Vec<u32>> = (0..4).map(|i| (0..4).map(|j| all.votes(i, j)).collect()).collect();
    // Mix over Sal is printed as 55; its row sums to 192 with 65 only.
    assert_eq!(rows, [[0, 33, 23, 18], [51, 0, 32, 18], [62, 53, 0, 22], [65, 65, 62, 0]]);
}

#[test]
fn a_range_of_19_is_the_largest_by_chance() {
    let found = paired(&tables(), &[]).unwrap().unwrap();
    for item in &found.items {
        // The printed R+ is the whole part of R0; the exact chance of a range of 19 is .063, of 20 .044.
        assert_eq!((item.least.bound.floor(), item.least.least), (19.0, 20), "{:?}", item.least);
        assert!((item.least.chance.unwrap() - 0.04415).abs() < 1e-4, "{:?}", item.least);
    }
    // Mix leads alone in two scenes, and shares the lead in the kitchen.
    let leaders = found.items.iter().map(|item| groups(&item.votes.scores(), item.least.least)[0].len());
    assert_eq!(leaders.collect::<Vec<_>>(), [1, 2, 1]);
}

#[test]
fn pairs_that_do_not_sum_to_28_are_found() {
    let tables = tables();
    let uneven = |i: usize| tables[i].1.uneven();
    // Uni and SoSal 29, Uni and Mix 27; Sal and SoSal 29, Sal and Mix 27.
    assert_eq!([uneven(0), uneven(1), uneven(2)], [vec![(0, 2), (0, 3)], vec![(1, 2), (1, 3)], Vec::new()]);
    assert!(tables.iter().all(|(_, table)| table.judges() == 28.0));
}

#[test]
fn strengths_rise_as_votes_do() {
    let all = paired(&tables(), &[]).unwrap().unwrap().all.unwrap();
    let strengths = all.strengths.unwrap().of;
    assert!(strengths.windows(2).all(|pair| pair[0].log < pair[1].log), "{strengths:?}");
    // As by statsmodels' binomial regression of the same votes.
    for (strength, expected) in strengths.iter().zip(EXPECTED) {
        assert!((strength.log - expected.0).abs() < 1e-4 && (strength.error - expected.1).abs() < 1e-4, "{strengths:?}");
    }
}

/// Logarithms of strengths and their errors.
const EXPECTED: [(f64, f64); 4] =
    [(-0.703_320, 0.107_076), (-0.336_323, 0.101_679), (0.117_969, 0.100_114), (0.921_674, 0.113_906)];
