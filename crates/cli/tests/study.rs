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
    assert_eq!(json["parts"][0]["paired"]["all"]["scores"], serde_json::json!([74, 101, 137, 192]));
    assert!(std::fs::read_to_string(markdown).unwrap().contains("## Agreement and consistency\n\n|"));
    for plot in ["votes-1.svg", "votes-4.svg", "strengths-4.svg"] {
        assert!(std::fs::read_to_string(format!("{plots}/{plot}")).unwrap().contains("SoSal"), "{plot}");
    }
}

const HEAD: &str = "study,version,person,time,trial,part,method,item,a,b,x,answer,rating,role,seconds,headphones\n";

#[test]
fn parts_are_told_apart_and_persons_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let mut lines = HEAD.to_owned();
    for (person, passed) in [("p", "passed"), ("q", "passed"), ("r", "failed")] {
        lines += &format!(
            "s,v,{person},t,1,1,paired,hall,x,y,,x,,,30,{passed}\ns,v,{person},t,2,2,paired,hall,x,y,,y,,,30,{passed}\n"
        );
        lines += &format!(
            "s,v,{person},t,3,3,abx,hall,x,y,x,x,,,30,{passed}\ns,v,{person},t,4,,question,age,,,,30 to 39,,,,{passed}\n"
        );
    }
    std::fs::write(at("answers.csv"), lines).unwrap();
    let report = |rest: &[&str]| {
        let said = succeeds(&[&["study", "report", &at("answers.csv"), "--json", &at("report.json")], rest].concat()).0;
        let json: serde_json::Value = serde_json::from_slice(&std::fs::read(at("report.json")).unwrap()).unwrap();
        (said, json)
    };
    let (said, json) = report(&[]);
    // One question was answered by x and the other by y: nothing is pooled.
    let scores = |part: usize| json["parts"][part]["paired"]["items"][0]["scores"].clone();
    assert_eq!([scores(0), scores(1)], [serde_json::json!([2, 0]), serde_json::json!([0, 2])]);
    assert_eq!(json["parts"][2]["abx_by_person"].as_array().unwrap().len(), 2);
    assert!(
        said.contains("Left out, since they failed the headphone check: r\n") && said.contains("Votes: hall, part 2"),
        "{said}"
    );
    assert!(said.contains("Question: age") && said.contains("30 to 39"), "{said}");
    let (said, json) = report(&["--keep-failed"]);
    assert_eq!(json["parts"][0]["paired"]["items"][0]["scores"], serde_json::json!([3, 0]));
    assert!(said.contains("Kept, though they failed the headphone check: r\n"), "{said}");
    assert_eq!(json["persons"][2]["headphones_passed"], false);
    assert_eq!(json["persons"][0]["votes_as_others"], 1.0);
}

#[test]
fn answers_that_are_none_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.to_string_lossy().into_owned()
    };
    let (none, broken) = (file("none.csv", HEAD), file("broken.csv", &format!("{HEAD}s,v,p,t,1,1,paired,i,x,y,,z,,,1,\n")));
    all_fail(&[
        (vec!["study", "report", &none], "expected answers, found none"),
        (vec!["study", "report", &broken], "broken.csv: line 2: expected two conditions, and an answer that is one of them"),
        (vec!["study", "report", "/nowhere/answers.csv"], "/nowhere/answers.csv: cannot be read"),
    ]);
}
