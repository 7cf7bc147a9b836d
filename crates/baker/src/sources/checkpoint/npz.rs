//! Arrays of floats from NumPy's .npz: a zip archive of .npy files (numpy.lib.format, versions 1 to 3).

use super::float::Float;
use crate::BakeError;
use promenade_core::network::Tensor;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use zip::ZipArchive;

/// Bytes that one array may have.
const MAX_ARRAY_BYTES: u64 = 256 << 20;

/// Reads the arrays that are `wanted`, with the names of all.
pub(super) fn read(path: &Path, wanted: impl Fn(&str) -> bool) -> Result<(BTreeMap<String, Tensor>, Vec<String>), BakeError> {
    let unreadable = |e: zip::result::ZipError| BakeError::unreadable(path, ".npz file", e);
    let file = File::open(path).map_err(BakeError::read(path))?;
    let mut archive = ZipArchive::new(BufReader::new(file)).map_err(unreadable)?;
    let files = archive.file_names().flatten();
    let mut names: Vec<String> = files.filter_map(|n| n.strip_suffix(".npy").map(str::to_owned)).collect();
    names.sort();
    let mut arrays = BTreeMap::new();
    for name in names.iter().filter(|n| wanted(n)) {
        let entry = archive.by_name(&format!("{name}.npy")).map_err(unreadable)?;
        let mut bytes = Vec::new();
        entry.take(MAX_ARRAY_BYTES + 1).read_to_end(&mut bytes).map_err(|e| unreadable(e.into()))?;
        let wrong =
            |found: String| BakeError::entry(path, format!("array '{name}'"), "rows of floats as NumPy saves them", found);
        if bytes.len() as u64 > MAX_ARRAY_BYTES {
            return Err(wrong(format!("more than {MAX_ARRAY_BYTES} bytes")));
        }
        arrays.insert(name.clone(), array(&bytes).map_err(wrong)?);
    }
    Ok((arrays, names))
}

/// One .npy file; says what is wrong with it otherwise.
pub(crate) fn array(bytes: &[u8]) -> Result<Tensor, String> {
    let damaged = || "a damaged header".to_owned();
    let rest = bytes.strip_prefix(b"\x93NUMPY").ok_or_else(damaged)?;
    let (len, rest) = match rest {
        [1, _, a, b, rest @ ..] => (usize::from(u16::from_le_bytes([*a, *b])), rest),
        [2 | 3, _, a, b, c, d, rest @ ..] => (u32::from_le_bytes([*a, *b, *c, *d]) as usize, rest),
        _ => return Err(damaged()),
    };
    let (header, data) = rest.split_at_checked(len).ok_or_else(damaged)?;
    let header = std::str::from_utf8(header).map_err(|_| damaged())?;
    // The header is a Python dictionary of which NumPy writes exactly these three entries.
    let entry = |key: &str| header.split_once(&format!("'{key}':")).map(|(_, value)| value.trim_start()).ok_or_else(damaged);
    let float = match entry("descr")?.strip_prefix('\'').and_then(|d| d.split_once('\'')) {
        Some(("<f8", _)) => Float::F64,
        Some(("<f4", _)) => Float::F32,
        Some(("<f2", _)) => Float::F16,
        Some((other, _)) => return Err(format!("elements of type '{other}'")),
        None => return Err("elements of a compound type".to_owned()),
    };
    let by_columns = entry("fortran_order")?.starts_with("True");
    let sizes = entry("shape")?.strip_prefix('(').and_then(|s| s.split_once(')')).ok_or_else(damaged)?.0;
    let sizes = sizes.split(',').map(str::trim).filter(|s| !s.is_empty());
    let shape: Vec<usize> = sizes.map(str::parse).collect::<Result<_, _>>().map_err(|_| damaged())?;
    let count = shape.iter().try_fold(float.size(), |n, s| n.checked_mul(*s));
    if count != Some(data.len()) {
        return Err(format!("the shape {shape:?} with {} bytes", data.len()));
    }
    let values = float.values(data);
    match shape[..] {
        [rows, columns] if by_columns => {
            let values = (0..rows).flat_map(|r| (0..columns).map(move |c| c * rows + r)).map(|i| values[i]).collect();
            Ok(Tensor { shape, values })
        }
        [_, _, _, ..] if by_columns => Err(format!("the shape {shape:?} with the first index fastest")),
        _ => Ok(Tensor { shape, values }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn npy(header: &str, data: &[u8]) -> Vec<u8> {
        let len = u16::try_from(header.len()).unwrap().to_le_bytes();
        [b"\x93NUMPY\x01\x00".as_slice(), &len, header.as_bytes(), data].concat()
    }

    fn floats(values: &[f32]) -> Vec<u8> {
        values.iter().flat_map(|v| v.to_le_bytes()).collect()
    }

    #[test]
    fn rows_and_columns_keep_their_places() {
        let data = floats(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        let by_rows = array(&npy("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }\n", &data)).unwrap();
        assert_eq!((by_rows.shape, by_rows.values), (vec![2, 3], vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0]));
        let by_columns = array(&npy("{'descr': '<f4', 'fortran_order': True, 'shape': (2, 3), }\n", &data)).unwrap();
        assert_eq!((by_columns.shape, by_columns.values), (vec![2, 3], vec![0.0, 2.0, 4.0, 1.0, 3.0, 5.0]));
    }

    #[test]
    fn wrong_arrays_are_errors() {
        let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2,), }\n";
        let good = npy(header, &floats(&[1.0, 2.0]));
        assert!(array(&good).is_ok());
        for len in 0..good.len() {
            assert!(array(&good[..len]).is_err(), "cut to {len} bytes");
        }
        for (from, to, says) in [
            ("<f4", "<i4", "'<i4'"),
            ("<f4", ">f4", "'>f4'"),
            ("(2,)", "(18446744073709551615, 4)", "18446744073709551615"),
            ("(2,)", "(3,)", "[3] with 8 bytes"),
            ("(2,)", "(-2,)", "header"),
            ("'<f4'", "[('x', '<f4')]", "compound"),
        ] {
            let found = array(&npy(&header.replace(from, to), &floats(&[1.0, 2.0]))).unwrap_err();
            assert!(found.contains(says), "{to}: {found}");
        }
    }
}
