//! How a head that a tracker turns sounds.

use super::*;
use crate::library::factory;
use crate::parameter::choices::Follow;
use promenade_core::glam::{Quat, Vec3};
use promenade_core::{RenderParams, Renderer, Scene};
use promenade_metrics::tone_cleanliness;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

const RATE: f64 = 48_000.0;
const TONE_HZ: f64 = 1000.0;
const BLOCK: usize = 256;
const TRACKER_HZ: f64 = 50.0;
/// A head that turns by a quarter a second.
const TURN_PER_S: f64 = PI / 2.0;

/// The left ear of a head that a tracker turns before a tone; `smooth` as the plugin does it, else by the tracker's steps.
fn turned(smooth: bool) -> Vec<f32> {
    let scene = Arc::new(Scene::from_bytes(factory::ROOM_A.bytes).unwrap());
    let mut renderer = Renderer::new(scene, RATE).unwrap();
    let input = (0..3 * 48_000).map(|i| (0.5 * (TAU * TONE_HZ * f64::from(i) / RATE).sin()) as f32).collect::<Vec<_>>();
    let (mut left, mut right) = (vec![0.0; input.len()], [0.0; BLOCK]);
    let (mut glide, member) = (Glide::default(), Member::default());
    for (number, (chunk, left)) in input.chunks(BLOCK).zip(left.chunks_mut(BLOCK)).enumerate() {
        let start_s = (number * BLOCK) as f64 / RATE;
        // What has come in by the start of the block.
        let newest_s = (start_s * TRACKER_HZ).floor() / TRACKER_HZ;
        let tracked = Pose { position: Vec3::ZERO, orientation: Quat::from_rotation_z((newest_s * TURN_PER_S) as f32) };
        let mut listener = Listener {
            sources: Sources {
                knobs: Pose::IDENTITY,
                follow: Follow::Off,
                path_share: 0.0,
                offset: false,
                tracking: Tracking::Head,
            },
            from: None,
            length_s: BLOCK as f64 / RATE,
            walk: None,
            paths: SourcePaths::default(),
            tracked: Some(tracked),
            glide: &mut glide,
            following: None,
            leader: None,
            member: &member,
            start_s,
            sample_s: RATE.recip(),
            glided: Glided::default(),
        };
        let right = &mut right[..chunk.len()];
        renderer.process(&[chunk.into()], [left, right], RenderParams::default(), &mut |i| {
            if smooth { listener.pose(i) } else { tracked }
        });
        listener.pose(chunk.len());
    }
    left
}

/// Power of the steps, 25 to 190 Hz beside the tone, over that of the tone, dB; median over frames.
fn steps_db(samples: &[f32]) -> f64 {
    const FRAME: usize = 8192;
    let mut found = Vec::new();
    for frame in samples[24_000..].windows(FRAME).step_by(FRAME) {
        let (mut tone, mut beside) = (0.0, 0.0);
        for bin in 137..=205 {
            let turn = TAU * f64::from(bin) / FRAME as f64;
            let (mut re, mut im) = (0.0, 0.0);
            for (i, sample) in frame.iter().enumerate() {
                let windowed = f64::from(*sample) * (0.5 - 0.5 * (TAU * i as f64 / FRAME as f64).cos());
                let (sin, cos) = (turn * i as f64).sin_cos();
                (re, im) = (re + windowed * cos, im - windowed * sin);
            }
            let off_hz = (f64::from(bin) * RATE / FRAME as f64 - TONE_HZ).abs();
            let power = re * re + im * im;
            if off_hz <= 25.0 {
                tone += power;
            } else if off_hz <= 190.0 {
                beside += power;
            }
        }
        found.push(10.0 * (beside / tone).log10());
    }
    found.sort_by(f64::total_cmp);
    found[found.len() / 2]
}

#[test]
fn a_tracker_of_fifty_poses_a_second_turns_the_head_without_steps() {
    let (smooth, stepped) = (turned(true), turned(false));
    let clean = tone_cleanliness(&smooth, RATE, TONE_HZ).unwrap();
    assert!(clean.outside_median_db < -65.0 && clean.outside_worst_db < -50.0, "{clean:?}");
    // The room's own noise beside the tone is at -45 dB.
    let (smooth, stepped) = (steps_db(&smooth), steps_db(&stepped));
    assert!(smooth < stepped - 2.0, "{smooth:.1} dB, with the tracker's steps {stepped:.1} dB");
}
