//! Objects of ADM files, which are made here.

use glam::Vec3;
use promenade_paths::{Format, ImportOptions, Imported, PathFileError, PlacementOptions, alone, read};

/// A file with chunks before and after the XML.
fn wave(id: &[u8; 4], xml: &str) -> Vec<u8> {
    let mut bytes = [&id[..], &[0; 4], b"WAVE"].concat();
    let mut chunk = |id: &[u8; 4], content: &[u8]| {
        bytes.extend(id);
        bytes.extend(u32::try_from(content.len()).unwrap().to_le_bytes());
        bytes.extend(content);
        bytes.resize(bytes.len().next_multiple_of(2), 0);
    };
    chunk(b"fmt ", &[0; 16]);
    chunk(b"chna", &[0; 7]);
    chunk(b"axml", xml.as_bytes());
    chunk(b"data", &[0; 64]);
    bytes
}

/// Two objects with their blocks, in EBU's envelope.
fn model(pack: &str, first: &str, second: &str) -> String {
    let object = |n: u32, name: &str| {
        format!(
            r#"<audioObject audioObjectID="AO_100{n}" audioObjectName="{name}" start="00:00:01.00000">
                 <audioPackFormatIDRef>AP_0003100{n}</audioPackFormatIDRef></audioObject>
               <audioPackFormat audioPackFormatID="AP_0003100{n}" audioPackFormatName="{name}">{pack}
                 <audioChannelFormatIDRef>AC_0003100{n}</audioChannelFormatIDRef></audioPackFormat>"#
        )
    };
    let channel = |n: u32, blocks: &str| {
        format!(
            r#"<audioChannelFormat audioChannelFormatID="AC_0003100{n}"
                audioChannelFormatName="c">{blocks}</audioChannelFormat>"#
        )
    };
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?><ebuCoreMain xmlns="urn:ebu:metadata-schema:ebuCore_2015"
           ><coreMetadata><format>
           <audioFormatExtended>{}{}{}{}</audioFormatExtended></format></coreMetadata></ebuCoreMain>"#,
        object(1, "Voice"),
        object(2, "Bird"),
        channel(1, first),
        channel(2, second)
    )
}

fn polar(time: &str, more: &str, [azimuth, elevation, distance]: [f64; 3]) -> String {
    format!(
        r#"<audioBlockFormat {time}><position coordinate="azimuth">{azimuth}</position>
           <position coordinate="elevation">{elevation}</position>
           <position coordinate="distance">{distance}</position>{more}</audioBlockFormat>"#
    )
}

fn block(from: &str, length: &str) -> String {
    format!(r#"rtime="{from}" duration="{length}""#)
}

/// Ahead for a second, in two seconds to the left, there for a second, then in an instant up.
fn voice() -> String {
    [
        polar(&block("00:00:00.00000", "00:00:01.00000"), "", [0.0, 0.0, 1.0]),
        polar(&block("00:00:01.00000", "00:00:02.00000"), "", [90.0, 0.0, 1.0]),
        polar(&block("00:00:03.00000", "00:00:01.00000"), "", [90.0, 0.0, 1.0]),
        polar(&block("00:00:04.00000", "00:00:01.00000"), "<jumpPosition>1</jumpPosition>", [0.0, 90.0, 0.5]),
    ]
    .concat()
}

const GLIDE: &str = "<jumpPosition interpolationLength=\"1e39\">1</jumpPosition>";
const BIRD: &str = r#"<audioBlockFormat rtime="00:00:00.24000S48000"><cartesian>1</cartesian>
    <position coordinate="X">1</position>
    <position coordinate="Y">-0.5</position><position coordinate="Z">0.25</position></audioBlockFormat>"#;

fn imported(options: &ImportOptions) -> Imported {
    read("film.wav", &wave(b"BW64", &model("", &voice(), BIRD)), options, &mut alone).unwrap()
}

fn near(found: Vec3, wanted: [f32; 3], within: f32) {
    assert!((found - Vec3::from(wanted)).length() < within, "{found} for {wanted:?}");
}

#[test]
fn an_object_is_where_its_blocks_say() {
    for id in [b"BW64", b"RIFF", b"RF64"] {
        let bytes = wave(id, &model("", &voice(), BIRD));
        let found = read("film.wav", &bytes, &ImportOptions::default(), &mut alone).unwrap();
        assert_eq!((found.format, found.path.keyframes()[0].t_s), (Format::Adm, 1.0));
        assert!(found.notes.iter().any(|note| note.contains("\"Voice\" of Voice, Bird")), "{:?}", found.notes);
        // The object starts at 1 s. Half way it is half way along a straight line.
        for (t_s, place) in [
            (0.0, [1.0, 0.0, 0.0]),
            (1.9, [1.0, 0.0, 0.0]),
            (3.0, [0.5, 0.5, 0.0]),
            (3.5, [0.25, 0.75, 0.0]),
            (4.5, [0.0, 1.0, 0.0]),
            (4.99, [0.0, 1.0, 0.0]),
            (5.01, [0.0, 0.0, 0.5]),
            (5.5, [0.0, 0.0, 0.5]),
            (9.0, [0.0, 0.0, 0.5]),
        ] {
            near(found.path.pose_at(t_s).position, place, 6e-3);
        }
        let most = found.path.keyframes().len();
        assert!(most < 40, "{most} keyframes");
    }
}

#[test]
fn an_object_is_chosen_by_name_or_id_and_scaled() {
    let named = |object: &str| ImportOptions { object: Some(object.to_owned()), ..ImportOptions::default() };
    for name in ["Bird", "AO_1002"] {
        let path = imported(&named(name)).path;
        near(path.keyframes()[0].pose.position, [-0.5, -1.0, 0.25], 1e-6);
        // Half a second of samples.
        assert_eq!((path.keyframes().len(), path.keyframes()[0].t_s), (1, 1.5));
    }
    let scaled = PlacementOptions { metres_per_unit: Some(4.0), ..PlacementOptions::default() };
    let path = imported(&ImportOptions { placement: scaled, ..named("Bird") }).path;
    near(path.keyframes()[0].pose.position, [-2.0, -4.0, 1.0], 1e-5);
    let bytes = wave(b"BW64", &model("<absoluteDistance>3</absoluteDistance>", &voice(), BIRD));
    let path = read("film.wav", &bytes, &ImportOptions::default(), &mut alone).unwrap();
    near(path.path.keyframes()[0].pose.position, [3.0, 0.0, 0.0], 1e-5);
    assert!(path.notes.iter().any(|note| note.contains("3 m, as the file says")), "{:?}", path.notes);
}

#[test]
fn a_listener_hears_an_emitter_that_stays_where_the_object_is() {
    let emitter = Vec3::new(1.5, 0.0, 0.2);
    let scaled = PlacementOptions { metres_per_unit: Some(2.0), ..PlacementOptions::default() };
    let placed = ImportOptions { placement: scaled, ..ImportOptions::default() };
    let own = imported(&placed).path;
    let listener = imported(&ImportOptions { emitter: Some(emitter), ..placed }).path;
    for t_s in [1.0, 2.5, 3.3, 4.5, 5.5] {
        let heard = emitter - listener.pose_at(t_s).position;
        near(heard, own.pose_at(t_s).position.to_array(), 5e-3);
    }
}

#[test]
fn what_is_wrong_is_said_with_its_place() {
    let fails = |bytes: &[u8], options: &ImportOptions| -> String {
        let error: PathFileError = read("film.wav", bytes, options, &mut alone).unwrap_err();
        error.to_string()
    };
    let none = ImportOptions::default();
    let whole = wave(b"RIFF", &model("", &voice(), BIRD));
    let of = |blocks: &str| wave(b"RIFF", &model("", blocks, BIRD));
    let fish = ImportOptions { object: Some("Fish".to_owned()), ..none.clone() };
    for (error, clue) in [
        (fails(&whole, &fish), "film.wav: axml: expected an object \"Fish\", found Voice, Bird"),
        (fails(&whole[..60], &none), "expected a chunk that ends in the file, found one that is cut short"),
        (fails(&wave(b"RIFF", "<audio"), &none), "film.wav: chunk axml: expected XML of the Audio Definition Model"),
        (fails(&wave(b"RIFF", "<a/>"), &none), "expected an audioObject with a pack, found no object"),
        (fails(&of(""), &none), "expected an audioBlockFormat, found none"),
        (fails(&of("<audioBlockFormat/>"), &none), "axml, line 10: expected positions azimuth and elevation, or X and Y"),
        (
            fails(&of(&polar("rtime=\"soon\"", "", [0.0; 3])), &none),
            "expected a time such as 00:00:01.50000, found rtime of \"soon\"",
        ),
        (fails(&of(&polar("", "", [f64::NAN, 0.0, 0.0])), &none), "expected a number, found \"NaN\""),
        (
            fails(&of(&[voice(), polar(&block("00:00:05.00000", "00:00:01.00000"), GLIDE, [0.0; 3])].concat()), &none),
            "no longer than its block, found 1e39",
        ),
        (fails(b"RIFF\x04\0\0\0WAVE", &none), "expected a sound file with moves of objects (chunk axml), found none"),
    ] {
        assert!(error.contains(clue), "{error}");
    }
    // No length brings the reader down.
    for length in 0..whole.len() {
        let _ = read("film.wav", &whole[..length], &none, &mut alone);
    }
}

#[test]
fn the_bed_is_not_the_path_where_an_object_moves() {
    let still = polar(&block("00:00:00.00000", "00:00:04.00000"), "", [30.0, 0.0, 1.0]);
    let read = |first: &str, second: &str| {
        let bytes = wave(b"RIFF", &model("", first, second));
        read("master.wav", &bytes, &ImportOptions::default(), &mut alone).unwrap().notes.join("; ")
    };
    assert!(read(&still, &voice()).contains("object \"Bird\""), "{}", read(&still, &voice()));
    assert!(read(&voice(), &still).contains("object \"Voice\""));
    assert!(read(&still, &still).contains("object \"Voice\""), "the first where none moves");
}

#[test]
fn masters_of_any_length_are_read_by_their_chunks() {
    use std::io::{Seek, SeekFrom, Write};
    // 6 GB of samples that take no place on the disk, and the XML behind them.
    let xml = model("", &voice(), &voice());
    let samples = 6_u64 << 30;
    let mut file = tempfile::tempfile().unwrap();
    let mut head = b"BW64\xff\xff\xff\xffWAVEds64".to_vec();
    head.extend(28_u32.to_le_bytes());
    head.extend([0; 8]);
    head.extend(samples.to_le_bytes());
    head.extend([0; 12]);
    head.extend(b"data\xff\xff\xff\xff");
    file.write_all(&head).unwrap();
    file.seek(SeekFrom::Current(samples.cast_signed())).unwrap();
    file.write_all(b"axml").unwrap();
    file.write_all(&u32::try_from(xml.len()).unwrap().to_le_bytes()).unwrap();
    file.write_all(xml.as_bytes()).unwrap();
    let bytes = promenade_paths::bytes_of(&mut file).unwrap();
    assert!(bytes.len() < xml.len() + 64, "{} bytes", bytes.len());
    let found = read("master.wav", &bytes, &ImportOptions::default(), &mut alone).unwrap();
    let whole = read("short.wav", &wave(b"RIFF", &xml), &ImportOptions::default(), &mut alone).unwrap();
    assert_eq!(found.path, whole.path);
    // Without the XML it is an error of the reader's, not 6 GB of memory.
    file.set_len(samples).unwrap();
    let bytes = promenade_paths::bytes_of(&mut file).unwrap();
    assert!(bytes.len() <= 1 << 16 && read("master.wav", &bytes, &ImportOptions::default(), &mut alone).is_err());
}

#[test]
fn texts_that_take_more_work_than_their_length_are_refused() {
    let said = |xml: &str| read("m.wav", &wave(b"RIFF", xml), &ImportOptions::default(), &mut alone).unwrap_err().to_string();
    let attributes: String = (0..200_000).map(|i| format!(" a{i}=\"1\"")).collect();
    assert!(said(&format!("<x{attributes}/>")).contains("at most 256 attributes of an element"));
    let spaces: String = (0..300).map(|i| format!("<a xmlns:a{i}=\"u{i}\">")).collect();
    assert!(said(&spaces).contains("at most 256 namespaces"));
    // Elements that refer to few channels, many times.
    let many = r#"<audioObject audioObjectName="o"><audioPackFormatIDRef>AP_00031001</audioPackFormatIDRef></audioObject>"#;
    let still: String = (0..2000).map(|_| polar(&block("00:00:00.00000", "00:00:04.00000"), "", [30.0, 0.0, 1.0])).collect();
    let xml =
        model("", &still, &still).replace("<audioFormatExtended>", &format!("<audioFormatExtended>{}", many.repeat(20_000)));
    assert!(said(&xml).contains("and 19990 more") || said(&xml).contains("a block from"), "{}", said(&xml));
}

#[test]
fn an_object_is_moved_by_its_offset() {
    let offset = r#"<positionOffset coordinate="azimuth">30.0</positionOffset>"#;
    let model = model("", &voice(), BIRD);
    let xml =
        model.replacen("</audioPackFormatIDRef></audioObject>", &format!("</audioPackFormatIDRef>{offset}</audioObject>"), 1);
    let found = read("film.wav", &wave(b"BW64", &xml), &ImportOptions::default(), &mut alone).unwrap();
    near(found.path.pose_at(1.0).position, [0.75_f32.sqrt(), 0.5, 0.0], 1e-3);
    assert!(found.notes.iter().any(|note| note.contains("offset is added: azimuth 30")), "{:?}", found.notes);
    // Of the other kind than its positions.
    let wrong = xml.replace("coordinate=\"azimuth\">30.0", "coordinate=\"X\">0.5");
    let error = read("film.wav", &wave(b"BW64", &wrong), &ImportOptions::default(), &mut alone).unwrap_err().to_string();
    assert!(error.contains("the X of its object's offset"), "{error}");
}

#[test]
fn times_of_serial_adm_are_those_of_its_frame() {
    let local = voice().replace("rtime=", "lstart=").replace("duration=", "lduration=");
    let of = |voice: &str| {
        read("film.wav", &wave(b"BW64", &model("", voice, BIRD)), &ImportOptions::default(), &mut alone).unwrap().path
    };
    assert_eq!(of(&local).keyframes(), of(&voice()).keyframes());
}
