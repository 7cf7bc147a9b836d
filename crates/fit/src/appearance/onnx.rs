//! What a network makes of photographs, from a file in the format ONNX.

use super::raster::Raster;
use crate::error::FitError;
use std::path::Path;
use std::sync::Arc;
use tract_onnx::prelude::{
    Datum, Framework, InferenceFact, InferenceModelExt, IntoRunnable, Tensor, TractResult, TypedRunnableModel, tract_ndarray,
    tvec,
};
use tract_onnx::tract_hir::infer::Factoid;
use tract_onnx::tract_hir::internal::DimLike;

/// Rows and columns of a picture whose size a network leaves open: whole patches of 14, 16 and 32 pixels.
const SIDE: usize = 448;
/// Rows and columns at most.
const MOST_SIDE: usize = 2048;
/// Mean and deviation of red, green and blue that pictures have for networks (ImageNet's, as most are trained).
const MEAN: [f32; 3] = [0.485, 0.456, 0.406];
const DEVIATION: [f32; 3] = [0.229, 0.224, 0.225];
/// Tokens at most before those of places: that of the class, and registers.
const MOST_BEFORE: usize = 16;

/// A network from a picture of 1 x 3 x rows x columns to numbers by place: 1 x numbers x rows x columns, or 1 x tokens x
/// numbers, where tokens are a square of places row by row and may have some before them that are of none.
#[derive(Debug)]
pub struct Network {
    model: Arc<TypedRunnableModel>,
    /// Rows and columns of its picture.
    rows: usize,
    columns: usize,
    file: String,
}

impl Network {
    /// Reads a file. Where a network leaves rows and columns open it is shown 448 of each.
    ///
    /// # Errors
    /// A file that cannot be read or is none, operators that are not known, an input that is no picture.
    pub fn load(path: &Path) -> Result<Self, FitError> {
        let file = path.display().to_string();
        let wrong = |found: String| FitError::argument("network", format!("one in the format ONNX in {file}"), found);
        let model = tract_onnx::onnx().model_for_path(path).map_err(|e| wrong(format!("{e:#}")))?;
        let fact = model.input_fact(0).map_err(|e| wrong(format!("{e:#}")))?;
        let dims: Vec<Option<usize>> = fact.shape.dims().map(|d| d.concretize().and_then(|d| d.to_usize().ok())).collect();
        let picture = |d: &[Option<usize>]| d.len() == 4 && d[0].is_none_or(|n| n == 1) && d[1].is_none_or(|n| n == 3);
        if model.inputs.len() != 1 || !(picture(&dims) || dims.is_empty()) {
            let found = format!("{} inputs, the first of {dims:?}", model.inputs.len());
            return Err(FitError::argument("input of a network", format!("one of 1 x 3 x rows x columns in {file}"), found));
        }
        let side = |a: usize| dims.get(a).copied().flatten().unwrap_or(SIDE);
        let (rows, columns) = (side(2), side(3));
        if !(1..=MOST_SIDE).contains(&rows) || !(1..=MOST_SIDE).contains(&columns) {
            let found = format!("{rows} x {columns}");
            return Err(FitError::argument(
                "picture of a network",
                format!("1 to {MOST_SIDE} rows and columns in {file}"),
                found,
            ));
        }
        let ready = || -> TractResult<Arc<TypedRunnableModel>> {
            let shown = InferenceFact::dt_shape(f32::datum_type(), [1, 3, rows, columns]);
            model.with_input_fact(0, shown)?.into_optimized()?.into_runnable()
        };
        let model = ready().map_err(|e| wrong(format!("{e:#}")))?;
        Ok(Self { model, rows, columns, file })
    }

    /// What it makes of a photograph, by place.
    ///
    /// # Errors
    /// An output that is of no places, or not finite.
    pub fn of(&self, photo: &Raster) -> Result<Raster, FitError> {
        let wrong = |found: String| {
            let expected = format!("1 x numbers x rows x columns, or 1 x tokens x numbers, finite, from {}", self.file);
            FitError::argument("output of a network", expected, found)
        };
        let shown = photo.resized([self.columns, self.rows]);
        let value = |(_, c, y, x): (usize, usize, usize, usize)| {
            (shown.values[(y * self.columns + x) * photo.channels + c] - MEAN[c]) / DEVIATION[c]
        };
        let input: Tensor = tract_ndarray::Array4::from_shape_fn((1, 3, self.rows, self.columns), value).into();
        let out = self.model.run(tvec!(input.into())).map_err(|e| wrong(format!("{e:#}")))?;
        let first = out.first().ok_or_else(|| wrong("none".to_owned()))?;
        let view = first.to_plain_array_view::<f32>().map_err(|e| wrong(format!("{e:#}")))?;
        let all: Vec<f32> = view.iter().copied().collect();
        if !all.iter().all(|v| v.is_finite()) {
            return Err(wrong("numbers that are not finite".to_owned()));
        }
        match *view.shape() {
            [1, channels, rows, columns] => {
                let at = |i: usize, c: usize| all[c * rows * columns + i];
                let values = (0..rows * columns).flat_map(|i| (0..channels).map(move |c| at(i, c))).collect();
                Raster::new([columns, rows], channels, values)
            }
            [1, tokens, channels] => {
                let square = |before: &usize| tokens.checked_sub(*before).is_some_and(|n| n > 0 && n.isqrt().pow(2) == n);
                let before = (0..=MOST_BEFORE).find(square).ok_or_else(|| wrong(format!("{tokens} tokens, no square")))?;
                let side = (tokens - before).isqrt();
                Raster::new([side; 2], channels, all[before * channels..].to_vec())
            }
            ref other => Err(wrong(format!("{other:?}"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A field of a message in protobuf, with a length before it.
    fn part(number: u8, bytes: &[u8]) -> Vec<u8> {
        let mut length = bytes.len();
        let mut out = vec![number << 3 | 2];
        while length > 127 {
            out.push((length % 128) as u8 | 128);
            length /= 128;
        }
        out.push(length as u8);
        [out, bytes.to_vec()].concat()
    }

    /// A small whole number.
    fn number(field: u8, value: u8) -> Vec<u8> {
        vec![field << 3, value]
    }

    /// A value of floats: its name, and its sides; those that are open have a name.
    fn value(name: &str, sides: &[Result<u8, &str>]) -> Vec<u8> {
        let side = |s: &Result<u8, &str>| part(1, &s.map_or_else(|name| part(2, name.as_bytes()), |n| number(1, n)));
        let shape: Vec<u8> = sides.iter().flat_map(side).collect();
        let tensor = [number(1, 1), part(2, &shape)].concat();
        [part(1, name.as_bytes()), part(2, &part(1, &tensor))].concat()
    }

    /// A network that says for each 8 x 8 pixels the mean of red, and blue less green: a convolution of 1 x 1, then means; as
    /// tokens, if asked, in which places are one side.
    fn network(sides: [Result<u8, &str>; 2], tokens: bool) -> Vec<u8> {
        let ints = |name: &str, all: &[u8]| {
            let all: Vec<u8> = all.iter().flat_map(|v| number(8, *v)).collect();
            // Of the kind of whole numbers, 7, in field 20.
            part(5, &[part(1, name.as_bytes()), all, vec![0xA0, 1, 7]].concat())
        };
        let node = |kind: &str, inputs: &[&str], output: &str, attributes: Vec<u8>| {
            let inputs: Vec<u8> = inputs.iter().flat_map(|i| part(1, i.as_bytes())).collect();
            part(1, &[inputs, part(2, output.as_bytes()), part(4, kind.as_bytes()), attributes].concat())
        };
        let weights: Vec<u8> = [1.0_f32, 0.0, 0.0, 0.0, -1.0, 1.0].iter().flat_map(|w| w.to_le_bytes()).collect();
        let dims: Vec<u8> = [2, 3, 1, 1].iter().flat_map(|d| number(1, *d)).collect();
        let initial = part(5, &[dims, number(2, 1), part(8, b"w"), part(9, &weights)].concat());
        let mut nodes = node("Conv", &["x", "w"], "c", Vec::new());
        nodes.extend(node("AveragePool", &["c"], "p", [ints("kernel_shape", &[8, 8]), ints("strides", &[8, 8])].concat()));
        if tokens {
            // 1 x 2 x 4 x 4 -> 1 x 2 x 16 -> 1 x 16 x 2.
            let shape: Vec<u8> = [1_i64, 2, -1].iter().flat_map(|v| v.to_le_bytes()).collect();
            nodes.extend(part(5, &[number(1, 3), number(2, 7), part(8, b"s"), part(9, &shape)].concat()));
            nodes.extend(node("Reshape", &["p", "s"], "f", Vec::new()));
            nodes.extend(node("Transpose", &["f"], "y", ints("perm", &[0, 2, 1])));
        }
        let out = if tokens { "y" } else { "p" };
        let graph = [
            nodes,
            part(2, b"g"),
            initial,
            part(11, &value("x", &[Ok(1), Ok(3), sides[0], sides[1]])),
            part(12, &value(out, &vec![Err("a"); if tokens { 3 } else { 4 }])),
        ];
        [number(1, 8), part(8, &number(2, 13)), part(7, &graph.concat())].concat()
    }

    #[test]
    fn a_network_says_what_it_makes_of_each_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("small.onnx");
        // Red above, blue below.
        let values: Vec<f32> = (0..64 * 64).flat_map(|i| if i < 64 * 32 { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] }).collect();
        let photo = Raster::new([64, 64], 3, values).unwrap();
        let shown = |v: f32, c: usize| (v - MEAN[c]) / DEVIATION[c];
        for (sides, tokens, size) in
            [([Ok(32), Ok(32)], false, 4), ([Ok(32), Ok(32)], true, 4), ([Err("h"), Err("w")], false, 56)]
        {
            std::fs::write(&path, network(sides, tokens)).unwrap();
            let made = Network::load(&path).unwrap().of(&photo).unwrap();
            assert_eq!((made.size, made.channels), ([size; 2], 2));
            let (first, last) = (&made.values[..2], &made.values[made.values.len() - 2..]);
            let expected = [[shown(1.0, 0), shown(0.0, 2) - shown(0.0, 1)], [shown(0.0, 0), shown(1.0, 2) - shown(0.0, 1)]];
            for (found, expected) in [first, last].into_iter().zip(expected) {
                assert!(found.iter().zip(expected).all(|(f, e)| (f - e).abs() < 1e-4), "{found:?} {expected:?}");
            }
        }
        let whole = network([Ok(32), Ok(32)], false);
        for wrong in [&whole[..whole.len() / 2], b"no network", &network([Ok(0), Ok(32)], false)] {
            std::fs::write(&path, wrong).unwrap();
            assert!(Network::load(&path).is_err());
        }
        assert!(Network::load(&folder.path().join("nowhere.onnx")).is_err());
    }
}
