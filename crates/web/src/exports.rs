//! The module's functions. Bytes go in and out through a room in its memory; a text is what the last call that failed had to
//! say.
//!
//! There is one engine and one thread. Functions that return a `u32` return 1 for success.

#![cfg_attr(target_family = "wasm", expect(unsafe_code, reason = "names of exported functions; nothing else here is unsafe"))]

use crate::engine::{Engine, LoadOptions, pose};
use promenade_core::glam::Vec3;
use std::cell::RefCell;

/// Bytes that may be asked for: the largest scene.
const MOST_BYTES: usize = promenade_core::MAX_SCENE_BYTES;

thread_local! {
    static ENGINE: RefCell<Option<Engine>> = const { RefCell::new(None) };
    /// Room for bytes and numbers, aligned for both.
    static ROOM: RefCell<Vec<f64>> = const { RefCell::new(Vec::new()) };
    static LENGTH: RefCell<usize> = const { RefCell::new(0) };
    static TEXT: RefCell<String> = const { RefCell::new(String::new()) };
    static POINTS: RefCell<Vec<f32>> = const { RefCell::new(Vec::new()) };
    static POSE: RefCell<[f32; 8]> = const { RefCell::new([0.0; 8]) };
}

fn with<T: Default>(work: impl FnOnce(&mut Engine) -> T) -> T {
    ENGINE.with_borrow_mut(|engine| engine.as_mut().map(work).unwrap_or_default())
}

fn say(text: String) {
    TEXT.with_borrow_mut(|t| *t = text);
}

fn told(result: Result<(), String>) -> u32 {
    match result {
        Ok(()) => 1,
        Err(text) => {
            say(text);
            0
        }
    }
}

/// What was written into the room.
fn bytes() -> Vec<u8> {
    let length = LENGTH.with_borrow(|l| *l);
    ROOM.with_borrow(|room| room.iter().flat_map(|v| v.to_le_bytes()).take(length).collect())
}

fn of_bytes(work: impl FnOnce(&mut Engine, &[u8]) -> Result<(), String>) -> u32 {
    let bytes = bytes();
    told(ENGINE.with_borrow_mut(|engine| match engine {
        Some(engine) => work(engine, &bytes),
        None => Err("the engine has not been started".to_owned()),
    }))
}

/// Begins at a sample rate, Hz.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn start(rate_hz: f64) {
    // A panic ends the instance; what it said stays to be read.
    std::panic::set_hook(Box::new(|info| say(info.to_string())));
    ENGINE.with_borrow_mut(|engine| *engine = Some(Engine::new(rate_hz)));
}

/// Makes room for bytes and returns where it is; null where there are too many. What is called next takes them all.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn room(length: usize) -> *mut f64 {
    if length > MOST_BYTES {
        say(format!("expected at most {MOST_BYTES} bytes, found {length}"));
        return std::ptr::null_mut();
    }
    // What was said before is about something else.
    TEXT.with_borrow_mut(String::clear);
    LENGTH.with_borrow_mut(|l| *l = length);
    ROOM.with_borrow_mut(|room| {
        room.resize(length.div_ceil(8), 0.0);
        room.as_mut_ptr()
    })
}

/// Takes the head in the room for the next scene.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn head() -> u32 {
    of_bytes(Engine::set_head)
}

/// Takes the headphones in the room.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn headphones() -> u32 {
    of_bytes(Engine::set_headphones)
}

/// Takes the scene in the room, for some further sounds, within an error of all of it in just noticeable differences, 0 for
/// all. `flags`: 1 with a second emitter, 2 decoding where it plays.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn load(flags: u32, further: usize, within: f32) -> u32 {
    let options = LoadOptions { second_emitter: flags & 1 != 0, inline: flags & 2 != 0, further, within };
    of_bytes(|engine, bytes| engine.load(bytes, options))
}

/// Drops what the audio thread does not need, and empties the room.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn lighten() {
    with(Engine::lighten);
    ROOM.with_borrow_mut(|room| *room = Vec::new());
    LENGTH.with_borrow_mut(|l| *l = 0);
}

/// Writes what the scene is, as JSON, into the text.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn describe() {
    say(with(|engine| engine.description()));
}

/// Where the text is, UTF-8.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn text() -> *const u8 {
    TEXT.with_borrow(|text| text.as_ptr())
}

/// Its bytes.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn text_len() -> usize {
    TEXT.with_borrow(String::len)
}

/// Points to draw, 32-bit floats: anchors (0) or image sources (1). Where they are; `points_len` says how many numbers.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn points(kind: u32) -> *const f32 {
    let found = with(|engine| engine.points(kind));
    POINTS.with_borrow_mut(|points| {
        *points = found;
        points.as_ptr()
    })
}

/// Numbers of the points, or of the row that was decoded last.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn points_len() -> usize {
    POINTS.with_borrow(Vec::len)
}

/// Changes a setting.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn set(setting: u32, value: f32) {
    with(|engine| engine.set(setting, value));
}

/// Takes the path in the room: rows of eight 64-bit floats, time and pose; an empty room takes it away.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn path() -> u32 {
    let length = LENGTH.with_borrow(|l| *l) / 8;
    let rows = ROOM.with_borrow(|room| room[..length].to_vec());
    told(ENGINE.with_borrow_mut(|engine| engine.as_mut().map_or(Ok(()), |engine| engine.set_path(&rows))))
}

/// Walks the path from some seconds along it. `flags`: 1 over and over, 2 with a head of one's own.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn walk(from_s: f64, speed: f64, flags: u32) {
    with(|engine| engine.walk(from_s, speed, flags & 1 != 0, flags & 2 != 0));
}

/// Leaves the path.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn stop() {
    with(Engine::stop);
}

/// Takes a pose, metres and a quaternion, sent at a time of the sender's clock, seconds.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn glide(x: f32, y: f32, z: f32, qx: f32, qy: f32, qz: f32, qw: f32, sent_s: f64) {
    with(|engine| engine.take_pose(pose(x, y, z, qx, qy, qz, qw), sent_s));
}

/// Is at a pose from now on.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn jump(x: f32, y: f32, z: f32, qx: f32, qy: f32, qz: f32, qw: f32) {
    with(|engine| engine.jump(pose(x, y, z, qx, qy, qz, qw)));
}

/// Moves a sound, metres.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn put(sound: usize, x: f32, y: f32, z: f32) {
    with(|engine| engine.put(sound, Vec3::new(x, y, z)));
}

/// Where samples are written, 1024 at most: both channels of the first sound, then one of each further one; null beyond.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn input(channel: usize) -> *mut f32 {
    ENGINE.with_borrow_mut(|engine| match engine.as_mut().map(|engine| engine.input(channel)) {
        Some(samples) if !samples.is_empty() => samples.as_mut_ptr(),
        _ => std::ptr::null_mut(),
    })
}

/// Where the samples of an ear are read.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn ear(ear: usize) -> *const f32 {
    ENGINE.with_borrow(|engine| engine.as_ref().map_or(std::ptr::null(), |e| e.ear(ear).as_ptr()))
}

/// Plays a block, with the further sounds whose bits are set.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn process(channels: usize, further: u32, len: usize) {
    with(|engine| engine.process(channels, further, len));
}

/// Is as new again.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn reset() {
    with(Engine::reset);
}

/// Where eight 32-bit floats are: the pose that is played now, and seconds along the path, below 0 off it.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn heard() -> *const f32 {
    let now = with(|engine| {
        let (pose, along_s) = engine.heard();
        numbers(&pose, along_s as f32)
    });
    place(now)
}

/// Samples from sound in to sound out.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn latency() -> usize {
    with(|engine| engine.latency_samples().0)
}

/// Samples from a pose that is sent to its being used.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn pose_delay() -> f64 {
    with(|engine| engine.latency_samples().1)
}

/// Where the pose is that a voice is to decode, or null.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn asked(voice: usize) -> *const f32 {
    with(|engine| engine.asked(voice)).map_or(std::ptr::null(), |pose| place(numbers(&pose, 0.0)))
}

/// Takes the row in the room as the answer to a voice.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn answer(voice: usize) -> u32 {
    let length = LENGTH.with_borrow(|l| *l) / 4;
    ROOM.with_borrow(|room| {
        let low = |v: &f64| [v.to_bits() as u32, (v.to_bits() >> 32) as u32].map(f32::from_bits);
        POINTS.with_borrow_mut(|row| {
            row.clear();
            row.extend(room.iter().flat_map(low).take(length));
            u32::from(with(|engine| engine.answer(voice, row)))
        })
    })
}

/// Decodes a pose for another instance; the row is where the points are.
#[cfg_attr(target_family = "wasm", unsafe(no_mangle))]
pub extern "C" fn decode(x: f32, y: f32, z: f32, qx: f32, qy: f32, qz: f32, qw: f32) -> *const f32 {
    let row = with(|engine| engine.decode(&pose(x, y, z, qx, qy, qz, qw)));
    POINTS.with_borrow_mut(|points| {
        *points = row;
        points.as_ptr()
    })
}

fn numbers(pose: &promenade_core::Pose, last: f32) -> [f32; 8] {
    let ([x, y, z], [qx, qy, qz, qw]) = (pose.position.to_array(), pose.orientation.to_array());
    [x, y, z, qx, qy, qz, qw, last]
}

fn place(numbers: [f32; 8]) -> *const f32 {
    POSE.with_borrow_mut(|pose| {
        *pose = numbers;
        pose.as_ptr()
    })
}
