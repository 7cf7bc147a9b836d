//! `docs/complaints.md` names tests that there are.

use std::path::Path;

/// What stands between backticks in a line.
fn quoted(line: &str) -> impl Iterator<Item = &str> {
    line.split('`').skip(1).step_by(2)
}

#[test]
fn every_named_test_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let text = std::fs::read_to_string(root.join("docs/complaints.md")).unwrap();
    let mut found = 0;
    for row in text.lines().filter(|line| line.starts_with("| ")) {
        let mut file = None;
        for word in quoted(row) {
            if word.ends_with(".rs") {
                let source = std::fs::read_to_string(root.join(word));
                file = Some((word, source.unwrap_or_else(|error| panic!("{word}: {error}"))));
            } else if let Some((name, source)) = &file
                && word.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_')
            {
                let has = ["(", "<"].into_iter().any(|next| source.contains(&format!("fn {word}{next}")));
                assert!(has, "{name} has no test {word}");
                found += 1;
            }
        }
    }
    assert!(found > 30, "only {found} tests are named");
}
