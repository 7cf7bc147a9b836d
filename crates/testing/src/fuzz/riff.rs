//! Files of chunks: RIFF and its relatives, and binary glTF.

use super::{bytes, json, text};
use fastrand::Rng;

type Chunk = ([u8; 4], Vec<u8>);

/// Whether a file is a wave file of some kind.
pub(super) fn is_one(file: &[u8]) -> bool {
    file.get(8..12) == Some(b"WAVE")
}

/// A wave file with one chunk changed, lost, repeated or moved; lengths fit.
pub(super) fn changed(rng: &mut Rng, file: &[u8], other: &[u8]) -> Option<Vec<u8>> {
    let mut chunks = chunks(&file[12..], false)?;
    let more = if is_one(other) { self::chunks(&other[12..], false) } else { None };
    shuffled(rng, &mut chunks, more.unwrap_or_default());
    let mut result = file[..12].to_vec();
    for (id, content) in &chunks {
        result.extend(id);
        result.extend((content.len() as u32).to_le_bytes());
        result.extend(content);
        result.resize(result.len().next_multiple_of(2), 0);
    }
    let length = (result.len() - 8) as u32;
    result[4..8].copy_from_slice(&length.to_le_bytes());
    Some(result)
}

/// A binary glTF file with its JSON or a chunk changed; lengths fit.
pub(super) fn changed_gltf(rng: &mut Rng, file: &[u8]) -> Option<Vec<u8>> {
    let mut chunks = chunks(file.get(12..)?, true)?;
    if rng.bool() {
        let (_, content) = chunks.first_mut()?;
        *content = within(rng, content)?;
    } else {
        shuffled(rng, &mut chunks, Vec::new());
    }
    let mut result = file[..12].to_vec();
    for (id, content) in &chunks {
        let length = content.len().next_multiple_of(4);
        result.extend((length as u32).to_le_bytes());
        result.extend(id);
        result.extend(content);
        result.resize(result.len() + length - content.len(), b' ');
    }
    let length = result.len() as u32;
    result[8..12].copy_from_slice(&length.to_le_bytes());
    Some(result)
}

fn chunks(mut rest: &[u8], size_first: bool) -> Option<Vec<Chunk>> {
    let mut chunks = Vec::new();
    while let Some((head, after)) = rest.split_first_chunk::<8>() {
        let [one, two] = [&head[..4], &head[4..]].map(|part| <[u8; 4]>::try_from(part).unwrap_or_default());
        let (id, size) = if size_first { (two, one) } else { (one, two) };
        let size = u32::from_le_bytes(size) as usize;
        chunks.push((id, after.get(..size)?.to_vec()));
        rest = after.get(if size_first { size } else { size.next_multiple_of(2) }..).unwrap_or_default();
    }
    Some(chunks).filter(|chunks| !chunks.is_empty())
}

fn shuffled(rng: &mut Rng, chunks: &mut Vec<Chunk>, mut more: Vec<Chunk>) {
    let at = rng.usize(..chunks.len());
    match rng.u8(0..8) {
        0 => drop(chunks.remove(at)),
        1 => chunks.insert(at, chunks[at].clone()),
        2 => {
            let to = rng.usize(..chunks.len());
            chunks.swap(at, to);
        }
        3 if !more.is_empty() => chunks.insert(at, more.swap_remove(rng.usize(..more.len()))),
        _ => {
            let content = &mut chunks[at].1;
            match within(rng, content).filter(|_| rng.bool()) {
                Some(changed) => *content = changed,
                None => bytes::change(rng, content, b""),
            }
        }
    }
}

/// A chunk's content that is a text, changed.
fn within(rng: &mut Rng, content: &[u8]) -> Option<Vec<u8>> {
    json::changed(rng, content).or_else(|| text::changed(rng, content))
}
