//! The page's own files.

/// The engine's file in a site, which is built apart from these (`cargo xtask web`).
pub const ENGINE_FILE: &str = "engine/promenade.wasm";

/// Refuses a folder whose page was made by somebody else: a site would replace it.
///
/// # Errors
/// The file, what was expected and what was found.
pub fn check_folder(folder: &std::path::Path) -> Result<(), String> {
    let page = folder.join("index.html");
    match std::fs::read(&page) {
        Ok(bytes) if !String::from_utf8_lossy(&bytes).contains("content=\"Promenade\"") => {
            Err(format!("{}: expected a folder without a page, or with one of Promenade, found another", page.display()))
        }
        _ => Ok(()),
    }
}

macro_rules! files {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../page/", $name)))),*]
    };
}

/// Names in a site, with slashes, and contents of all files but the engine and what the user brings.
#[must_use]
pub fn files() -> &'static [(&'static str, &'static str)] {
    files![
        "index.html",
        "style.css",
        "main.js",
        "controls.js",
        "figures.js",
        "headset.js",
        "listener.js",
        "messages.js",
        "orientation.js",
        "output.js",
        "path.js",
        "shader.js",
        "site.js",
        "splats.js",
        "splats-sorter.js",
        "stage.js",
        "turns.js",
        "voices.js",
        "walking.js",
        "engine/engine.js",
        "engine/module.js",
        "engine/preparer.js",
        "engine/processor.js",
        "engine/settings.js",
    ]
}

/// The media type of a file of a site, by its name.
#[must_use]
pub fn media_type(name: &str) -> &'static str {
    match name.rsplit('.').next().unwrap_or_default() {
        "html" => "text/html; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "json" => "application/json",
        "wasm" => "application/wasm",
        "png" => "image/png",
        "wav" => "audio/wav",
        "flac" => "audio/flac",
        "mp3" => "audio/mpeg",
        "ogg" | "opus" => "audio/ogg",
        _ => "application/octet-stream",
    }
}
