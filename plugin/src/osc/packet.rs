//! Packets taken apart, with bounds on everything that a hostile one could make large.
//!
//! The parser of messages recurses into bundles and drops nested arrays by recursion, and would end the host with a packet that
//! nests thousands of them. Bundles are therefore taken apart here, and messages are checked before they are parsed.

use rosc::{OscBundle, OscMessage, OscPacket, OscType, encoder};

/// Bundles in bundles.
const DEEPEST: usize = 8;
/// Longest address, bytes.
const LONGEST_ADDRESS: usize = 256;
/// Arguments of a message, and bytes of its type tags.
const MOST_ARGUMENTS: usize = 64;
/// Arrays in arrays.
const DEEPEST_ARRAY: usize = 4;

/// Where programs of the Virtual Motion Capture protocol send the bones of a body, and what the head's are called here.
const BONES: &str = "/VMC/Ext/Bone/Pos";
const HEAD: &str = "/VMC/Ext/Bone/Pos/Head";

const BUNDLE: &[u8] = b"#bundle\0";
/// Tag and time tag of a bundle, bytes.
const BUNDLE_HEAD: usize = 16;

/// Calls `each` with the address and the bytes of every message of a packet, in order. Time tags mean now.
///
/// # Errors
/// A message on the fault; what comes before it has been handed over.
pub(super) fn messages<'a>(packet: &'a [u8], each: &mut impl FnMut(&'a str, &'a [u8])) -> Result<(), &'static str> {
    walk(packet, 0, each)
}

fn walk<'a>(packet: &'a [u8], depth: usize, each: &mut impl FnMut(&'a str, &'a [u8])) -> Result<(), &'static str> {
    if packet.first() == Some(&b'/') {
        match address(packet)? {
            // One address for all bones of a body, of which only the head is turned here.
            BONES => {
                if word(packet) == Some(b"Head") {
                    each(HEAD, packet);
                }
            }
            address => each(address, packet),
        }
        return Ok(());
    }
    if !packet.starts_with(BUNDLE) {
        return Err("a packet is neither a message nor a bundle");
    }
    if depth >= DEEPEST {
        return Err("bundles are nested too deeply");
    }
    let mut rest = packet.get(BUNDLE_HEAD..).ok_or("a bundle ends within its time tag")?;
    while let Some((size, after)) = rest.split_first_chunk::<4>() {
        let size = usize::try_from(u32::from_be_bytes(*size)).unwrap_or(usize::MAX);
        let (element, after) = after.split_at_checked(size).ok_or("a bundle is shorter than its elements")?;
        walk(element, depth + 1, each)?;
        rest = after;
    }
    if rest.is_empty() { Ok(()) } else { Err("a bundle ends within an element's size") }
}

/// A message's address, without a slash at its end.
fn address(message: &[u8]) -> Result<&str, &'static str> {
    let end = message.iter().take(LONGEST_ADDRESS + 1).position(|byte| *byte == 0);
    let text = &message[..end.ok_or("an address has no end, or is too long")?];
    let text = std::str::from_utf8(text).map_err(|_| "an address is no text")?;
    Ok(text.strip_suffix('/').unwrap_or(text))
}

/// The first argument of a message, where it is text.
fn word(message: &[u8]) -> Option<&[u8]> {
    let after = |text: &[u8]| text.iter().position(|byte| *byte == 0).map(|end| (end / 4 + 1) * 4);
    let tags = message.get(after(message)?..)?;
    let text = tags.get(after(tags)?..).filter(|_| tags.starts_with(b",s"))?;
    text.split(|byte| *byte == 0).next()
}

/// A message's arguments.
///
/// # Errors
/// A message on the fault.
pub(super) fn arguments(message: &[u8]) -> Result<Vec<OscType>, String> {
    check_tags(message)?;
    match rosc::decoder::decode_udp(message) {
        Ok((_, OscPacket::Message(OscMessage { args, .. }))) => Ok(args),
        Ok(_) => Err("not a message".to_owned()),
        Err(error) => Err(format!("not a message: {error}").chars().take(200).collect()),
    }
}

/// A message as a packet.
pub(super) fn encoded(address: &str, args: Vec<OscType>) -> Vec<u8> {
    // Nothing in a message can fail to be written.
    encoder::encode(&OscPacket::Message(OscMessage { addr: address.to_owned(), args })).unwrap_or_default()
}

/// Several messages at once.
pub(super) fn bundled(bundle: OscBundle) -> Vec<u8> {
    encoder::encode(&OscPacket::Bundle(bundle)).unwrap_or_default()
}

/// What the parser may be given.
fn check_tags(message: &[u8]) -> Result<(), &'static str> {
    let address_end = message.iter().position(|byte| *byte == 0).ok_or("an address has no end")?;
    let tags = message.get((address_end / 4 + 1) * 4..).unwrap_or_default();
    let tags = tags.split(|byte| *byte == 0).next().unwrap_or_default();
    if tags.first() != Some(&b',') {
        return Err("type tags are missing");
    }
    if tags.len() > MOST_ARGUMENTS {
        return Err("too many arguments");
    }
    let mut depth = 0_usize;
    for tag in tags {
        match tag {
            b'[' => depth += 1,
            b']' => depth = depth.saturating_sub(1),
            _ => (),
        }
        if depth > DEEPEST_ARRAY {
            return Err("arrays are nested too deeply");
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rosc::{OscBundle, OscTime};

    fn message(addr: &str, args: Vec<OscType>) -> OscPacket {
        OscPacket::Message(OscMessage { addr: addr.to_owned(), args })
    }

    fn bundle(content: Vec<OscPacket>) -> OscPacket {
        OscPacket::Bundle(OscBundle { timetag: OscTime { seconds: 0, fractional: 1 }, content })
    }

    fn walked(packet: &[u8]) -> (Vec<String>, Result<(), &'static str>) {
        let mut addresses = Vec::new();
        let result = messages(packet, &mut |address, message| {
            let _decoded = arguments(message);
            addresses.push(address.to_owned());
        });
        (addresses, result)
    }

    #[test]
    fn of_a_body_only_the_head_is_heard() {
        let bone = |name: &str| {
            let numbers = [0.0; 7].map(OscType::Float);
            message("/VMC/Ext/Bone/Pos", [OscType::String(name.to_owned())].into_iter().chain(numbers).collect())
        };
        let packet = encoder::encode(&bundle(vec![bone("Hips"), bone("Head"), bone("LeftHand")])).unwrap();
        assert_eq!(walked(&packet), (vec!["/VMC/Ext/Bone/Pos/Head".to_owned()], Ok(())));
    }

    fn samples() -> Vec<Vec<u8>> {
        let all_types = vec![
            OscType::Int(1),
            OscType::Float(2.0),
            OscType::Double(3.0),
            OscType::Long(4),
            OscType::String("five".to_owned()),
            OscType::Bool(true),
            OscType::Blob(vec![1, 2, 3]),
            OscType::Nil,
            OscType::Inf,
            OscType::Char('c'),
            OscType::Array(rosc::OscArray { content: vec![OscType::Float(1.0), OscType::Float(2.0)] }),
        ];
        let deep = (0..DEEPEST).fold(message("/deep", vec![]), |inner, _| bundle(vec![inner]));
        let packets = [
            message("/ypr", vec![OscType::Float(1.0), OscType::Float(2.0), OscType::Float(3.0)]),
            message("/all", all_types),
            bundle(vec![message("/a/", vec![OscType::Int(1)]), bundle(vec![message("/b", vec![])]), message("/c", vec![])]),
            bundle(vec![]),
            deep,
        ];
        packets.iter().map(|packet| encoder::encode(packet).unwrap()).collect()
    }

    #[test]
    fn bundles_are_taken_apart_in_order() {
        let found = samples().iter().map(|packet| walked(packet)).collect::<Vec<_>>();
        assert_eq!(found[0], (vec!["/ypr".to_owned()], Ok(())));
        assert_eq!(found[2], (["/a", "/b", "/c"].map(str::to_owned).to_vec(), Ok(())));
        assert_eq!(found[3], (vec![], Ok(())));
        assert_eq!(found[4], (vec!["/deep".to_owned()], Ok(())));
        let mut args = Vec::new();
        messages(&samples()[1], &mut |_, message| args = arguments(message).unwrap()).unwrap();
        assert_eq!(args.len(), 11);
    }

    #[test]
    fn every_truncation_and_every_changed_byte_does_no_harm() {
        for packet in samples() {
            for end in 0..packet.len() {
                let _harmless = walked(&packet[..end]);
            }
            for place in 0..packet.len() {
                for value in [0, 1, b'/', b'#', b'[', 0x7f, 0xff] {
                    let mut changed = packet.clone();
                    changed[place] = value;
                    let _harmless = walked(&changed);
                }
            }
        }
    }

    #[test]
    fn random_bytes_do_no_harm() {
        let mut rng = promenade_testing::Rng::with_seed(1);
        for round in 0..20_000_usize {
            let mut bytes = (0..round % 96).map(|_| rng.u8(..)).collect::<Vec<_>>();
            // Some begin as packets do.
            let head: &[u8] = [b"".as_slice(), b"/ypr\0\0\0\0,", b"#bundle\0\0\0\0\0\0\0\0\x01\0\0\0"][round % 3];
            bytes.splice(0..0, head.iter().copied());
            let _harmless = walked(&bytes);
        }
    }

    #[test]
    fn bombs_are_refused() {
        let nested = |bundles| {
            let packet = (0..bundles).fold(message("/deep", vec![]), |inner, _| bundle(vec![inner]));
            let (found, result) = walked(&encoder::encode(&packet).unwrap());
            (found.len(), result)
        };
        assert_eq!(nested(8), (1, Ok(())));
        assert_eq!(nested(9), (0, Err("bundles are nested too deeply")));
        // Bundles down to the last byte of a packet.
        let mut bytes = Vec::new();
        while bytes.len() < 65_000 {
            let size = u32::try_from(bytes.len()).unwrap();
            let head = [BUNDLE, &[0; 8], &size.to_be_bytes()].concat();
            bytes.splice(0..0, head);
        }
        assert!(walked(&bytes).1.is_err());
        let arrays = |open: usize| [b"/a\0\0,".as_slice(), &b"[".repeat(open), &b"]".repeat(open), &[0; 4]].concat();
        assert!(arguments(&arrays(2)).is_ok());
        assert_eq!(arguments(&arrays(10)).unwrap_err(), "arrays are nested too deeply");
        assert_eq!(arguments(&arrays(32_000)).unwrap_err(), "too many arguments");
        assert_eq!(
            arguments(&[b"/a\0\0,".as_slice(), &b"T".repeat(60_000), &[0; 4]].concat()).unwrap_err(),
            "too many arguments"
        );
    }

    #[test]
    fn huge_strings_are_only_strings() {
        let bytes = encoded("/a", vec![OscType::String("x".repeat(60_000))]);
        assert!(matches!(arguments(&bytes).unwrap().as_slice(), [OscType::String(text)] if text.len() == 60_000));
        let address = encoded(&format!("/{}", "a".repeat(60_000)), vec![]);
        assert!(walked(&address).1.is_err());
        assert!(walked(b"/a\0\0nottags\0").1.is_ok(), "the address is well");
        assert_eq!(arguments(b"/a\0\0nottags\0").unwrap_err(), "type tags are missing");
    }
}
