//! Packets of head trackers that do not speak Open Sound Control, put into its words.

use super::packet::encoded;
use rosc::OscType;

/// What a packet of opentrack says: its place and its angles.
const OPENTRACK: &str = "/opentrack/pose";
/// What a packet of FreePIE says: its angles.
const FREEPIE: &str = "/freepie/ypr";
/// Six numbers of 64 bits: x, y and z in centimetres, yaw, pitch and roll (opentrack's output "UDP over network").
const OPENTRACK_BYTES: usize = 48;
/// The number of the device and flags, then numbers of 32 bits: nine of its sensors and three angles, or one of both (the
/// receiver "FreePIE UDP" of opentrack, which telephones send to).
const FREEPIE_HEAD: usize = 2;
const SENSORS: u8 = 1;
const ANGLES: u8 = 2;

/// The message that a packet stands for, if it is one of these.
pub(super) fn translated(packet: &[u8]) -> Option<Vec<u8>> {
    if is_open_sound_control(packet) {
        return None;
    }
    if packet.len() == OPENTRACK_BYTES {
        let values = packet.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes));
        let metres = values.enumerate().map(|(i, value)| if i < 3 { 0.01 * value } else { value });
        return Some(encoded(OPENTRACK, metres.map(OscType::Double).collect()));
    }
    let (head, values) = packet.split_at_checked(FREEPIE_HEAD)?;
    let flags = head[1];
    let before = if flags & SENSORS == 0 { 0 } else { 9 };
    let fits = flags & !(SENSORS | ANGLES) == 0 && flags & ANGLES != 0 && values.len() >= 4 * (before + 3);
    let angles = values.as_chunks::<4>().0.get(before..before + 3).filter(|_| fits)?;
    Some(encoded(FREEPIE, angles.iter().map(|bytes| OscType::Float(f32::from_le_bytes(*bytes))).collect()))
}

/// Whether a packet begins as a bundle, or as a message with an address and type tags.
fn is_open_sound_control(packet: &[u8]) -> bool {
    let message = || {
        let end = packet.iter().position(|byte| *byte == 0)?;
        let printed = packet[..end].iter().all(u8::is_ascii_graphic);
        (packet.first() == Some(&b'/') && printed).then(|| packet.get((end / 4 + 1) * 4) == Some(&b','))
    };
    packet.starts_with(b"#bundle") || message().unwrap_or(false)
}

#[cfg(test)]
mod tests {
    use super::super::packet::{arguments, messages};
    use super::*;

    fn said(packet: &[u8]) -> Option<(String, Vec<f64>)> {
        let message = translated(packet)?;
        let mut found = None;
        messages(&message, &mut |address, bytes| {
            let numbers = arguments(bytes).unwrap().into_iter().map(|argument| match argument {
                OscType::Double(value) => value,
                OscType::Float(value) => value.into(),
                other => panic!("{other:?}"),
            });
            found = Some((address.to_owned(), numbers.collect()));
        })
        .unwrap();
        found
    }

    #[test]
    fn packets_become_messages_and_messages_stay() {
        let pose: Vec<u8> = [10.0_f64, -20.0, 30.0, 40.0, -50.0, 60.0].into_iter().flat_map(f64::to_le_bytes).collect();
        assert_eq!(said(&pose), Some(("/opentrack/pose".to_owned(), vec![0.1, -0.2, 0.3, 40.0, -50.0, 60.0])));
        let floats = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let turned = Some(("/freepie/ypr".to_owned(), vec![0.5, -0.25, 1.0]));
        assert_eq!(said(&[&[0, 2][..], &floats(&[0.5, -0.25, 1.0])].concat()), turned);
        let all = [&[9.0; 9][..], &[0.5, -0.25, 1.0]].concat();
        assert_eq!(said(&[&[0, 3][..], &floats(&all)].concat()), turned);
        // A message that is as long, a number that begins as one, sensors alone, and nothing.
        let message = encoded("/abcd", vec![OscType::Double(1.0); 4]);
        assert!(message.len() == 48 && translated(&message).is_none(), "{}", message.len());
        let mut slash = pose.clone();
        slash[0] = b'/';
        assert!(translated(&slash).is_some());
        for other in [&[0, 1, 2, 3][..], &[], &[0, 2, 0, 0], b"#bundle\0"] {
            assert_eq!(translated(other), None, "{other:?}");
        }
    }
}
