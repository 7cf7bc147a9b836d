//! The baselines learn, go on after a stop, and shares of the benchmark's runs make one table.

use crate::baselines::layers::Graph;
use crate::baselines::{AvNerf, Baseline, Course, Heard, Inras, Learner, Naf, spectrogram};
use crate::house::{DEFAULT_MATERIALS, ROOMS, Room};
use crate::runs::{Found, METHODS, Run, share, table};
use promenade_baker::BakeError;
use promenade_baker::capture::{Capture, Clip, Emitter, Split, Track, Voice};
use promenade_baker::evaluate::Figures;
use promenade_core::glam::Vec3;
use promenade_core::random::Random;
use promenade_core::{CameraPath, Keyframe, Pose};
use promenade_trainer::Device;
use std::collections::BTreeMap;
use std::path::Path;

const RATE: usize = 8000;
const BOUNDS: [Vec3; 2] = [Vec3::ZERO, Vec3::new(4.0, 3.0, 2.5)];

/// Clips of a listener who turns and walks about two emitters: softer far away, louder at the ear that an emitter is on.
fn capture() -> Capture {
    let mut random = Random::new(3);
    let emitters = [Vec3::new(0.5, 0.5, 1.5), Vec3::new(3.5, 2.0, 1.5)];
    let (mut tracks, mut clips) = (Vec::new(), Vec::new());
    for i in 0..24_usize {
        let number = i % 2;
        let place = Vec3::new(0.4 + 3.2 * random.uniform(), 0.4 + 2.2 * random.uniform(), 1.5);
        let pose = Pose::from_ypr(place, 6.0 * random.uniform(), 0.0, 0.0);
        let dry: Vec<f32> = (0..RATE / 4).map(|_| 0.3 * random.normal()).collect();
        let seen = pose.to_head(emitters[number]);
        let gain = 0.8 / seen.length().max(0.3);
        let side = 0.6 * seen.normalize().y;
        let binaural = [1.0 + side, 1.0 - side].map(|ear| dry.iter().map(|x| gain * ear * x).collect::<Vec<f32>>());
        let (name, split) = (format!("{i}"), if i % 8 >= 6 { Split::Test } else { Split::Train });
        clips.push(Clip { name: name.clone(), track: i, start: 0, len: dry.len(), pose, split });
        let path = CameraPath::new(vec![Keyframe { t_s: 0.0, pose }]).unwrap();
        tracks.push(Track { name, voices: vec![Voice { emitter: Some(number), dry }], binaural, path });
    }
    let named = |(i, at): (usize, &Vec3)| Emitter { name: format!("{i}"), ..Emitter::at(*at) };
    let emitters = emitters.iter().enumerate().map(named).collect();
    Capture { sample_rate_hz: RATE as f64, emitters, tracks, clips, ..Capture::default() }
}

fn baselines() -> [Box<dyn Baseline>; 3] {
    let (bounds, bins) = (BOUNDS, spectrogram::BINS);
    let mut random = Random::new(9);
    let points = (0..40).map(|_| bounds[1] * Vec3::new(random.uniform(), random.uniform(), random.uniform())).collect();
    [Box::new(Naf { bounds, bins }), Box::new(Inras { points, bounds, bins }), Box::new(AvNerf { bounds, bins })]
}

fn course(steps: usize) -> Course {
    Course { steps, seed: 2, keep_every: 4 }
}

#[test]
fn every_baseline_learns_a_made_room_and_is_heard() {
    let capture = capture();
    let folder = tempfile::tempdir().unwrap();
    for (i, baseline) in baselines().iter().enumerate() {
        let kept = folder.path().join(i.to_string());
        let train = |until: usize| Learner::train(&**baseline, &capture, &course(24), &kept, until).unwrap();
        let [first, last] = [train(0), train(24)].map(|learner| learner.mean_loss(&capture, Split::Train));
        assert!(last < 0.7 * first, "{}: a loss of {first} became {last}", baseline.name());
        let learner = train(24);
        let clip = capture.split(Split::Train).next().unwrap();
        let ears = learner.ears(&capture, clip).unwrap();
        assert!(ears.iter().all(|ear| ear.len() == clip.len && ear.iter().any(|x| x.abs() > 1e-3)), "{}", baseline.name());
    }
}

#[test]
fn gains_are_by_listener_and_bin_and_change_with_all_that_is_told() {
    let pose = |x: f32, yaw: f32| Pose::from_ypr(Vec3::new(x, 1.0, 1.5), yaw, 0.0, 0.0);
    let heard = |listener: Pose, y: f32| Heard { listener, emitter: Vec3::new(3.0, y, 1.5) };
    let all = [heard(pose(1.0, 0.3), 1.0), heard(pose(2.0, 0.3), 1.0), heard(pose(1.0, 2.0), 1.0), heard(pose(1.0, 0.3), 2.5)];
    for baseline in &baselines() {
        let gains = baseline.gains(&Graph::new(&baseline.start(1), &Device::flex().autodiff()), &all);
        let rows = gains.map(|ear| {
            assert_eq!(ear.dims(), [all.len(), spectrogram::BINS], "{}", baseline.name());
            let numbers = ear.into_data().try_into_vec::<f32>().unwrap();
            numbers.chunks(spectrogram::BINS).map(<[f32]>::to_vec).collect::<Vec<_>>()
        });
        for ear in &rows {
            assert!(ear.iter().flatten().all(|gain| gain.is_finite()));
            (1..all.len()).for_each(|i| assert_ne!(ear[0], ear[i], "{}: listener {i}", baseline.name()));
        }
    }
}

#[test]
fn gains_of_one_are_the_sound_itself() {
    let mut random = Random::new(1);
    let x: Vec<f32> = (0..3000).map(|_| random.normal()).collect();
    let same = spectrogram::with_gains(&x, &[1.0; spectrogram::BINS]);
    // At the ends too few windows overlap.
    let inside = spectrogram::N_FFT..x.len() - spectrogram::N_FFT;
    let worst = inside.map(|i| (x[i] - same[i]).abs()).fold(0.0, f32::max);
    assert!(same.len() == x.len() && worst < 1e-4, "{worst}");
    let frames = spectrogram::magnitudes(&x);
    assert!(frames.len() == x.len() / spectrogram::HOP + 1 && frames.iter().all(|f| f.len() == spectrogram::BINS));
}

#[test]
fn a_baseline_that_was_stopped_goes_on_and_another_is_refused() {
    let capture = capture();
    let folder = tempfile::tempdir().unwrap();
    let [naf, inras, _] = baselines();
    let file = |name: &str| folder.path().join(name);
    let whole = Learner::train(&*inras, &capture, &course(10), &file("whole"), 10).unwrap();
    // Stopped after six steps, of which four were kept.
    Learner::train(&*inras, &capture, &course(10), &file("parts"), 6).unwrap();
    let parts = Learner::train(&*inras, &capture, &course(10), &file("parts"), 10).unwrap();
    assert_eq!((parts.steps(), parts.weights()), (10, whole.weights()));
    let refused = Learner::train(&*naf, &capture, &course(10), &file("parts"), 10).err().unwrap().to_string();
    assert!(refused.contains("parts") && refused.contains("NAF"), "{refused}");
}

/// Runs what shares ask for: a training of a few steps for each run of INRAS, silence else.
fn work(capture: &Capture, runs: &[Run], parts: &[usize], folder: &Path) {
    let [_, inras, _] = baselines();
    for part in parts {
        for run in share(runs, *part, parts.len()) {
            let found = || -> Result<Found, BakeError> {
                let kept = folder.join(run.name());
                let course = Course { seed: run.seed, ..course(6) };
                let learner = Learner::train(&*inras, capture, &course, &kept, 6)?;
                let ears = |clip: &Clip| if run.method == "inras" { learner.ears(capture, clip) } else { None };
                let of = |clip: &Clip| {
                    let [left, right] = ears(clip).unwrap_or_else(|| [vec![0.0; clip.len], vec![0.0; clip.len]]);
                    Figures::of([&left, &right], capture.binaural(clip), None, capture.sample_rate_hz)
                };
                let all: Vec<Figures> = capture.split(Split::Test).map(of).collect();
                Ok(Found::new(&Figures::mean(all.iter()), 1.0))
            };
            run.once(folder, found).unwrap();
        }
    }
}

#[test]
fn shares_of_which_one_was_killed_make_the_table_of_one_run() {
    let capture = capture();
    let (one, shared) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let methods = ["mono", "inras"].map(str::to_owned);
    let runs = Run::all(&["office".to_owned()], 2, 2, &methods);
    assert_eq!(runs.len(), 6);
    work(&capture, &runs, &[1], one.path());
    // One share got as far as the checkpoint of its second run.
    let [_, inras, _] = baselines();
    let killed = share(&runs, 2, 3).nth(1).unwrap();
    Learner::train(&*inras, &capture, &Course { seed: killed.seed, ..course(6) }, &shared.path().join(killed.name()), 5)
        .unwrap();
    work(&capture, &runs, &[3, 1, 2], shared.path());
    let [[whole, _], [parts, times]] = [&one, &shared].map(|folder| table(&runs, folder.path()).unwrap());
    assert_eq!(whole, parts);
    assert!(whole.contains("| office | inras | ") && whole.contains('±') && times.contains("| 1.0 |"), "{whole}{times}");
    std::fs::remove_file(killed.result(shared.path())).unwrap();
    let [missing, _] = table(&runs, shared.path()).unwrap();
    assert!(missing.contains("inras (1 of 4 runs missing)"), "{missing}");
    assert!(methods.iter().all(|method| METHODS.contains(&method.as_str())));
}

#[test]
fn made_rooms_and_their_scans_are_closed_and_hold_walk_and_emitters() {
    for room in &ROOMS {
        for text in [room.mesh(), room.scan(7)] {
            let mut edges: BTreeMap<(usize, usize), i32> = BTreeMap::new();
            for line in text.lines().filter_map(|line| line.strip_prefix("f ")) {
                let corners: Vec<usize> = line.split(' ').map(|n| n.parse().unwrap()).collect();
                for (i, from) in corners.iter().enumerate() {
                    *edges.entry((*from, corners[(i + 1) % corners.len()])).or_default() += 1;
                }
            }
            assert!(edges.len() > 60);
            for ((from, to), count) in &edges {
                assert_eq!(edges.get(&(*to, *from)), Some(count), "{}: the edge {from} {to}", room.name);
            }
        }
        let [low, high] = room.bounds();
        let walked = room.walk();
        let rows =
            walked.lines().skip(1).map(|row| row.split(',').skip(1).take(3).map(|n| n.parse().unwrap()).collect::<Vec<f32>>());
        for at in rows.map(|at| Vec3::from_slice(&at)).chain(room.emitters.map(Vec3::from)) {
            assert!(at.cmpgt(low).all() && at.cmplt(high).all(), "{}: {at}", room.name);
        }
        assert_eq!(room.points(64, 1).len(), 64);
        assert!(Room::named(room.name).is_some() && room.materials.contains("wall=") && DEFAULT_MATERIALS.contains('*'));
        assert_ne!(room.scan(7), room.scan(8));
    }
}
