//! The anchor-cloud decoders against golden vectors.

mod golden;

use promenade_core::cloud::CloudKind;

#[test]
fn weights_follow_from_their_names() {
    let Some(folder) = golden::folder() else { return };
    let bytes = std::fs::read(folder.join("weights_union.safetensors")).unwrap();
    let file = safetensors::SafeTensors::deserialize(&bytes).unwrap();
    for kind in CloudKind::ALL {
        for (name, tensor) in golden::weights(kind) {
            let stored = file.tensor(&name).unwrap();
            let found: Vec<f32> = stored.data().as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
            assert!(stored.shape() == tensor.shape && found == tensor.values, "{name}");
        }
    }
}
