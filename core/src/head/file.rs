//! A head as bytes: what a project keeps of it.

use super::{FEWEST_DIRECTIONS, HEAD_BANDS, Head, HeadError, MAX_HEAD_DIRECTIONS, is_level};

/// The most bytes of a head.
pub const MAX_HEAD_BYTES: usize = 1 << 18;
/// What the bytes begin with; the last is the version of the form.
const MAGIC: &[u8] = b"PromenadeHead\x01";
/// Bytes of a text, at most.
const MAX_TEXT: usize = 4096;

impl Head {
    /// The head as bytes: magic, name, credit and notes, number of directions, directions, delays, levels, a checksum. Numbers
    /// are little-endian; texts are UTF-8 after their length. The same head makes the same bytes.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        let notes = self.notes.join("\n");
        for text in [&self.name, &self.credit, &notes] {
            let mut end = text.len().min(MAX_TEXT);
            while !text.is_char_boundary(end) {
                end -= 1;
            }
            count(&mut bytes, end);
            bytes.extend_from_slice(&text.as_bytes()[..end]);
        }
        count(&mut bytes, self.directions.len());
        let numbers = self.directions.iter().flatten().chain(self.delays.iter().flatten());
        bytes.extend(numbers.flat_map(|v| v.to_le_bytes()));
        bytes.extend_from_slice(&self.levels);
        let checksum = crc32fast::hash(&bytes);
        bytes.extend(checksum.to_le_bytes());
        bytes
    }

    /// Reads what [`Head::to_bytes`] has written; no byte is trusted.
    ///
    /// # Errors
    /// Bytes of something else, of another version, damaged or cut short.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, HeadError> {
        let damaged = |found: &str| HeadError::value("head", "the bytes of one", found);
        if bytes.len() > MAX_HEAD_BYTES {
            return Err(HeadError::value("head", format!("at most {MAX_HEAD_BYTES} bytes"), bytes.len()));
        }
        let (content, checksum) = bytes.split_last_chunk::<4>().ok_or_else(|| damaged("too few"))?;
        let mut rest = content.strip_prefix(MAGIC).ok_or_else(|| damaged("something else, or another version"))?;
        if crc32fast::hash(content) != u32::from_le_bytes(*checksum) {
            return Err(damaged("another checksum: they are damaged"));
        }
        let mut text = || -> Option<String> {
            let (length, after) = rest.split_first_chunk::<4>()?;
            let length = usize::try_from(u32::from_le_bytes(*length)).ok().filter(|l| *l <= MAX_TEXT)?;
            let (text, after) = after.split_at_checked(length)?;
            rest = after;
            String::from_utf8(text.to_vec()).ok()
        };
        let (Some(name), Some(credit), Some(notes)) = (text(), text(), text()) else { return Err(damaged("no texts")) };
        let numbers = rest.split_first_chunk::<4>().and_then(|(number, after)| {
            let number = usize::try_from(u32::from_le_bytes(*number)).ok()?;
            let fits = (FEWEST_DIRECTIONS..=MAX_HEAD_DIRECTIONS).contains(&number);
            (fits && after.len() == number * (2 * 3 + 2 * 2 + 2 * HEAD_BANDS)).then_some((number, after))
        });
        let Some((number, after)) = numbers else { return Err(damaged("another number of directions than it says")) };
        let (directions, after) = after.split_at(number * 6);
        let (delays, levels) = after.split_at(number * 4);
        let number = |b: &[u8; 2]| i16::from_le_bytes(*b);
        let directions: Vec<[i16; 3]> =
            directions.as_chunks::<2>().0.as_chunks::<3>().0.iter().map(|d| d.each_ref().map(number)).collect();
        let delays = delays.as_chunks::<2>().0.as_chunks::<2>().0.iter().map(|d| d.each_ref().map(number)).collect();
        let notes = notes.lines().map(str::to_owned).collect();
        let mut head =
            Self { name, credit, notes, level: false, directions, units: Vec::new(), delays, levels: levels.to_vec() };
        head = head.with_units();
        head.level = is_level(&head.units);
        Ok(head)
    }
}

fn count(bytes: &mut Vec<u8>, count: usize) {
    bytes.extend(u32::try_from(count).unwrap_or(u32::MAX).to_le_bytes());
}
