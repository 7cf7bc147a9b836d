//! The manual as pages that a browser opens from the archive: the repository's texts, with their links to each other.

use anyhow::{Context, Result};
use pulldown_cmark::{CowStr, Event, HeadingLevel, LinkType, Options, Parser, Tag, TagEnd, html};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

/// Texts outside of `docs/`, and their pages.
const OTHERS: [(&str, &str); 3] =
    [("README.md", "index.html"), ("presets/README.md", "presets.html"), ("presets/library/README.md", "library.html")];
/// Texts that an archive has as they are, beside the manual.
const BESIDE: [&str; 4] = ["CHANGELOG.md", "CREDITS.md", "LICENSE-MIT", "LICENSE-APACHE"];
const STYLE: &str = "body{font:16px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em;color:#222;background:#fff}\
    table{border-collapse:collapse;display:block;overflow-x:auto}td,th{border:1px solid #ccc;padding:.3em .6em;text-align:left}\
    pre{background:#f3f3f3;padding:.8em;overflow-x:auto}code{background:#f3f3f3}img{max-width:100%}";

/// Files of the manual by their names in its folder, in order of their names.
pub(crate) fn manual(root: &Path) -> Result<Vec<(String, Vec<u8>)>> {
    let pages = pages(root)?;
    let mut media = BTreeSet::new();
    let mut files = Vec::new();
    for (from, page) in &pages {
        let text = fs::read_to_string(root.join(from)).with_context(|| format!("{} cannot be read", from.display()))?;
        files.push((page.clone(), written(from, &text, &pages, &mut media).into_bytes()));
    }
    for file in media {
        let bytes = fs::read(root.join(&file)).with_context(|| format!("{} cannot be read", file.display()))?;
        files.push((media_name(&file), bytes));
    }
    files.sort();
    Ok(files)
}

/// Texts of the repository and the pages that they become.
fn pages(root: &Path) -> Result<BTreeMap<PathBuf, String>> {
    let mut pages: BTreeMap<PathBuf, String> =
        OTHERS.map(|(from, page)| (PathBuf::from(from), page.to_owned())).into_iter().collect();
    let folder = root.join("docs");
    let unread = || format!("{} cannot be read", folder.display());
    for entry in fs::read_dir(&folder).with_context(unread)? {
        let path = entry.with_context(unread)?.path();
        if path.extension().is_some_and(|e| e == "md")
            && let Some(stem) = path.file_stem().and_then(|stem| stem.to_str())
        {
            pages.insert(Path::new("docs").join(format!("{stem}.md")), format!("{stem}.html"));
        }
    }
    Ok(pages)
}

/// A page of a text; notes the pictures and sounds that it has.
fn written(from: &Path, text: &str, pages: &BTreeMap<PathBuf, String>, media: &mut BTreeSet<PathBuf>) -> String {
    let mut events = Vec::new();
    let (mut heading, mut dropped) = (None::<(usize, String)>, Vec::new());
    let (mut title, mut used) = (String::new(), BTreeMap::new());
    for event in Parser::new_ext(text, Options::ENABLE_TABLES) {
        match event {
            Event::Start(Tag::Heading { level, .. }) => {
                heading = Some((events.len(), String::new()));
                events.push(Event::Start(Tag::Heading { level, id: None, classes: Vec::new(), attrs: Vec::new() }));
            }
            Event::End(TagEnd::Heading(level)) => {
                if let Some((at, words)) = heading.take() {
                    let id = CowStr::from(anchor(&words, &mut used));
                    events[at] = Event::Start(Tag::Heading { level, id: Some(id), classes: Vec::new(), attrs: Vec::new() });
                    if level == HeadingLevel::H1 && title.is_empty() {
                        title = words;
                    }
                }
                events.push(Event::End(TagEnd::Heading(level)));
            }
            Event::Start(Tag::Link { dest_url, title, .. }) => {
                // A link to what the archive lacks is its words.
                let sound = Some(place(from, &dest_url)).filter(|place| is_sound(place));
                let to = sound.as_deref().map(media_name).or_else(|| target(from, &dest_url, pages));
                media.extend(sound);
                dropped.push(to.is_none());
                if let Some(to) = to {
                    let (link_type, id) = (LinkType::Inline, CowStr::from(""));
                    events.push(Event::Start(Tag::Link { link_type, dest_url: to.into(), title, id }));
                }
            }
            Event::End(TagEnd::Link) => {
                if dropped.pop() == Some(false) {
                    events.push(Event::End(TagEnd::Link));
                }
            }
            Event::Start(Tag::Image { dest_url, title, link_type, id }) => {
                let picture = place(from, &dest_url);
                let to = media_name(&picture);
                media.insert(picture);
                events.push(Event::Start(Tag::Image { link_type, dest_url: to.into(), title, id }));
            }
            event => {
                if let (Some((_, words)), Event::Text(text) | Event::Code(text)) = (&mut heading, &event) {
                    words.push_str(text);
                }
                events.push(event);
            }
        }
    }
    let mut body = String::new();
    html::push_html(&mut body, events.into_iter());
    let mut escaped = String::new();
    html::push_html(&mut escaped, std::iter::once(Event::Text(title.into())));
    format!(
        "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>{escaped}</title><style>{STYLE}</style>\n\
         <p><a href=\"index.html\">Promenade</a> &middot; <a href=\"quick-start.html\">Quick start</a></p>\n{body}</html>\n"
    )
}

/// Where a link of a text leads in the manual; `None` where nothing of the archive is.
fn target(from: &Path, link: &str, pages: &BTreeMap<PathBuf, String>) -> Option<String> {
    if link.contains("://") || link.starts_with('#') {
        return Some(link.to_owned());
    }
    let (file, anchor) = link.split_once('#').map_or((link, String::new()), |(file, anchor)| (file, format!("#{anchor}")));
    let place = place(from, file);
    if let Some(page) = pages.get(&place) {
        return Some(format!("{page}{anchor}"));
    }
    BESIDE.iter().find(|name| place == Path::new(name)).map(|name| format!("../{name}"))
}

/// The path in the repository of what a text names by a path from its own folder.
fn place(from: &Path, link: &str) -> PathBuf {
    let mut place = from.parent().map_or_else(PathBuf::new, Path::to_path_buf);
    for part in Path::new(link).components() {
        match part {
            Component::ParentDir => drop(place.pop()),
            Component::Normal(part) => place.push(part),
            _ => (),
        }
    }
    place
}

fn is_sound(file: &Path) -> bool {
    file.extension().is_some_and(|ending| ending == "flac" || ending == "ogg")
}

/// The name of a picture or a sound in the manual's folder.
fn media_name(file: &Path) -> String {
    let folder = if is_sound(file) { "sounds" } else { "pictures" };
    format!("{folder}/{}", file.file_name().unwrap_or_default().to_string_lossy())
}

/// The anchor that a heading has where the repository is shown: small letters, digits and hyphens, with a number where there
/// was one like it.
fn anchor(words: &str, used: &mut BTreeMap<String, usize>) -> String {
    let kept = words.trim().chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    let anchor: String = kept.map(|c| if c == ' ' { '-' } else { c }).collect::<String>().to_lowercase();
    let count = used.entry(anchor.clone()).or_default();
    *count += 1;
    if *count > 1 { format!("{anchor}-{}", *count - 1) } else { anchor }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_page_and_anchor_that_is_linked_is_there() {
        let files = manual(&crate::root()).unwrap();
        let names: BTreeSet<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
        for name in ["index.html", "quick-start.html", "presets.html", "pictures/top-dark.png", "sounds/walk.flac"] {
            assert!(names.contains(name), "{name} in {names:?}");
        }
        let text = |name: &str| {
            let file = files.iter().find(|(found, _)| found == name).unwrap_or_else(|| panic!("{name} is linked and missing"));
            String::from_utf8(file.1.clone()).unwrap()
        };
        let mut followed = 0;
        for (name, _) in files.iter().filter(|(name, _)| name.ends_with(".html")) {
            let page = text(name);
            let links = page.split("href=\"").skip(1).map(|rest| rest.split('"').next().unwrap());
            for link in links.filter(|link| !link.contains("://") && !link.starts_with("../")) {
                let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
                if is_sound(Path::new(file)) {
                    assert!(names.contains(file), "{name} links {link}");
                    continue;
                }
                let page = text(if file.is_empty() { name } else { file });
                assert!(anchor.is_empty() || page.contains(&format!("id=\"{anchor}\"")), "{name} links {link}");
                followed += 1;
            }
        }
        assert!(followed > 200, "{followed} links");
    }

    /// The repository's texts by their paths, those that are in no archive too.
    fn texts() -> BTreeMap<PathBuf, String> {
        let out = std::process::Command::new("git").args(["ls-files", "*.md"]).current_dir(crate::root()).output().unwrap();
        let names = String::from_utf8(out.stdout).unwrap();
        let there = names.lines().map(PathBuf::from).filter(|name| crate::root().join(name).exists());
        there.map(|name| (name.clone(), fs::read_to_string(crate::root().join(name)).unwrap())).collect()
    }

    /// The anchors of a text's headings.
    fn anchors(text: &str) -> BTreeSet<String> {
        let (mut heading, mut used, mut found) = (None::<String>, BTreeMap::new(), BTreeSet::new());
        for event in Parser::new_ext(text, Options::ENABLE_TABLES) {
            match (event, &mut heading) {
                (Event::Start(Tag::Heading { .. }), _) => heading = Some(String::new()),
                (Event::Text(words) | Event::Code(words), Some(heading)) => heading.push_str(&words),
                (Event::End(TagEnd::Heading(_)), Some(words)) => {
                    found.insert(anchor(words, &mut used));
                    heading = None;
                }
                _ => (),
            }
        }
        found
    }

    #[test]
    fn links_of_every_text_lead_to_files_and_headings() {
        let texts = texts();
        let anchors: BTreeMap<_, _> = texts.iter().map(|(path, text)| (path.clone(), anchors(text))).collect();
        let (mut wrong, mut followed) = (Vec::new(), 0);
        for (from, text) in &texts {
            for event in Parser::new_ext(text, Options::ENABLE_TABLES) {
                let Event::Start(Tag::Link { dest_url: link, .. } | Tag::Image { dest_url: link, .. }) = event else {
                    continue;
                };
                if link.contains("://") {
                    continue;
                }
                let (file, anchor) = link.split_once('#').unwrap_or((&link, ""));
                let to = if file.is_empty() { from.clone() } else { place(from, file) };
                let heading = anchor.is_empty() || anchors.get(&to).is_some_and(|anchors| anchors.contains(anchor));
                if !crate::root().join(&to).exists() || !heading {
                    wrong.push(format!("{}: {link}", from.display()));
                }
                followed += 1;
            }
        }
        assert!(followed > 200, "{followed} links");
        assert!(wrong.is_empty(), "these lead nowhere:\n{}", wrong.join("\n"));
    }

    #[test]
    fn pictures_have_words_for_who_does_not_see_them() {
        let mut pictures = 0;
        for (from, text) in texts() {
            let mut words = None::<String>;
            for event in Parser::new_ext(&text, Options::ENABLE_TABLES) {
                match (event, &mut words) {
                    (Event::Start(Tag::Image { .. }), _) => words = Some(String::new()),
                    (Event::Text(text) | Event::Code(text), Some(words)) => words.push_str(&text),
                    (Event::End(TagEnd::Image), Some(said)) => {
                        assert!(said.split_whitespace().count() > 3, "{}: a picture says \"{said}\"", from.display());
                        (pictures, words) = (pictures + 1, None);
                    }
                    _ => (),
                }
            }
        }
        assert!(pictures > 10, "{pictures} pictures");
    }

    #[test]
    fn links_to_what_is_not_in_the_archive_are_words() {
        let pages = BTreeMap::from([(PathBuf::from("docs/b.md"), "b.html".to_owned())]);
        let mut pictures = BTreeSet::new();
        let text = "# A & b\n\n[one](b.md#c), [two](../core/src/lib.rs), [three](../CREDITS.md), ![four](pictures/p.png)\n\n\
                    ## A & b\n";
        let page = written(Path::new("docs/a.md"), text, &pages, &mut pictures);
        assert!(
            page.contains("<title>A &amp; b</title>")
                && page.contains("<h1 id=\"a--b\">")
                && page.contains("<h2 id=\"a--b-1\">")
        );
        assert!(page.contains("<a href=\"b.html#c\">one</a>, two, <a href=\"../CREDITS.md\">three</a>"), "{page}");
        assert!(page.contains("src=\"pictures/p.png\"") && pictures.contains(Path::new("docs/pictures/p.png")));
    }
}
