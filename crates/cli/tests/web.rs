//! `promenade web`, from outside.

use crate::common::{fails, succeeds};
use serde_json::json;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../presets/scenes/box.promenade");
const ROOM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../presets/library/living-room.promenade");
const SPEECH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/speech.wav");
const WALK: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../presets/paths/walk.json");

/// What begins as an engine does.
fn engine(folder: &Path) -> String {
    let file = folder.join("engine.wasm");
    std::fs::write(&file, b"\0asm\x01\0\0\0").unwrap();
    file.to_string_lossy().into_owned()
}

#[test]
fn a_site_holds_what_it_was_given_and_names_no_other_host() {
    let folder = tempfile::tempdir().unwrap();
    let site = folder.path().join("site");
    let out = site.to_string_lossy();
    let text = folder.path().join("ParametricEQ.txt");
    std::fs::write(&text, "Preamp: -3 dB\nFilter 1: ON PK Fc 1000 Hz Gain 2 dB Q 1.41\n").unwrap();
    let (engine, text) = (engine(folder.path()), text.to_string_lossy().into_owned());
    let given = [
        SCENE,
        ROOM,
        "--dry",
        SPEECH,
        ROOM,
        "--credit",
        "A. Reader",
        "--path",
        WALK,
        "--headphones",
        &text,
        "--engine",
        &engine,
        "-o",
        &out,
    ];
    succeeds(&[&["web"], &given[..]].concat());
    let contents: serde_json::Value = serde_json::from_slice(&std::fs::read(site.join("site.json")).unwrap()).unwrap();
    let file = |list: &str, number: usize| std::fs::read(site.join(contents[list][number]["file"].as_str().unwrap())).unwrap();
    assert_eq!(contents["scenes"].as_array().unwrap().len(), 3);
    assert_ne!(contents["scenes"][1]["file"], contents["scenes"][2]["file"], "each has its file");
    assert_eq!(file("scenes", 0), std::fs::read(SCENE).unwrap());
    assert_eq!(file("sounds", 0), std::fs::read(SPEECH).unwrap());
    let outline = site.join(contents["scenes"][1]["outline"].as_str().unwrap());
    let edges: Vec<[f32; 6]> = serde_json::from_slice(&std::fs::read(outline).unwrap()).unwrap();
    assert!(edges.len() >= 12 && contents["scenes"][0]["outline"].is_null());
    let rows: Vec<[f64; 8]> = serde_json::from_slice(&file("paths", 0)).unwrap();
    assert!(rows.len() > 20 && rows[2][0] == 3.5 && (rows[2][6] - 0.5).abs() < 1e-6, "{:?}", rows[2]);
    assert!(file("headphones", 0).starts_with(b"{"));
    assert_eq!((&contents["sounds"][0]["credit"], &contents["paths"][0]["scene"]), (&json!("A. Reader"), &json!(0)));
    let packed = site.join(format!("{}.gz", contents["scenes"][0]["file"].as_str().unwrap()));
    assert!(std::fs::read(packed).unwrap().starts_with(&[0x1f, 0x8b]));
    assert!(site.join("site.json.gz").is_file());
    assert_eq!(contents["title"], contents["scenes"][0]["name"]);
    for (name, page) in promenade_web::files() {
        assert_eq!(std::fs::read(site.join(name)).unwrap(), page.as_bytes(), "{name}");
        let elsewhere = page.lines().find(|line| line.contains("://") && !line.contains("http://localhost"));
        assert!(elsewhere.is_none(), "{name}: {elsewhere:?}");
    }
}

#[test]
fn what_makes_no_page_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let (engine, site) = (engine(folder.path()), at("site"));
    std::fs::write(at("no.promenade"), "no scene").unwrap();
    let web = |rest: &[&str]| fails(&[&["web", "-o", &site], rest].concat());
    assert!(web(&[&at("no.promenade"), "--engine", &engine]).contains("no.promenade: no readable scene"));
    assert!(web(&[SCENE, "--engine", &at("no.promenade")]).contains("expected the engine as a WebAssembly module"));
    assert!(web(&[SCENE, "--engine", &at("none.wasm")]).contains("none.wasm: cannot be read"));
    assert!(web(&[SCENE, "--engine", &engine, "--dry", &at("none.wav")]).contains("none.wav"));
    assert!(web(&[SCENE, "--engine", &engine, "--credit", "A"]).contains("at most one text a dry sound, 0, found 1"));
    let walks = ["--path", WALK, WALK, WALK];
    assert!(web(&[&[SCENE, ROOM, "--engine", &engine], &walks[..]].concat()).contains("at most one file a scene, 2, found 3"));
    let head = "ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty float x\nend_header\n";
    std::fs::write(at("cut.ply"), head).unwrap();
    std::fs::write(at("odd.splat"), [0_u8; 33]).unwrap();
    let splats = |file: &str| web(&[SCENE, "--engine", &engine, "--splats", &at(file)]);
    assert!(splats("cut.ply").contains("cut.ply: expected splats with the property y, found none of this name"));
    assert!(splats("odd.splat").contains("odd.splat: expected 32 bytes a splat, found 33 bytes"));
    assert!(splats("engine.wasm").contains("expected splats as .ply or .splat"));
    assert!(fails(&["web", SCENE, "--engine", &engine, "-o", &engine]).contains("expected a folder to write, found a file"));
    assert!(!folder.path().join("site").exists(), "nothing is left");
}

/// The command while it serves.
struct Serving(Child);

impl Drop for Serving {
    fn drop(&mut self) {
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }
}

#[test]
fn a_served_page_is_for_this_machine_alone() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_promenade"));
    command.args(["web", SCENE, "--engine", &engine(folder.path()), "--serve", "0"]).stdout(Stdio::piped());
    let mut serving = Serving(command.spawn().unwrap());
    let mut line = String::new();
    BufReader::new(serving.0.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let port: u16 = line.trim().strip_prefix("http://localhost:").unwrap().trim_end_matches('/').parse().unwrap();
    let ask = |method: &str, path: &str, host: &str| {
        let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        write!(stream, "{method} {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        String::from_utf8_lossy(&answer).into_owned()
    };
    assert!(ask("GET", "/main.js", "localhost\r\nAccept-Encoding: gzip").contains("\r\nContent-Encoding: gzip\r\n"));
    let page = ask("GET", "/?x=1", "localhost:8000");
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("text/html") && page.contains("<title>Promenade</title>"));
    let engine = ask("GET", "/engine/promenade.wasm", "127.0.0.1");
    assert!(engine.starts_with("HTTP/1.1 200") && engine.contains("application/wasm"), "{engine}");
    for (method, path, host) in [
        ("GET", "/../Cargo.toml", "localhost"),
        ("GET", "/engine/../../../../etc/passwd", "localhost"),
        ("GET", "/%2e%2e/Cargo.toml", "localhost"),
        ("GET", "/nothing", "localhost"),
        ("POST", "/", "localhost"),
    ] {
        let answer = ask(method, path, host);
        assert!(answer.starts_with("HTTP/1.1 404") && !answer.contains("root:"), "{method} {path} {host}: {answer}");
    }
    assert!(ask("GET", "/", "example.org").starts_with("HTTP/1.1 421"));
}
