//! Sources that are placed by azimuth, elevation and distance: where they are along the axes, they sound the same.

use crate::many::{set, sounds, tracks};
use promenade_core::Scene;
use promenade_core::glam::Vec3;
use promenade_tests::signal::{difference_db, peak};
use promenade_tests::{Host, Setup, in_both_formats, render};

in_both_formats!(
    directions_place_sources_as_the_axes_do,
    an_azimuth_can_be_automated,
    an_older_project_has_its_sources_along_the_axes,
);

const LEN: usize = 20_000;
/// Angles and places that are kept as single-precision numbers.
const SAME_DB: f32 = -70.0;

/// Along the axes, metres from the source of a new instance's scene, what is ahead, to the left and up of where its listener
/// starts.
pub(crate) fn along_axes(ahead: [f64; 3]) -> [f64; 3] {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../presets/scenes/loft.promenade");
    let scene = Scene::from_bytes(&std::fs::read(scene).unwrap()).unwrap();
    let (start, source) = (scene.start_pose(), scene.emitter().unwrap());
    assert!(start.ypr().0.abs() > 0.1, "it faces another way than the axes");
    (start.position + start.orientation * Vec3::from_array(ahead.map(|x| x as f32)) - source).to_array().map(f64::from)
}

fn many<H: Host>() -> H {
    H::open_many(Setup { inputs: 1, further: 2, offline: true, ..Setup::default() })
}

/// Places the sources, metres ahead, to the left and up of where the listener starts, by the parameters along the axes or by
/// those of directions.
fn placed<H: Host>(places: [[f64; 3]; 3], polar: bool) -> H {
    let mut host: H = many();
    for (source, [x, y, z]) in places.into_iter().enumerate() {
        let number = if source == 0 { String::new() } else { (source + 1).to_string() };
        let (azimuth, elevation) = (y.atan2(x).to_degrees(), z.atan2(x.hypot(y)).to_degrees());
        let values = if polar {
            [("azimuth", azimuth), ("elevation", elevation), ("distance", x.hypot(y).hypot(z))]
        } else {
            let [x, y, z] = along_axes([x, y, z]);
            [("ex", x), ("ey", y), ("ez", z)]
        };
        values.into_iter().for_each(|(id, value)| set(&mut host, &format!("{id}{number}"), &value.to_string()));
    }
    host.set("place", f64::from(u8::from(polar)));
    host.instance().settle().unwrap();
    host
}

const PLACES: [[f64; 3]; 3] = [[1.0, -1.25, 0.5], [-0.5, 1.5, 0.0], [2.0, 0.25, -0.75]];

fn directions_place_sources_as_the_axes_do<H: Host>() {
    let sounds = sounds(3, LEN);
    let heard = |polar| render(&mut placed::<H>(PLACES, polar), &tracks(&sounds), &[512]);
    let (wanted, found) = (heard(false), heard(true));
    let plain = render(&mut many::<H>(), &tracks(&sounds), &[512]);
    let difference = difference_db(&wanted, &found);
    assert!(peak(&wanted[0]) > 0.01 && difference < SAME_DB, "{difference} dB from the axes");
    assert!(difference_db(&plain, &found) > -20.0, "nothing has moved");
    // And again with the project.
    let saved = placed::<H>(PLACES, true).save();
    let mut again = many::<H>();
    assert!(again.load(&saved));
    assert!(difference_db(&found, &render(&mut again, &tracks(&sounds), &[512])) < -120.0);
}

/// Round the listener in steps that both ways can write.
fn an_azimuth_can_be_automated<H: Host>() {
    let sounds = sounds(3, LEN);
    let walked = |polar: bool| {
        let mut host = placed::<H>([[1.5, 0.0, 0.0]; 3], polar);
        let mut heard = [Vec::new(), Vec::new()];
        for (step, start) in (0..LEN).step_by(2_000).enumerate() {
            let azimuth = 20.0 * step as f64;
            if polar {
                set(&mut host, "azimuth3", &azimuth.to_string());
            } else {
                let (sin, cos) = azimuth.to_radians().sin_cos();
                let [x, y, _] = along_axes([1.5 * cos, 1.5 * sin, 0.0]);
                set(&mut host, "ex3", &x.to_string());
                set(&mut host, "ey3", &y.to_string());
            }
            let part: Vec<_> = sounds.iter().map(|sound| &sound[start..start + 2_000]).collect();
            heard.iter_mut().zip(render(&mut host, &part, &[500])).for_each(|(all, new)| all.extend(new));
        }
        heard
    };
    let difference = difference_db(&walked(false), &walked(true));
    assert!(difference < -60.0, "{difference} dB from the axes");
}

fn an_older_project_has_its_sources_along_the_axes<H: Host>() {
    let sounds = sounds(3, LEN);
    let mut host = placed::<H>(PLACES, false);
    let wanted = render(&mut host, &tracks(&sounds), &[512]);
    let mut state = host.state();
    assert!(state["params"].as_object_mut().unwrap().remove("place").is_some());
    let mut other = placed::<H>([[3.0, 0.0, 0.0]; 3], true);
    assert!(other.load(state.to_string().as_bytes()));
    let difference = difference_db(&wanted, &render(&mut other, &tracks(&sounds), &[512]));
    assert!(difference < -120.0, "{difference} dB from itself");
}
