#!/bin/bash
# visqol.sh FOLDER: builds FOLDER/target/release/opinion, which prints for each two WAV files what ViSQOL (audio mode, crate audio_samples_qoe) predicts
# that people say of the second beside the first, 1 to 5: a judge from outside for conditions.py --opinion. No crate of the workspace needs it.
set -e
mkdir -p "$1/src"
cat > "$1/Cargo.toml" <<'END'
[package]
name = "opinion"
version = "0.1.0"
edition = "2024"

[dependencies]
audio_samples_io = { version = "=0.3.3", features = ["wav"] }
audio_samples_qoe = "=0.1.3"

[workspace]
END
cat > "$1/src/main.rs" <<'END'
use audio_samples_qoe::AudioSamplesQoE;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    for pair in files.chunks_exact(2) {
        let [reference, heard] = [&pair[0], &pair[1]].map(|file| audio_samples_io::read::<_, f32>(file));
        println!("{}", reference?.visqol(&heard?)?);
    }
    Ok(())
}
END
cargo build --release --manifest-path "$1/Cargo.toml" --target-dir "$1/target"
