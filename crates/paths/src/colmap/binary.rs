//! `images.bin`: the same as `images.txt`, little endian.

use super::{Image, image};
use crate::PathFileError;
use promenade_core::MAX_KEYFRAMES;

/// Id, pose, camera, an empty name and the count of no points.
const LEAST_BYTES: usize = 4 + 7 * 8 + 4 + 1 + 8;
/// Two coordinates and the id of a point.
const POINT_BYTES: usize = 24;

/// What is left of the file.
pub(super) struct Rest<'a> {
    pub(super) file: &'a str,
    /// Its whole length.
    pub(super) length: usize,
    pub(super) bytes: &'a [u8],
}

impl<'a> Rest<'a> {
    fn take(&mut self, count: usize, what: &str) -> Result<&'a [u8], PathFileError> {
        let Some((taken, left)) = self.bytes.split_at_checked(count) else {
            let found = format!("{} bytes to the end", self.bytes.len());
            return Err(PathFileError::entry(self.file, self.place(), format!("{count} bytes of {what}"), found));
        };
        self.bytes = left;
        Ok(taken)
    }

    pub(super) fn array<const N: usize>(&mut self, what: &str) -> Result<[u8; N], PathFileError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N, what)?);
        Ok(array)
    }

    pub(super) fn place(&self) -> String {
        format!("byte {}", self.length - self.bytes.len())
    }
}

pub(super) fn read(file: &str, bytes: &[u8]) -> Result<Vec<Image>, PathFileError> {
    let mut rest = Rest { file, length: bytes.len(), bytes };
    let count = u64::from_le_bytes(rest.array("the count of images")?);
    let most = MAX_KEYFRAMES.min(rest.bytes.len() / LEAST_BYTES);
    let Some(count) = usize::try_from(count).ok().filter(|c| *c <= most) else {
        let expected = format!("at most {most} images in {} bytes", bytes.len());
        return Err(PathFileError::entry(file, "byte 0", expected, count.to_string()));
    };
    let mut images = Vec::with_capacity(count);
    for _ in 0..count {
        let start = rest.place();
        let id = u32::from_le_bytes(rest.array("an image's id")?);
        let mut pose = [0.0; 7];
        for value in &mut pose {
            *value = f64::from_le_bytes(rest.array("a pose")?);
        }
        let camera = u32::from_le_bytes(rest.array("a camera's id")?);
        let end = rest.bytes.iter().position(|b| *b == 0);
        let end = end.ok_or_else(|| PathFileError::entry(file, rest.place(), "a name that ends in a zero byte", "none"))?;
        let name = String::from_utf8_lossy(rest.take(end, "a name")?).into_owned();
        rest.take(1, "a name's end")?;
        let points = u64::from_le_bytes(rest.array("the count of points")?);
        let length = usize::try_from(points).ok().and_then(|n| n.checked_mul(POINT_BYTES)).unwrap_or(usize::MAX);
        rest.take(length, "points")?;
        images.push(image(file, &format!("image {name} at {start}"), name.clone(), [id, camera], pose)?);
    }
    if !rest.bytes.is_empty() {
        let found = format!("{} bytes more", rest.bytes.len());
        return Err(PathFileError::entry(file, rest.place(), format!("the end after {count} images"), found));
    }
    Ok(images)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(poses: &[[f64; 7]]) -> Vec<u8> {
        let mut bytes = (poses.len() as u64).to_le_bytes().to_vec();
        for (id, pose) in poses.iter().enumerate() {
            bytes.extend((id as u32).to_le_bytes());
            bytes.extend(pose.iter().flat_map(|v| v.to_le_bytes()));
            bytes.extend(3_u32.to_le_bytes());
            bytes.extend(format!("{id}.jpg\0").as_bytes());
            bytes.extend(1_u64.to_le_bytes());
            bytes.extend([0; POINT_BYTES]);
        }
        bytes
    }

    #[test]
    fn points_are_passed_over() {
        let images =
            read("images.bin", &bytes(&[[1.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 0.0, 0.0, 4.0, 5.0, 6.0]])).unwrap();
        assert_eq!((images[1].name.as_str(), images[1].camera, images[1].translation.x), ("1.jpg", 3, 4.0));
        assert_eq!(images.len(), 2);
    }

    #[test]
    fn errors_name_the_byte() {
        let whole = bytes(&[[1.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0]]);
        let fails = |bytes: &[u8]| read("images.bin", bytes).unwrap_err().to_string();
        assert!(fails(&[&whole[..], &[1]].concat()).contains("expected the end after 1 images, found 1 bytes more"));
        assert!(fails(&whole[..whole.len() - 1]).contains("expected 24 bytes of points, found 23 bytes to the end"));
        let mut many = whole.clone();
        many[7] = 0x7f;
        assert!(fails(&many).contains("byte 0: expected at most 1 images"), "{}", fails(&many));
        let mut endless = whole.clone();
        let at = whole.len() - POINT_BYTES - 1;
        endless[at] = 0xff;
        assert!(fails(&endless).contains("bytes of points"));
        assert!(
            fails(&bytes(&[[3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]])).contains("image 0.jpg at byte 8: expected a unit quaternion")
        );
        assert!(fails(&bytes(&[[1.0, 0.0, 0.0, 0.0, f64::NAN, 0.0, 0.0]])).contains("a finite translation"));
    }
}
