//! The server of a study, by requests.

use promenade_audio::wav::{self, Format};
use promenade_study::{HEADER, Server, Study, read, write_site};
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;

/// A site with a server, and its file of answers.
struct Place {
    folder: tempfile::TempDir,
    address: SocketAddr,
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["x.wav", "y.wav"] {
            let tone: Vec<f32> = (0..16_000_u16).map(|i| 0.1 * (f32::from(i) * 0.3).sin()).collect();
            wav::write(&at(name), 16_000, &[&tone], Format::Int16).unwrap();
        }
        let study = json!({
            "study": "rooms", "title": "Rooms", "post": true,
            "parts": [{ "method": "paired", "items": [{ "name": "hall", "conditions": { "x": "x.wav", "y": "y.wav" } }] }],
        });
        std::fs::write(at("study.json"), study.to_string()).unwrap();
        std::fs::write(at("secret.txt"), "secret").unwrap();
        let study = Study::read(&at("study.json")).unwrap();
        write_site(&study, &at("study.json"), &at("site"), None).unwrap();
        let server = Server::new("127.0.0.1:0".parse().unwrap(), &[], &at("site"), &at("answers.csv")).unwrap();
        let address = server.address().unwrap();
        std::thread::spawn(move || server.run());
        Self { folder, address }
    }

    /// Status and body of the answer to these bytes.
    fn raw(&self, bytes: &[u8]) -> (u32, String) {
        let mut stream = TcpStream::connect(self.address).unwrap();
        // A server that refuses may have stopped to read.
        let _ = stream.write_all(bytes);
        let mut said = Vec::new();
        let _ = stream.read_to_end(&mut said);
        let said = String::from_utf8_lossy(&said).into_owned();
        let status = said.get(9..12).and_then(|s| s.parse().ok()).unwrap_or(0);
        (status, said.split_once("\r\n\r\n").map(|(_, body)| body.to_owned()).unwrap_or_default())
    }

    fn get(&self, path: &str) -> (u32, String) {
        self.raw(format!("GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n").as_bytes())
    }

    fn post(&self, path: &str, body: &str) -> (u32, String) {
        let head = format!(
            "POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n",
            body.len()
        );
        self.raw(format!("{head}{body}").as_bytes())
    }

    fn version(&self) -> String {
        let study = std::fs::read(self.folder.path().join("site/study.json")).unwrap();
        serde_json::from_slice::<Value>(&study).unwrap()["version"].as_str().unwrap().to_owned()
    }

    fn answers(&self) -> String {
        std::fs::read_to_string(self.folder.path().join("answers.csv")).unwrap()
    }
}

fn row(place: &Place, person: &str, answer: &str) -> Value {
    let cells = ["2026-01-01T00:00:00Z", "1", "1", "paired", "hall", "x", "y", "", answer, "", "", "9.5", "passed"];
    json!([&["rooms", &*place.version(), person], &cells[..]].concat())
}

fn body(row: &Value) -> String {
    json!({ "rows": [row] }).to_string()
}

#[test]
fn a_thousand_answers_at_once_are_all_kept() {
    let place = Place::new();
    std::thread::scope(|scope| {
        for person in 0..1000 {
            let place = &place;
            let post = move || {
                let (status, said) =
                    place.post("/answers", &body(&row(place, &format!("p{person}"), if person % 3 == 0 { "x" } else { "y" })));
                assert_eq!((status, &*said), (200, "1 rows\n"), "{person}");
            };
            std::thread::Builder::new().stack_size(256 << 10).spawn_scoped(scope, post).unwrap();
        }
    });
    let path = place.folder.path().join("answers.csv");
    let material = read(&[&path]).unwrap();
    assert_eq!((material.answers.list().len(), material.answers.persons(), material.answers.repeated), (1000, 1000, 0));
    assert_eq!(place.answers().lines().count(), 1001);
}

#[test]
fn the_site_is_shown_and_nothing_else() {
    let place = Place::new();
    let (status, page) = place.get("/");
    assert!(status == 200 && page.starts_with("<!doctype html>"), "{status}");
    assert_eq!(place.get("/index.html?person=a").0, 200);
    let study: Value = serde_json::from_str(&place.get("/study.json").1).unwrap();
    let file = study["parts"][0]["items"][0]["conditions"][0]["file"].as_str().unwrap().to_owned();
    assert_eq!(place.get(&format!("/{file}")).0, 200);
    #[cfg(unix)]
    std::os::unix::fs::symlink(place.folder.path().join("secret.txt"), place.folder.path().join("site/late.txt")).unwrap();
    for path in [
        "/../secret.txt",
        "/..%2fsecret.txt",
        "/%2e%2e/secret.txt",
        "//secret.txt",
        "/stimuli/../../secret.txt",
        "/late.txt",
        "/answers",
        "/stimuli",
        "/..\\secret.txt",
        "/stimuli/../index.html",
        "/answers.csv",
    ] {
        let (status, said) = place.get(path);
        assert!(status == 404 && !said.contains("secret"), "{path}: {status} {said}");
    }
    assert_eq!(place.get("secret.txt").0, 400);
}

#[test]
fn broken_and_huge_posts_change_nothing() {
    let place = Place::new();
    let head = HEADER.join(",") + "\n";
    let good = row(&place, "p", "x");
    let with = |column: usize, value: &str| {
        let mut row = good.clone();
        row[column] = json!(value);
        body(&row)
    };
    let many = json!({ "rows": vec![&good; 20_001] }).to_string();
    for (sent, status) in [
        ("", 422),
        ("{", 422),
        ("[]", 422),
        ("{\"rows\":[]}", 422),
        ("{\"rows\":[[\"a\"]]}", 422),
        ("{\"rows\":[[1]]}", 422),
        (&*with(0, "others"), 422),
        (&*with(1, "v00000000"), 422),
        (&*with(5, "first"), 422),
        (&*with(2, "../p"), 422),
        (&*with(2, &"p".repeat(65)), 422),
        (&*with(4, "first"), 422),
        (&*with(7, "attic"), 422),
        (&*with(8, "z"), 422),
        (&*with(11, "z"), 422),
        (&*with(3, "=1+1"), 422),
        (&*with(15, "a\nb"), 422),
        (&*with(14, &"9".repeat(129)), 422),
        (&*many, 422),
    ] {
        let (found, said) = place.post("/answers", sent);
        assert_eq!(found, status, "{}: {said}", &sent[..sent.len().min(120)]);
    }
    for path in ["/answers/", "/study.json", "/../answers.csv", "/answers.csv", "/new.csv"] {
        assert_eq!(place.post(path, &body(&good)).0, 404, "{path}");
    }
    let raw = |text: &str| place.raw(text.as_bytes()).0;
    assert_eq!(
        raw(
            "POST /answers HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 99999999999\r\n\r\n"
        ),
        413
    );
    assert_eq!(
        raw("POST /answers HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: -1\r\n\r\n"),
        400
    );
    assert_eq!(raw("POST /answers HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n\r\n"), 411);
    assert_eq!(raw("POST /answers HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n"), 411);
    assert_eq!(
        raw("POST /answers HTTP/1.1\r\nHost: localhost\r\nContent-Type: text/plain\r\nContent-Length: 2\r\n\r\n{}"),
        415
    );
    assert_eq!(raw("PUT /answers HTTP/1.1\r\nHost: localhost\r\nContent-Length: 2\r\n\r\n{}"), 405);
    assert_eq!(raw("DELETE /study.json HTTP/1.1\r\nHost: localhost\r\n\r\n"), 405);
    assert_eq!(raw("nonsense\r\n\r\n"), 400);
    assert_eq!(raw(&format!("GET / HTTP/1.1\r\nHost: localhost\r\nX: {}\r\n\r\n", "x".repeat(20_000))), 400);
    assert_eq!(place.answers(), head, "nothing was written");
    assert_eq!(place.post("/answers", &body(&good)).0, 200);
    assert_eq!(place.answers().lines().count(), 2);
}

#[test]
fn an_old_file_goes_on_and_another_is_left_alone() {
    let place = Place::new();
    assert_eq!(place.post("/answers", &body(&row(&place, "p", "x"))).0, 200);
    let (site, answers) = (place.folder.path().join("site"), place.folder.path().join("answers.csv"));
    let before = place.answers();
    // Half a line, as a machine leaves that lost its power.
    std::fs::write(&answers, format!("{before}rooms,q,")).unwrap();
    let again = Server::new("127.0.0.1:0".parse().unwrap(), &[], &site, &answers);
    assert!(again.is_ok() && place.answers().ends_with("rooms,q,\n"));
    let other = place.folder.path().join("secret.txt");
    let refused = Server::new("127.0.0.1:0".parse().unwrap(), &[], &site, &other).err().unwrap().to_string();
    assert!(refused.contains("secret.txt"), "{refused}");
    assert_eq!(std::fs::read_to_string(&other).unwrap(), "secret");
    assert!(Server::new("127.0.0.1:0".parse().unwrap(), &[], Path::new("/nowhere"), &answers).is_err());
}

/// Waits for a condition, some seconds at most.
fn comes(condition: impl Fn() -> bool) -> bool {
    (0..400).any(|_| {
        std::thread::sleep(std::time::Duration::from_millis(25));
        condition()
    })
}

#[test]
fn answers_are_not_shown_though_they_lie_in_the_site() {
    let place = Place::new();
    let site = place.folder.path().join("site");
    let answers = site.join("answers.csv");
    for _ in 0..2 {
        let server = Server::new("127.0.0.1:0".parse().unwrap(), &[], &site, &answers).unwrap();
        let row = row(&place, "p", "x");
        let place = Place { folder: tempfile::tempdir().unwrap(), address: server.address().unwrap() };
        std::thread::spawn(move || server.run());
        assert_eq!(place.post("/answers", &body(&row)).0, 200);
        assert_eq!((place.get("/answers.csv").0, place.get("/study.json").0), (404, 200));
    }
}

#[cfg(unix)]
#[test]
fn a_file_that_became_a_link_is_not_followed() {
    let place = Place::new();
    let at = |name: &str| place.folder.path().join(name);
    assert_eq!(place.get("/study.json").0, 200);
    std::fs::remove_file(at("site/study.json")).unwrap();
    std::os::unix::fs::symlink(at("secret.txt"), at("site/study.json")).unwrap();
    assert_eq!(place.get("/study.json").0, 404);
}

#[test]
fn requests_name_this_machine_and_come_from_its_pages() {
    let place = Place::new();
    let get = |head: &str| place.raw(format!("GET /study.json HTTP/1.1\r\n{head}\r\n").as_bytes()).0;
    for (head, status) in [
        ("Host: localhost:8090\r\n", 200),
        ("Host: 127.0.0.1\r\n", 200),
        ("Host: [::1]:80\r\nOrigin: http://[::1]:80\r\n", 200),
        ("Host: evil.example\r\n", 421),
        ("", 421),
        ("Host: localhost\r\nOrigin: http://localhost:8090\r\n", 200),
        ("Host: localhost\r\nOrigin: https://evil.example\r\n", 403),
        ("Host: localhost\r\nOrigin: null\r\n", 403),
    ] {
        assert_eq!(get(head), status, "{head}");
    }
    let hosts = ["study.example".to_owned()];
    let at = |name: &str| place.folder.path().join(name);
    let server = Server::new("127.0.0.1:0".parse().unwrap(), &hosts, &at("site"), &at("answers.csv")).unwrap();
    let named = Place { folder: tempfile::tempdir().unwrap(), address: server.address().unwrap() };
    std::thread::spawn(move || server.run());
    let head = "Host: study.example\r\nOrigin: https://study.example\r\n\r\n";
    assert_eq!(named.raw(format!("GET /study.json HTTP/1.1\r\n{head}").as_bytes()).0, 200);
}

#[test]
fn clients_that_drip_keep_nobody_out() {
    let place = Place::new();
    let mut slow: Vec<TcpStream> = (0..200).map(|_| TcpStream::connect(place.address).unwrap()).collect();
    slow.iter_mut().for_each(|client| client.write_all(b"GET / HT").unwrap());
    assert!(comes(|| place.get("/study.json").0 == 200));
}

/// Resident memory of this process, bytes.
#[cfg(target_os = "linux")]
fn memory() -> usize {
    let pages = std::fs::read_to_string("/proc/self/statm").unwrap();
    4096 * pages.split(' ').nth(1).unwrap().parse::<usize>().unwrap()
}

/// Sixty clients that take a large file slowly, hundreds that drip, and bodies of 100 MB.
#[cfg(target_os = "linux")]
#[test]
fn clients_without_end_cost_little_memory() {
    let place = Place::new();
    let (site, answers) = (place.folder.path().join("site"), place.folder.path().join("answers.csv"));
    std::fs::File::create(site.join("long.wav")).unwrap().set_len(86 << 20).unwrap();
    let server = Server::new("127.0.0.1:0".parse().unwrap(), &[], &site, &answers).unwrap();
    let place = Place { folder: tempfile::tempdir().unwrap(), address: server.address().unwrap() };
    std::thread::spawn(move || server.run());
    let before = memory();
    let begins = |head: &str| {
        let mut client = TcpStream::connect(place.address).unwrap();
        client.write_all(head.as_bytes()).unwrap();
        client
    };
    let large = "POST /answers HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: ";
    let mut clients: Vec<TcpStream> = (0..60).map(|_| begins("GET /long.wav HTTP/1.1\r\nHost: localhost\r\n\r\n")).collect();
    clients.extend((0..300).map(|_| begins("GET / HT")));
    clients.extend((0..60).map(|_| begins(&format!("{large}104857600\r\n\r\n"))));
    clients.extend((0..60).map(|_| begins(&format!("{large}4194304\r\n\r\n"))));
    assert!(comes(|| place.get("/study.json").0 == 200));
    let grown = memory().saturating_sub(before);
    assert!(grown < 64 << 20, "{grown} bytes");
}

#[test]
fn what_is_sent_is_packed_for_who_takes_it() {
    let place = Place::new();
    let get = |head: &str| {
        let mut stream = TcpStream::connect(place.address).unwrap();
        write!(stream, "GET /main.js HTTP/1.1\r\nHost: localhost\r\n{head}\r\n").unwrap();
        let mut said = Vec::new();
        stream.read_to_end(&mut said).unwrap();
        let at = said.windows(4).position(|four| four == b"\r\n\r\n").unwrap();
        (String::from_utf8_lossy(&said[..at]).into_owned(), said.split_off(at + 4))
    };
    let (head, plain) = get("");
    assert!(!head.contains("gzip") && plain.starts_with(b"//"), "{head}");
    let (head, packed) = get("Accept-Encoding: br, gzip\r\n");
    assert!(head.contains("Content-Encoding: gzip\r\n") && head.contains("text/javascript"), "{head}");
    assert!(packed.starts_with(&[0x1f, 0x8b]) && packed.len() * 2 < plain.len());
    assert_eq!(packed, std::fs::read(place.folder.path().join("site/main.js.gz")).unwrap());
}

/// A study of these items, as its page has it, and what is noted; tones of 1 s and 16 kHz unless they are named otherwise.
fn made(items: &Value) -> Result<(Value, Vec<String>, tempfile::TempDir), String> {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for (name, rate, frames) in [("x.wav", 16_000, 16_000_u16), ("short.wav", 16_000, 12_000), ("fast.wav", 24_000, 24_000)] {
        let tone: Vec<f32> = (0..frames).map(|i| 0.1 * (f32::from(i) * 0.3).sin()).collect();
        wav::write(&at(name), rate, &[&tone], Format::Int16).unwrap();
    }
    let study = json!({ "study": "s", "title": "S", "parts": [{ "method": "paired", "items": items }] });
    std::fs::write(at("study.json"), study.to_string()).unwrap();
    let study = Study::read(&at("study.json")).map_err(|error| error.to_string())?;
    let made = write_site(&study, &at("study.json"), &at("site"), Some(b"\0asm")).map_err(|error| error.to_string())?;
    let page = serde_json::from_slice(&std::fs::read(at("site/study.json")).unwrap()).unwrap();
    Ok((page, made.notes, folder))
}

#[test]
fn sounds_that_go_round_together_have_one_length_and_rate() {
    let of = |other: &str| made(&json!([{ "name": "hall", "conditions": { "a": "x.wav", "b": other } }]));
    let (page, notes, folder) = of("short.wav").unwrap();
    assert!(notes.len() == 1 && notes[0].contains("short.wav: 0.750 s, with silence to 1.000 s"), "{notes:?}");
    let file = |i: usize| page["parts"][0]["items"][0]["conditions"][i]["file"].as_str().unwrap();
    let frames = |i: usize| promenade_audio::sound::read(&folder.path().join("site").join(file(i))).unwrap().frames();
    assert_eq!([frames(0), frames(1)], [16_000; 2]);
    let refused = of("fast.wav").unwrap_err();
    assert!(refused.contains("fast.wav: expected 16000 Hz, as ") && refused.contains("found 24000 Hz"), "{refused}");
    // What is heard is part of the version.
    assert_ne!(page["version"], of("x.wav").unwrap().0["version"]);
}

#[test]
fn scenes_of_an_item_share_one_place() {
    let scene = |name: &str| format!("{}/../../presets/library/{name}.promenade", env!("CARGO_MANIFEST_DIR"));
    let (one, other) = (scene("living-room"), scene("dry-studio"));
    let item = |conditions: Value, start: Value| {
        let [name, dry] = ["rooms", "x.wav"];
        json!([{ "name": name, "dry": dry, "conditions": conditions, "start": start }])
    };
    let place =
        |conditions, start| made(&item(conditions, start)).map(|(page, ..)| page["parts"][0]["items"][0]["place"].clone());
    let found = place(json!({ "a": one, "b": other }), Value::Null).unwrap();
    for name in [&one, &other] {
        let scene = promenade_core::Scene::from_bytes(&std::fs::read(name).unwrap()).unwrap();
        let (low, high) = scene.bounds();
        for axis in 0..2 {
            let [from, to] = [0, 1].map(|end: usize| found["bounds"][end][axis].as_f64().unwrap() as f32);
            assert!(low[axis] <= from && from < to && to <= high[axis], "{name}: {found}");
        }
    }
    let at = |place: &Value, axis: usize| place["start"]["position"][axis].as_f64().unwrap();
    let [x, y] = [0, 1].map(|axis| at(&found, axis));
    let told = place(json!({ "a": one, "b": other }), json!([x, y, 1.25, 90.0])).unwrap();
    let turn = told["start"]["quaternion"][2].as_f64().unwrap();
    assert!((at(&told, 2) - 1.25).abs() < 1e-6 && (turn - 0.5_f64.sqrt()).abs() < 1e-6, "{told}");
    let beyond = place(json!({ "a": one, "b": other }), json!([99.0, y, 1.25, 0.0])).unwrap_err();
    assert!(beyond.contains("item \"rooms\" to start within x "), "{beyond}");
}
