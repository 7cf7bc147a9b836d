//! Moves of an object in an ADM file: the XML in the chunk `axml` of a BW64, RF64 or WAV file.
//!
//! Sources: ITU-R BS.2076 (the model), BS.2088 (the file), BS.2125 (times within a frame), BS.2127, section 7.2 (how a block's
//! position is reached).

use crate::PathFileError;
use crate::options::ImportOptions;
use crate::waypoint::{Track, Waypoint};
use glam::{DQuat, DVec3};
use promenade_core::MAX_KEYFRAMES;
use roxmltree::{Document, Node, NodeId, ParsingOptions};
use std::collections::{BTreeMap, HashMap};
use std::fmt::Display;

/// Steps a second along the way from one block to the next: paths are curves, and these ways straight lines.
const STEPS_PER_S: f64 = 20.0;
/// A jump takes as long, seconds, because times of a path rise.
const JUMP_S: f64 = 1e-3;
/// The longest glide of a block that has no end, seconds.
const LONGEST_GLIDE_S: f64 = 3_600.0;
/// Chunks before the one with the XML.
const MOST_CHUNKS: usize = 1_000;

/// Bytes of the XML, and nodes of it, at most: some 0.7 GB of memory together.
const MAX_XML_BYTES: usize = 256 << 20;
const MAX_NODES: u32 = 8_000_000;
/// Attributes of an element, and namespaces of all, at most: the parser compares each with each.
const MAX_ATTRIBUTES: usize = 256;
/// Names of objects that are told.
const TOLD: usize = 12;

/// Numbers by the names of coordinates.
type Coordinates = BTreeMap<String, f64>;

/// A position at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Place {
    t_s: f64,
    /// x ahead, y left, z up, normalised.
    position: DVec3,
}

pub(crate) fn read(file: &str, bytes: &[u8], options: &ImportOptions) -> Result<Track, PathFileError> {
    let xml = axml(file, bytes)?;
    let text =
        std::str::from_utf8(xml).map_err(|e| PathFileError::entry(file, "chunk axml", "text in UTF-8", e.to_string()))?;
    modest(text).map_err(|(expected, found)| PathFileError::entry(file, "chunk axml", expected, found))?;
    let limits = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text.trim_end_matches('\0'), limits)
        .map_err(|e| PathFileError::entry(file, "chunk axml", "XML of the Audio Definition Model", e.to_string()))?;
    let model = Model::new(file, &document);
    let (object, mut notes) = model.object(options.object.as_deref())?;
    let pack = model.referred(object, "audioPackFormatIDRef", &model.packs)?;
    let channel = model.referred(pack, "audioChannelFormatIDRef", &model.channels)?;
    let start_s = model.time(object, "start")?.unwrap_or(0.0);
    let offset = model.coordinates(object, "positionOffset")?;
    if !offset.is_empty() {
        let offset: Vec<String> = offset.iter().map(|(coordinate, value)| format!("{coordinate} {value}")).collect();
        notes.push(format!("the object's offset is added: {}", offset.join(", ")));
    }
    let places = model.places(channel, start_s, &offset)?;
    let metres = child(pack, "absoluteDistance").map(|node| model.number(node)).transpose()?;
    let metres = match (options.placement.metres_per_unit, metres) {
        (None, Some(metres)) if metres > 0.0 => {
            notes.push(format!("a distance of 1 is {metres} m, as the file says"));
            metres
        }
        (None, _) => {
            notes.push("a distance of 1 is taken for 1 m; --metres-per-unit says otherwise".to_owned());
            1.0
        }
        (Some(metres), _) => metres,
    };
    // The listener from which an emitter that stays is where the object is.
    let at = |place: &Place| {
        let moved = place.position * metres;
        let position = options.emitter.map_or(moved, |emitter| emitter.as_dvec3() - moved);
        Waypoint { t_s: place.t_s, position, orientation: DQuat::IDENTITY }
    };
    let waypoints: Vec<Waypoint> = places.iter().map(at).collect();
    if waypoints.len() > MAX_KEYFRAMES {
        return Err(PathFileError::content(file, format!("at most {MAX_KEYFRAMES} keyframes"), waypoints.len().to_string()));
    }
    let what = if options.emitter.is_some() { "the listener's, for an emitter that stays" } else { "the object's own" };
    notes.push(format!("the path is {what}; it looks along x"));
    Ok(Track { waypoints, place: Box::new(|index| format!("position {index}")), notes })
}

/// Refuses a text that takes more work than its length.
fn modest(text: &str) -> Result<(), (String, String)> {
    if text.len() > MAX_XML_BYTES {
        return Err((format!("at most {MAX_XML_BYTES} bytes"), text.len().to_string()));
    }
    let (mut inside, mut quote, mut attributes) = (false, None, 0);
    for byte in text.bytes() {
        match (inside, quote, byte) {
            (true, Some(open), _) if byte == open => quote = None,
            (true, None, b'"' | b'\'') => quote = Some(byte),
            (true, None, b'>') => inside = false,
            (true, None, b'=') => attributes += 1,
            (false, _, b'<') => (inside, attributes) = (true, 0),
            _ => (),
        }
        if attributes > MAX_ATTRIBUTES {
            return Err((format!("at most {MAX_ATTRIBUTES} attributes of an element"), "more".to_owned()));
        }
    }
    let namespaces = text.matches("xmlns").take(MAX_ATTRIBUTES + 1).count();
    if namespaces > MAX_ATTRIBUTES {
        return Err((format!("at most {MAX_ATTRIBUTES} namespaces"), "more".to_owned()));
    }
    Ok(())
}

/// The chunk with the XML. Chunks of 4 GiB and more have their length in the chunk `ds64`.
fn axml<'a>(file: &str, bytes: &'a [u8]) -> Result<&'a [u8], PathFileError> {
    let word = |at: usize| bytes.get(at..at + 4).and_then(|w| w.try_into().ok()).map(u32::from_le_bytes);
    let long = |at: usize| bytes.get(at..at + 8).and_then(|w| w.try_into().ok()).map(u64::from_le_bytes);
    let mut at = 12_usize;
    let mut data = None;
    for _ in 0..MOST_CHUNKS {
        let (Some(id), Some(length)) = (bytes.get(at..at + 4), word(at + 4)) else { break };
        let mut length = u64::from(length);
        if id == b"ds64" {
            data = long(at + 16);
        } else if id == b"data" && length == u64::from(u32::MAX) {
            length = data.unwrap_or(length);
        }
        let start = at + 8;
        let end = usize::try_from(length).ok().and_then(|length| start.checked_add(length));
        let Some(end) = end.filter(|end| *end <= bytes.len()) else {
            return Err(PathFileError::entry(
                file,
                format!("byte {at}"),
                "a chunk that ends in the file",
                "one that is cut short",
            ));
        };
        if id == b"axml" {
            return Ok(&bytes[start..end]);
        }
        // Chunks begin at even bytes.
        at = end + end % 2;
    }
    Err(PathFileError::content(file, "a sound file with moves of objects (chunk axml)", "none"))
}

/// Elements by their names, whatever their namespace.
fn named<'a, 'i>(node: Node<'a, 'i>, name: &'static str) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(move |child| child.tag_name().name() == name)
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &'static str) -> Option<Node<'a, 'i>> {
    named(node, name).next()
}

struct Model<'a, 'i> {
    file: &'a str,
    document: &'a Document<'i>,
    objects: Vec<Node<'a, 'i>>,
    /// Elements by their names' ids, the first of each.
    packs: Kind<'a, 'i>,
    channels: Kind<'a, 'i>,
}

/// Elements of one name.
struct Kind<'a, 'i> {
    name: &'static str,
    by_id: HashMap<&'a str, Node<'a, 'i>>,
}

impl<'a, 'i> Model<'a, 'i> {
    fn wrong(&self, node: Node, expected: &str, found: impl Display) -> PathFileError {
        let line = self.document.text_pos_at(node.range().start).row;
        PathFileError::entry(self.file, format!("axml, line {line}"), expected, found)
    }

    fn new(file: &'a str, document: &'a Document<'i>) -> Self {
        let kind = |name| Kind { name, by_id: HashMap::new() };
        let mut model =
            Self { file, document, objects: Vec::new(), packs: kind("audioPackFormat"), channels: kind("audioChannelFormat") };
        for node in document.descendants() {
            let (kind, id) = match node.tag_name().name() {
                "audioObject" => {
                    model.objects.push(node);
                    continue;
                }
                "audioPackFormat" => (&mut model.packs, "audioPackFormatID"),
                "audioChannelFormat" => (&mut model.channels, "audioChannelFormatID"),
                _ => continue,
            };
            if let Some(id) = node.attribute(id) {
                kind.by_id.entry(id).or_insert(node);
            }
        }
        model
    }

    /// The first object that is somewhere else later. Beds, whose channels are loudspeakers, stay where they are.
    fn moving(&self) -> Option<Node<'a, 'i>> {
        // Objects may share a channel, which is looked at once.
        let mut seen: HashMap<NodeId, bool> = HashMap::new();
        let moves = |channel: Node<'a, 'i>| {
            let mut positions =
                named(channel, "audioBlockFormat").filter_map(|block| self.position(block, &Coordinates::new()).ok());
            let first = positions.next();
            first.is_some_and(|first| positions.any(|position| position != first))
        };
        let mut object_moves = |object: &Node<'a, 'i>| {
            let pack = self.referred(*object, "audioPackFormatIDRef", &self.packs).ok()?;
            let channel = self.referred(pack, "audioChannelFormatIDRef", &self.channels).ok()?;
            seen.entry(channel.id()).or_insert_with(|| moves(channel)).then_some(())
        };
        self.objects.iter().find(|object| object_moves(object).is_some()).copied()
    }

    /// The object of a name or id, else the first that moves, else the first.
    fn object(&self, wanted: Option<&str>) -> Result<(Node<'a, 'i>, Vec<String>), PathFileError> {
        let name = |node: &Node<'a, 'i>| node.attribute("audioObjectName").unwrap_or_default().to_owned();
        let id = |node: &Node<'a, 'i>| node.attribute("audioObjectID").unwrap_or_default().to_owned();
        let objects = &self.objects;
        let found = match wanted {
            Some(wanted) => objects.iter().find(|node| name(node) == wanted || id(node) == wanted).copied(),
            None => {
                self.moving().or_else(|| objects.iter().find(|node| child(**node, "audioPackFormatIDRef").is_some()).copied())
            }
        };
        let mut names = objects.iter().take(TOLD).map(name).collect::<Vec<_>>().join(", ");
        if objects.len() > TOLD {
            names += &format!(" and {} more", objects.len() - TOLD);
        }
        let Some(object) = found else {
            let expected = wanted.map_or("an audioObject with a pack".to_owned(), |wanted| format!("an object {wanted:?}"));
            let found = if names.is_empty() { "no object".to_owned() } else { names };
            return Err(PathFileError::entry(self.file, "axml", expected, found));
        };
        let mut notes = Vec::new();
        if wanted.is_none() {
            notes.push(format!("object {:?} of {names}", name(&object)));
        }
        Ok((object, notes))
    }

    /// What an element refers to by id.
    fn referred(
        &self,
        from: Node<'a, 'i>,
        reference: &'static str,
        kind: &Kind<'a, 'i>,
    ) -> Result<Node<'a, 'i>, PathFileError> {
        let wanted = child(from, reference).and_then(|node| node.text()).map(str::trim);
        let Some(wanted) = wanted else { return Err(self.wrong(from, &format!("a {reference}"), "none")) };
        let found = kind.by_id.get(wanted).copied();
        found.ok_or_else(|| self.wrong(from, &format!("a {} {wanted}", kind.name), "none"))
    }

    fn number(&self, node: Node) -> Result<f64, PathFileError> {
        let text = node.text().unwrap_or_default().trim();
        let number = text.parse().ok().filter(|value: &f64| value.is_finite());
        number.ok_or_else(|| self.wrong(node, "a number", format!("{text:?}")))
    }

    /// A time, seconds: hours, minutes and seconds, or samples of a rate behind an S.
    fn time(&self, node: Node, attribute: &'static str) -> Result<Option<f64>, PathFileError> {
        let Some(text) = node.attribute(attribute) else { return Ok(None) };
        let wrong = || self.wrong(node, "a time such as 00:00:01.50000", format!("{attribute} of {text:?}"));
        let parts: Vec<&str> = text.trim().split(':').collect();
        let [hours, minutes, seconds] = parts[..] else { return Err(wrong()) };
        let seconds = match seconds.split_once('S') {
            None => seconds.parse().ok(),
            // 48000 samples of a second stand as 00.12000S48000.
            Some((time, rate)) => time.split_once('.').and_then(|(whole, samples)| {
                let [whole, samples, rate] = [whole, samples, rate].map(|part| part.parse::<f64>().ok());
                Some(whole? + samples? / rate.filter(|rate| *rate > 0.0)?)
            }),
        };
        let whole = |part: &str| part.parse::<u32>().ok().map(f64::from);
        let time =
            whole(hours).zip(whole(minutes)).zip(seconds).map(|((h, m), s): ((f64, f64), f64)| 3600.0 * h + 60.0 * m + s);
        time.filter(|time| time.is_finite() && *time >= 0.0).map(Some).ok_or_else(wrong)
    }

    /// The coordinates of a node's elements of a name.
    fn coordinates(&self, of: Node<'a, 'i>, name: &'static str) -> Result<Coordinates, PathFileError> {
        let mut all = Coordinates::new();
        for node in named(of, name) {
            // Bounds are another position beside it.
            if let (Some(coordinate), None) = (node.attribute("coordinate"), node.attribute("bound")) {
                all.insert(coordinate.to_owned(), self.number(node)?);
            }
        }
        Ok(all)
    }

    /// A block's position and what is added to it: x ahead, y left, z up.
    fn position(&self, block: Node<'a, 'i>, offset: &Coordinates) -> Result<DVec3, PathFileError> {
        let mut of = self.coordinates(block, "position")?;
        if of.contains_key("azimuth") {
            of.entry("distance".to_owned()).or_insert(1.0);
        } else {
            of.entry("Z".to_owned()).or_insert(0.0);
        }
        for (coordinate, value) in offset {
            let Some(own) = of.get_mut(coordinate) else {
                return Err(self.wrong(block, &format!("a position with the {coordinate} of its object's offset"), "none"));
            };
            *own += value;
        }
        let value = |name: &str| of.get(name).copied();
        if let (Some(azimuth), Some(elevation)) = (value("azimuth"), value("elevation")) {
            let (azimuth, elevation) = (azimuth.to_radians(), elevation.to_radians());
            let distance = value("distance").unwrap_or(1.0).max(0.0);
            let level = distance * elevation.cos();
            return Ok(DVec3::new(level * azimuth.cos(), level * azimuth.sin(), distance * elevation.sin()));
        }
        match (value("X"), value("Y")) {
            (Some(x), Some(y)) => Ok(DVec3::new(y, -x, value("Z").unwrap_or(0.0))),
            _ => Err(self.wrong(block, "positions azimuth and elevation, or X and Y", "neither")),
        }
    }

    /// Positions over time, close enough to each other for a curve through them.
    fn places(&self, channel: Node<'a, 'i>, start_s: f64, offset: &Coordinates) -> Result<Vec<Place>, PathFileError> {
        let mut all: Vec<Place> = Vec::new();
        for block in named(channel, "audioBlockFormat") {
            let position = self.position(block, offset)?;
            // Serial ADM counts from its frame.
            let time = |whole, of_frame| self.time(block, if block.has_attribute(of_frame) { of_frame } else { whole });
            let from_s = start_s + time("rtime", "lstart")?.unwrap_or(0.0);
            let length_s = time("duration", "lduration")?;
            let Some(last) = all.last().copied() else {
                all.push(Place { t_s: from_s, position });
                // It stays there for the block.
                all.extend(length_s.filter(|s| *s > 0.0).map(|s| Place { t_s: from_s + s, position }));
                continue;
            };
            let jump = child(block, "jumpPosition");
            let jumps = jump.and_then(|node| node.text()).is_some_and(|text| text.trim() == "1");
            let way_s = match (jump.and_then(|node| node.attribute("interpolationLength")), length_s) {
                (Some(length), _) if jumps => {
                    let most = length_s.unwrap_or(LONGEST_GLIDE_S) + JUMP_S;
                    let wanted = length.trim().parse().ok().filter(|s: &f64| (0.0..=most).contains(s));
                    let expected = "an interpolationLength in seconds, no longer than its block";
                    wanted.ok_or_else(|| self.wrong(block, expected, length))?.max(JUMP_S)
                }
                (None, _) if jumps => JUMP_S,
                (_, Some(length_s)) if length_s > 0.0 => length_s,
                _ => JUMP_S,
            };
            // Where it was until the block begins.
            if from_s > last.t_s + JUMP_S {
                all.push(Place { t_s: from_s, position: last.position });
            }
            let begun_s = all.last().map_or(from_s, |place| place.t_s);
            if begun_s > from_s + 2.0 * JUMP_S {
                return Err(self.wrong(block, &format!("a block from {begun_s} s on"), format!("one from {from_s} s")));
            }
            let steps = (way_s * STEPS_PER_S).ceil().clamp(1.0, 1e6);
            for step in (1_u32..).take_while(|step| f64::from(*step) <= steps) {
                if all.len() > MAX_KEYFRAMES {
                    return Err(PathFileError::content(self.file, format!("at most {MAX_KEYFRAMES} keyframes"), "more"));
                }
                let share = f64::from(step) / steps;
                all.push(Place { t_s: begun_s + share * way_s, position: last.position.lerp(position, share) });
            }
            let arrived_s = begun_s + way_s;
            let end_s = from_s + length_s.unwrap_or(0.0);
            if end_s > arrived_s + JUMP_S {
                all.push(Place { t_s: end_s, position });
            }
        }
        if all.is_empty() { Err(self.wrong(channel, "an audioBlockFormat", "none")) } else { Ok(guarded(&all)) }
    }
}

/// With a place beside each end of a jump, so that the curve does not swing out before and after it.
fn guarded(places: &[Place]) -> Vec<Place> {
    let mut all = Vec::with_capacity(places.len());
    let gap = |index: usize| places.get(index + 1).zip(places.get(index)).map(|(b, a)| b.t_s - a.t_s);
    let short = |gap: Option<f64>| gap.is_some_and(|gap| gap <= 2.0 * JUMP_S);
    let long = |gap: Option<f64>| gap.is_some_and(|gap| gap > 2.0 * JUMP_S);
    for (index, place) in places.iter().enumerate() {
        let (before, after) = (index.checked_sub(1).and_then(gap), gap(index));
        let beside = |other: &Place, by_s: f64| {
            let share = by_s / (other.t_s - place.t_s);
            Place { t_s: place.t_s + by_s, position: place.position.lerp(other.position, share) }
        };
        if long(before) && short(after) {
            all.push(beside(&places[index - 1], -JUMP_S));
        }
        all.push(*place);
        if short(before) && long(after) {
            all.push(beside(&places[index + 1], JUMP_S));
        }
    }
    all
}
