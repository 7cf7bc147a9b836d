//! The tables of figures in `docs/` are those of the data in `docs/figures/`, written by its `tables.py`.

use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn docs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs")
}

/// Paths in a folder whose names end so.
fn with_ending(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    paths.filter(|path| path.extension().is_some_and(|found| found == ending)).collect()
}

fn text<'a>(value: &'a Value, field: &str, file: &Path) -> &'a str {
    let found = value[field].as_str().filter(|text| !text.trim().is_empty());
    found.unwrap_or_else(|| panic!("{}: expected a text in {field:?}, found {}", file.display(), value[field]))
}

fn cell(value: &Value, digits: Option<u64>) -> String {
    match value {
        Value::Array(parts) => parts.iter().map(|part| cell(part, digits)).collect::<Vec<_>>().join("/"),
        Value::Null => "–".to_owned(),
        Value::String(text) => text.clone(),
        number => {
            let digits = digits.unwrap_or_else(|| panic!("a number in a column without digits: {number}"));
            format!("{:.*}", usize::try_from(digits).unwrap(), number.as_f64().unwrap())
        }
    }
}

fn table(file: &Path) -> String {
    let data: Value =
        serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let [machine, date, command] = ["machine", "date", "command"].map(|field| text(&data, field, file));
    let all = data["columns"].as_array().unwrap();
    let is_shown = |column: &Value| column["shown"] != false;
    let columns: Vec<_> = all.iter().filter(|column| is_shown(column)).collect();
    let headings = columns.iter().map(|column| {
        let unit = column["unit"].as_str().map_or_else(String::new, |unit| format!(", {unit}"));
        text(column, "name", file).to_owned() + &unit
    });
    let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
    let rule: String = columns.iter().map(|column| if column["digits"].is_u64() { "|---:" } else { "|---" }).collect();
    let rows = data["rows"].as_array().unwrap().iter().map(|row| {
        let row = row.as_array().unwrap();
        assert_eq!(row.len(), all.len(), "{}: cells of {row:?}", file.display());
        let shown = row.iter().zip(all).filter(|(_, column)| is_shown(column));
        line(shown.map(|(value, column)| cell(value, column["digits"].as_u64())).collect())
    });
    let (head, rows) = (line(headings.collect()), rows.collect::<String>());
    format!("\n{head}{rule}|\n{rows}\n*{machine}, {date}:* `{command}`\n\n")
}

#[test]
fn tables_of_figures_are_those_of_their_data() {
    let mut shown = BTreeSet::new();
    for page in with_ending(&docs(), "md") {
        let words = fs::read_to_string(&page).unwrap();
        for part in words.split("<!-- figures: ").skip(1) {
            let (name, rest) = part.split_once(" -->\n").expect("a marker ends in its line");
            let found = rest.split_once("<!-- end -->").expect("a table has its end").0;
            let expected = table(&docs().join(format!("figures/{name}.json")));
            assert!(found == expected, "{}: {name} is not its data; run docs/figures/tables.py\n{expected}", page.display());
            shown.insert(format!("{name}.json"));
        }
    }
    let names = with_ending(&docs().join("figures"), "json").into_iter();
    let kept: BTreeSet<String> = names.map(|path| path.file_name().unwrap().to_str().unwrap().to_owned()).collect();
    assert!(kept.len() > 15, "only {} files are found", kept.len());
    let unused: Vec<&String> = kept.difference(&shown).collect();
    assert_eq!(unused, [] as [&String; 0], "these are in docs/figures and on no page");
}
