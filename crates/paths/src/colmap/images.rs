//! `images.txt`: two lines for each image, the second with its points; some tools leave the second out.

use super::{Image, image};
use crate::PathFileError;
use crate::text::{self, number, quoted};
use promenade_core::MAX_KEYFRAMES;

const NAMES: [&str; 7] = ["QW", "QX", "QY", "QZ", "TX", "TY", "TZ"];

pub(super) fn read(file: &str, bytes: &[u8], notes: &mut Vec<String>) -> Result<Vec<Image>, PathFileError> {
    let mut lines = text::of(file, bytes)?.lines().zip(1_u64..).peekable();
    let mut images = Vec::new();
    let mut announced = None;
    while let Some((line, number)) = lines.next() {
        let line = line.trim();
        if let Some(comment) = line.strip_prefix('#') {
            announced = announced.or_else(|| count(comment));
            continue;
        }
        if line.is_empty() {
            continue;
        }
        if images.len() == MAX_KEYFRAMES {
            return Err(PathFileError::content(file, format!("at most {MAX_KEYFRAMES} images"), "more"));
        }
        images.push(parse(file, number, line)?);
        lines.next_if(|(line, _)| is_points(line));
    }
    if let Some(announced) = announced.filter(|n| *n != images.len()) {
        notes.push(format!("the head of the file speaks of {announced} images, and there are {}", images.len()));
    }
    Ok(images)
}

/// Whether a line may hold points, x, y and a number each; of an image without any it is empty.
fn is_points(line: &str) -> bool {
    let mut count = 0;
    let numbers = line.split_whitespace().inspect(|_| count += 1).all(|word| word.parse::<f64>().is_ok());
    numbers && count % 3 == 0
}

/// The number of images that COLMAP writes into the head.
fn count(comment: &str) -> Option<usize> {
    let digits = comment.trim().strip_prefix("Number of images:")?.trim_start();
    digits.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

fn parse(file: &str, line: u64, text: &str) -> Result<Image, PathFileError> {
    let place = format!("line {line}");
    let wrong = |found| {
        let expected = "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, and a line of points after each";
        PathFileError::entry(file, place.as_str(), expected, found)
    };
    let mut rest = text;
    let mut word = || {
        let (word, after) = rest.split_once(char::is_whitespace)?;
        rest = after.trim_start();
        Some(word)
    };
    let mut words = [""; 9];
    for slot in &mut words {
        *slot = word().ok_or_else(|| wrong(quoted(text)))?;
    }
    let id = |word: &str| word.parse::<u32>().map_err(|_| wrong(format!("{} in place of an id", quoted(word))));
    let ids = [id(words[0])?, id(words[8])?];
    let mut pose = [0.0; 7];
    for ((value, word), name) in pose.iter_mut().zip(&words[1..8]).zip(NAMES) {
        *value = number(file, line, name, word)?;
    }
    if rest.is_empty() {
        return Err(wrong("no name".to_owned()));
    }
    image(file, &place, rest.to_owned(), ids, pose)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fails(text: &str) -> String {
        read("images.txt", text.as_bytes(), &mut Vec::new()).unwrap_err().to_string()
    }

    #[test]
    fn names_may_have_spaces_and_points_may_lack() {
        let mut notes = Vec::new();
        let text = "# Number of images: 3, mean observations per image: 0\r\n9 1 0 0 0 1 2 3 4 sub dir/a b.jpg\r\n\r\n5 1 0 0 \
            0 1 2 3 4 c.jpg";
        let images = read("images.txt", text.as_bytes(), &mut notes).unwrap();
        assert_eq!((images[0].name.as_str(), images[0].camera, images[1].name.as_str()), ("sub dir/a b.jpg", 4, "c.jpg"));
        assert_eq!(notes, ["the head of the file speaks of 3 images, and there are 2"]);
    }

    #[test]
    fn errors_name_the_line() {
        for (text, clue) in [
            ("# a\n1 1 0 0 0 0 0 0 1\n", "line 2: expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"),
            ("1 1 0 0 0 0 0 0 1 a.jpg\n3.5 4.5 -1\n7 8\n", "line 3: expected IMAGE_ID"),
            ("1 1 0 zero 0 0 0 0 1 a.jpg\n", "line 1: expected a finite number for QY, found \"zero\""),
            ("1 2 0 0 0 0 0 0 1 a.jpg\n", "line 1: expected a unit quaternion, found one of length 2"),
            ("1 1 0 0 0 0 0 nan 1 a.jpg\n", "line 1: expected a finite number for TZ"),
            ("1 1 0 0 0 0 0 0 x a.jpg\n", "found \"x\" in place of an id"),
        ] {
            let error = fails(text);
            assert!(error.contains(clue), "{text:?}: {error}");
        }
    }
}
