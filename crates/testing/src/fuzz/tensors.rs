//! Scenes, and other files of tensors: their manifest, shapes and values, with the checksum of a scene made again.

use super::bytes::REAL;
use super::json;
use fastrand::Rng;
use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, TensorView};
use std::collections::HashMap;

struct Tensor {
    name: String,
    dtype: Dtype,
    shape: Vec<usize>,
    data: Vec<u8>,
}

/// A file with its metadata or a tensor changed; none if it is no file of tensors. Sizes fit, and so does a scene's checksum.
pub(super) fn changed(rng: &mut Rng, file: &[u8]) -> Option<Vec<u8>> {
    let (_, header) = SafeTensors::read_metadata(file).ok()?;
    let mut metadata = header.metadata().clone().unwrap_or_default();
    let all = SafeTensors::deserialize(file).ok()?.tensors();
    let tensor = |(name, view): (String, TensorView<'_>)| Tensor {
        name,
        dtype: view.dtype(),
        shape: view.shape().to_vec(),
        data: view.data().to_vec(),
    };
    let mut tensors: Vec<Tensor> = all.into_iter().map(tensor).collect();
    tensors.sort_by(|a, b| a.name.cmp(&b.name));
    let text = metadata.values_mut().next().filter(|_| rng.u8(0..5) < 2 || tensors.is_empty());
    if let Some(text) = text {
        *text = String::from_utf8(json::changed(rng, text.as_bytes())?).ok()?;
    } else if !tensors.is_empty() {
        let at = rng.usize(..tensors.len());
        match rng.u8(0..10) {
            0 => drop(tensors.remove(at)),
            1 => tensors[at].name.push('2'),
            2 => {
                let to = rng.usize(..tensors.len());
                let Tensor { dtype, shape, data, .. } = &tensors[to];
                let (dtype, shape, data) = (*dtype, shape.clone(), data.clone());
                tensors[at] = Tensor { name: tensors[at].name.clone(), dtype, shape, data };
            }
            3 | 4 => reshape(rng, &mut tensors[at]),
            _ => values(rng, &mut tensors[at]),
        }
    }
    written(tensors, metadata)
}

/// Another shape, with the values repeated as far as it takes.
fn reshape(rng: &mut Rng, tensor: &mut Tensor) {
    let size = tensor.dtype.bitsize() / 8;
    match rng.u8(0..4) {
        0 => tensor.shape.push(1),
        1 => drop(tensor.shape.pop()),
        2 if !tensor.shape.is_empty() => {
            let axis = rng.usize(..tensor.shape.len());
            tensor.shape[axis] =
                [0, 1, 2, 3, 1000, tensor.shape[axis] + 1, tensor.shape[axis].saturating_sub(1)][rng.usize(..7)];
        }
        _ => tensor.dtype = [Dtype::F16, Dtype::F32, Dtype::F64, Dtype::U8, Dtype::I32][rng.usize(..5)],
    }
    let size = if size > 0 { tensor.dtype.bitsize() / 8 } else { 1 };
    let length = (tensor.shape.iter().product::<usize>() * size).min(1 << 20);
    let old = if tensor.data.is_empty() { vec![0] } else { std::mem::take(&mut tensor.data) };
    tensor.data = old.into_iter().cycle().take(length).collect();
}

fn values(rng: &mut Rng, tensor: &mut Tensor) {
    let value = REAL[rng.usize(..REAL.len())];
    let whole = rng.u8(0..4) == 0;
    let digits = match tensor.dtype {
        Dtype::F32 => (value as f32).to_le_bytes().to_vec(),
        Dtype::F64 => value.to_le_bytes().to_vec(),
        Dtype::F16 => {
            [[0, 0], [0, 0x3c], [0, 0x7c], [0, 0xfc], [1, 0x7e], [0xff, 0x7b], [0xff, 0xfb], [1, 0]][rng.usize(..8)].to_vec()
        }
        _ => vec![rng.u8(..)],
    };
    let places = tensor.data.len() / digits.len();
    if places == 0 {
        return;
    }
    if whole {
        tensor.data.chunks_exact_mut(digits.len()).for_each(|to| to.copy_from_slice(&digits));
    }
    let at = rng.usize(..places) * digits.len();
    tensor.data[at..at + digits.len()].copy_from_slice(&digits);
}

fn written(mut tensors: Vec<Tensor>, metadata: HashMap<String, String>) -> Option<Vec<u8>> {
    if let Some(manifest) = metadata.get("promenade") {
        tensors.retain(|tensor| tensor.name != "crc32");
        // As the format's description has it, in the order of names.
        tensors.sort_by(|a, b| a.name.cmp(&b.name));
        let mut sum = crc32fast::Hasher::new();
        sum.update(manifest.as_bytes());
        for Tensor { name, shape, data, .. } in &tensors {
            sum.update(name.as_bytes());
            shape.iter().for_each(|size| sum.update(&(*size as u64).to_le_bytes()));
            sum.update(data);
        }
        let data = sum.finalize().to_le_bytes().to_vec();
        tensors.push(Tensor { name: "crc32".to_owned(), dtype: Dtype::U32, shape: vec![1], data });
    }
    // A name that is there twice is none that the writer takes.
    let names: std::collections::HashSet<&str> = tensors.iter().map(|tensor| &*tensor.name).collect();
    if names.len() < tensors.len() {
        return None;
    }
    let views = tensors.iter().map(|t| Some((&*t.name, TensorView::new(t.dtype, t.shape.clone(), &t.data).ok()?)));
    safetensors::serialize(views.collect::<Option<Vec<_>>>()?, Some(metadata)).ok()
}
