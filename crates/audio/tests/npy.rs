//! NumPy's arrays: what is read, and what is refused.

use promenade_audio::npy::Array;

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
    let by_rows = Array::from_bytes(&npy("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }\n", &data)).unwrap();
    assert_eq!((by_rows.shape, by_rows.values), (vec![2, 3], vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0]));
    let by_columns = Array::from_bytes(&npy("{'descr': '<f4', 'fortran_order': True, 'shape': (2, 3), }\n", &data)).unwrap();
    assert_eq!((by_columns.shape, by_columns.values), (vec![2, 3], vec![0.0, 2.0, 4.0, 1.0, 3.0, 5.0]));
}

#[test]
fn wrong_arrays_are_errors() {
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2,), }\n";
    let good = npy(header, &floats(&[1.0, 2.0]));
    assert!(Array::from_bytes(&good).is_ok());
    for len in 0..good.len() {
        assert!(Array::from_bytes(&good[..len]).is_err(), "cut to {len} bytes");
    }
    for (from, to, says) in [
        ("<f4", "<i4", "'<i4'"),
        ("<f4", ">f4", "'>f4'"),
        ("(2,)", "(18446744073709551615, 4)", "18446744073709551615"),
        ("(2,)", "(3,)", "[3] with 8 bytes"),
        ("(2,)", "(-2,)", "header"),
        ("'<f4'", "[('x', '<f4')]", "compound"),
    ] {
        let found = Array::from_bytes(&npy(&header.replace(from, to), &floats(&[1.0, 2.0]))).unwrap_err();
        assert!(found.contains(says), "{to}: {found}");
    }
}
