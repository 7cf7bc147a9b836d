//! The page's own files.

macro_rules! files {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../page/", $name)))),*]
    };
}

/// Names in a site and contents.
pub(crate) const FILES: &[(&str, &str)] = files![
    "index.html",
    "study.css",
    "main.js",
    "answers.js",
    "deck.js",
    "headphones.js",
    "order.js",
    "parts.js",
    "random.js",
    "trials.js",
    "walker.js",
];
