//! Heads from SOFA files: grids, rates, delays, and everything that is no head.

use hdf5_pure::{AttrValue, FileBuilder};
use promenade_core::Head;
use promenade_core::glam::Vec3;
use promenade_sofa::read_head;
use std::path::Path;

const RADIUS_M: f64 = 0.0875;
const SPEED_M_S: f64 = 343.0;

/// A set of a sphere that only delays, and is 6 dB softer on the far side.
#[derive(Clone)]
struct Set {
    /// Azimuth and elevation, degrees.
    directions: Vec<(f64, f64)>,
    /// More of them, a fifth as far away and with the ears exchanged, as no head has it.
    near: Vec<(f64, f64)>,
    rate_hz: f64,
    /// Whether the delays are beside the responses.
    beside: bool,
    /// Receivers, of which the first is the left ear unless `right_first`.
    receivers: usize,
    right_first: bool,
    /// What the set says, whatever is in it.
    data_type: &'static str,
    /// Which response is silent, or has a sample that is no number.
    silent: Option<usize>,
    broken: Option<usize>,
}

impl Set {
    fn of(directions: Vec<(f64, f64)>) -> Self {
        Self {
            directions,
            near: Vec::new(),
            rate_hz: 48_000.0,
            beside: false,
            receivers: 2,
            right_first: false,
            data_type: "FIR",
            silent: None,
            broken: None,
        }
    }

    fn write(&self, path: &Path) {
        const FRAMES: usize = 192;
        let mut file = FileBuilder::new();
        let text = |t: &str| AttrValue::AsciiString(t.to_owned());
        for (name, value) in [("SOFAConventions", "SimpleFreeFieldHRIR"), ("DataType", self.data_type), ("Title", "Sphere")] {
            file.set_attr(name, text(value));
        }
        let far = self.directions.iter().map(|direction| (*direction, 1.5));
        let all: Vec<_> = far.chain(self.near.iter().map(|direction| (*direction, 0.3))).collect();
        let count = all.len() as u64;
        let positions: Vec<f64> =
            all.iter().flat_map(|((azimuth, elevation), distance)| [*azimuth, *elevation, *distance]).collect();
        let spherical = file.create_dataset("SourcePosition");
        spherical.with_f64_data(&positions).with_shape(&[count, 3]).set_attr("Type", text("spherical"));
        file.create_dataset("ListenerPosition")
            .with_f64_data(&[0.0; 3])
            .with_shape(&[1, 3])
            .set_attr("Type", text("cartesian"));
        let side = if self.right_first { -0.09 } else { 0.09 };
        let receivers: Vec<f64> = [0.0, side, 0.0, 0.0, -side, 0.0][..3 * self.receivers].to_vec();
        let ears = file.create_dataset("ReceiverPosition");
        ears.with_f64_data(&receivers).with_shape(&[self.receivers as u64, 3, 1]).set_attr("Type", text("cartesian"));
        file.create_dataset("Data.SamplingRate").with_f64_data(&[self.rate_hz]).with_shape(&[1]);
        let (mut samples, mut delays) = (Vec::new(), Vec::new());
        for (m, ((azimuth, elevation), distance)) in all.iter().enumerate() {
            let side = if *distance < 1.0 { -1.0 } else { 1.0 };
            let y = side * azimuth.to_radians().sin() * elevation.to_radians().cos();
            for receiver in 0..self.receivers {
                let to_ear = if (receiver == 0) == self.right_first { -y } else { y };
                let angle = to_ear.clamp(-1.0, 1.0).acos();
                let half = std::f64::consts::FRAC_PI_2;
                let way = if angle < half { -angle.cos() } else { angle - half };
                let late = 40.0 + way * RADIUS_M / SPEED_M_S * self.rate_hz;
                let whole = if self.beside { late.floor() } else { 0.0 };
                delays.push(whole);
                let gain = if self.silent == Some(m) { 0.0 } else { 0.75 + 0.25 * to_ear };
                let pulse = (0..FRAMES).map(|i| gain * (-0.5 * ((i as f64 - 20.0 - (late - whole)) / 1.2).powi(2)).exp());
                samples.extend(pulse);
                if self.broken == Some(m) {
                    *samples.last_mut().unwrap() = f64::NAN;
                }
            }
        }
        let receivers = self.receivers as u64;
        if self.beside {
            file.create_dataset("Data.Delay").with_f64_data(&delays).with_shape(&[count, receivers]);
        }
        file.create_dataset("Data.IR").with_f64_data(&samples).with_shape(&[count, receivers, FRAMES as u64]);
        file.write(path).unwrap();
    }

    fn read(&self) -> Result<Head, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("head.sofa");
        self.write(&path);
        read_head(&path).map_err(|error| chain(&error))
    }

    fn refused(&self, clue: &str) {
        let error = self.read().unwrap_err();
        assert!(error.contains("head.sofa") && error.contains(clue), "{error}");
    }
}

fn chain(error: &dyn std::error::Error) -> String {
    error.source().map_or_else(|| error.to_string(), |cause| format!("{error}: {}", chain(cause)))
}

/// Azimuths every 15 degrees at some elevations.
fn grid(elevations: &[f64], azimuths: impl Fn(f64) -> bool) -> Vec<(f64, f64)> {
    let at = |elevation: f64| (0..24).map(move |i| (15.0 * f64::from(i), elevation));
    elevations.iter().flat_map(|elevation| at(*elevation)).filter(|(azimuth, _)| azimuths(*azimuth)).collect()
}

fn itd_s(head: &Head, azimuth_deg: f32, elevation_deg: f32) -> f64 {
    let (azimuth, elevation) = (azimuth_deg.to_radians(), elevation_deg.to_radians());
    let direction = Vec3::new(azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin());
    head.ears(direction).itd_s().into()
}

/// Woodworth's delay of the left ear for a sine of the lateral angle.
fn wanted_s(y: f64) -> f64 {
    -(y + y.asin()) * RADIUS_M / SPEED_M_S
}

#[test]
fn any_rate_and_delays_beside_the_responses_are_the_same_head() {
    for rate_hz in [44_100.0, 48_000.0, 96_000.0] {
        for beside in [false, true] {
            let head = Set { rate_hz, beside, ..Set::of(grid(&[-45.0, 0.0, 45.0], |_| true)) }.read().unwrap();
            assert_eq!((head.name(), head.directions().len()), ("Sphere", 72));
            for azimuth in [0.0_f32, 30.0, 90.0, -60.0, 180.0] {
                let (found, wanted) = (itd_s(&head, azimuth, 0.0), wanted_s(f64::from(azimuth).to_radians().sin()));
                assert!((found - wanted).abs() < 6e-6, "{rate_hz} Hz, {azimuth}: {found} for {wanted}");
            }
            let ears = head.ears(Vec3::Y);
            let apart = ears.levels_db[0][40] - ears.levels_db[1][40];
            assert!((apart - 6.02).abs() < 0.3, "{apart} dB");
        }
    }
}

#[test]
fn partial_grids_are_heads_as_far_as_they_go() {
    let no_floor = Set::of(grid(&[0.0, 30.0, 60.0], |_| true)).read().unwrap();
    assert!((itd_s(&no_floor, 90.0, -30.0) - wanted_s(0.92)).abs() < 1e-4, "below, the nearest holds");
    let level = Set::of(grid(&[0.0], |_| true)).read().unwrap();
    assert!(level.notes().iter().any(|n| n.contains("height of the ears only")), "{:?}", level.notes());
    let one_side = Set::of(grid(&[-30.0, 0.0, 30.0], |azimuth| azimuth <= 180.0)).read().unwrap();
    assert!(one_side.notes().iter().any(|n| n.contains("mirror image")), "{:?}", one_side.notes());
    assert!((itd_s(&one_side, -45.0, 0.0) + itd_s(&one_side, 45.0, 0.0)).abs() < 1e-6);
    let ahead = Set::of(grid(&[-30.0, 0.0, 30.0], |azimuth| !(90.0..=270.0).contains(&azimuth)));
    ahead.refused("no head: directions: expected one within 45 degrees of every place around the head, found none within");
    Set::of(grid(&[0.0], |azimuth| azimuth < 90.0)).refused("no head: directions");
}

#[test]
fn the_right_ear_may_come_first_and_wrong_labels_are_noticed() {
    let first = Set { right_first: true, ..Set::of(grid(&[-30.0, 0.0, 30.0], |_| true)) };
    assert!((itd_s(&first.read().unwrap(), 90.0, 0.0) - wanted_s(1.0)).abs() < 6e-6);
    let mirrored: Vec<_> = grid(&[-30.0, 0.0, 30.0], |_| true).into_iter().map(|(a, e)| (360.0 - a, e)).collect();
    assert!(Set::of(mirrored).read().is_ok(), "a set in another order is no mirror image");
}

#[test]
fn what_is_no_head_is_refused_by_name() {
    let set = Set::of(grid(&[-30.0, 0.0, 30.0], |_| true));
    Set { receivers: 1, ..set.clone() }.refused("Data.IR: expected 2 receivers, the ears of a listener, found 1");
    Set { data_type: "TF", ..set.clone() }.refused("DataType: expected impulse responses, FIR, FIRE or FIR-E, found \"TF\"");
    Set { silent: Some(5), ..set.clone() }.refused("measurement 5, left ear: expected a response, found silence");
    Set { broken: Some(7), ..set.clone() }.refused("measurement 7, left ear, sample 191: expected a finite number, found NaN");
    Set { rate_hz: 8_000.0, ..set }.refused("Data.SamplingRate: expected 16000 to 192000 Hz, found 8000 Hz");
    Set::of(vec![(0.0, 0.0), (90.0, 0.0), (180.0, 0.0), (270.0, 0.0)]).refused("directions: expected at least 12, found 4");
}

#[test]
fn files_that_are_damaged_cut_short_or_something_else_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("head.sofa");
    let refused = |clue: &str| {
        let error = chain(&read_head(&path).unwrap_err());
        assert!(error.contains("head.sofa") && error.contains(clue), "{error}");
    };
    refused("cannot be read");
    std::fs::write(&path, b"RIFF\x24\0\0\0WAVEfmt ").unwrap();
    refused("no readable SOFA (HDF5) file");
    std::fs::write(&path, b"").unwrap();
    refused("no readable SOFA (HDF5) file");
    Set::of(grid(&[0.0], |_| true)).write(&path);
    let whole = std::fs::read(&path).unwrap();
    // Wherever a file is cut or damaged, there is an answer.
    for part in 1..40 {
        std::fs::write(&path, &whole[..whole.len() * part / 40]).unwrap();
        assert!(read_head(&path).is_err(), "{part} of 40 parts");
        let mut damaged = whole.clone();
        let place = part * whole.len() / 160;
        damaged[place] ^= 0xff;
        std::fs::write(&path, &damaged).unwrap();
        drop(read_head(&path));
    }
    let inside = folder.path().join("folder.sofa");
    std::fs::create_dir(&inside).unwrap();
    let error = chain(&read_head(&inside).unwrap_err());
    assert!(error.contains("folder.sofa: cannot be read: expected a regular file, found a folder"), "{error}");
}

/// Real sets, where they are beside the checkout.
mod needs_shared {
    use super::*;

    fn shared(name: &str) -> std::path::PathBuf {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/hrtf_kemar").join(name);
        assert!(path.exists(), "{} does not exist", path.display());
        path
    }

    #[test]
    #[ignore = "needs ../shared/data"]
    fn two_kemars_agree() {
        // One lists the right ear first.
        let heads = ["MIT_KEMAR_normal_pinna.sofa", "KEMAR_HRTFs_lfcorr.sofa"].map(|name| read_head(&shared(name)).unwrap());
        for azimuth in [-120.0, -60.0, 30.0, 90.0] {
            let [mit, tu] = heads.each_ref().map(|head| itd_s(head, azimuth, 0.0));
            assert!((mit - tu).abs() < 70e-6 && mit * f64::from(azimuth) < 0.0, "{azimuth}: {mit} {tu}");
        }
    }
}

#[test]
fn of_several_distances_the_farthest_is_taken() {
    let level = grid(&[-30.0, 0.0, 30.0], |_| true);
    let head = Set { near: level.clone(), ..Set::of(level.clone()) }.read().unwrap();
    assert_eq!(head.directions().len(), level.len());
    assert!(head.name().contains("at 1.50 m, the farthest of 2 distances"), "{}", head.name());
    assert!((itd_s(&head, 90.0, 0.0) - wanted_s(1.0)).abs() < 6e-6);
}
