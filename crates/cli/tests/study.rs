//! `promenade study`, from outside.

use crate::common::{all_fail, succeeds};

const HARVEY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../study/tests/harvey.csv");

#[test]
fn published_tables_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let (json, markdown, plots) = (at("report.json"), at("report.md"), at("plots"));
    let said = succeeds(&["study", "report", HARVEY, "--json", &json, "--markdown", &markdown, "--plots", &plots]).0;
    for figure in ["0.1658", "32.86", "0.1825", "35.57", "0.1975", "38.00"] {
        assert!(said.contains(figure), "{figure}: {said}");
    }
    assert!(said.contains("R0 = 19.47: differences up to R = 19 can be chance"), "{said}");
    assert!(said.contains("Uni and SoSal 29, Uni and Mix 27"), "{said}");
    let json: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap();
    assert_eq!(json["paired"]["all"]["scores"], serde_json::json!([74, 101, 137, 192]));
    assert!(std::fs::read_to_string(markdown).unwrap().contains("## Agreement and consistency\n\n|"));
    for plot in ["votes-1.svg", "votes-4.svg", "strengths-4.svg"] {
        assert!(std::fs::read_to_string(format!("{plots}/{plot}")).unwrap().contains("SoSal"), "{plot}");
    }
}

#[test]
fn answers_that_are_none_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.to_string_lossy().into_owned()
    };
    let head = "study,person,time,trial,method,item,a,b,x,answer,rating,role,seconds,headphones\n";
    let (none, broken) = (file("none.csv", head), file("broken.csv", &format!("{head}s,p,t,1,paired,i,x,y,,z,,,1,\n")));
    all_fail(&[
        (vec!["study", "report", &none], "expected answers, found none"),
        (vec!["study", "report", &broken], "broken.csv: line 2: expected two conditions, and an answer that is one of them"),
        (vec!["study", "report", "/nowhere/answers.csv"], "/nowhere/answers.csv: cannot be read"),
    ]);
}
