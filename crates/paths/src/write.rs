//! From a path to the text of a file.

use crate::{WriteFormat, csv, json};
use promenade_core::CameraPath;

/// The path as a file: seconds, metres, and yaw, pitch and roll in degrees.
///
/// What is read back is the same within 1e-6 s, m and rad.
///
/// # Real-time
/// Not real-time safe.
#[must_use]
pub fn write(path: &CameraPath, format: WriteFormat) -> String {
    match format {
        WriteFormat::Json => json::write(path),
        WriteFormat::Csv => csv::write(path),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};
    use promenade_core::{Keyframe, Pose};
    use promenade_testing::Noise;

    /// The largest difference of times, coordinates and angles, seconds, metres and radians.
    fn difference(a: &CameraPath, b: &CameraPath) -> f64 {
        assert_eq!(a.keyframes().len(), b.keyframes().len());
        let one = |(a, b): (&Keyframe, &Keyframe)| {
            let (p, q) = (a.pose.orientation.as_dquat().normalize(), b.pose.orientation.as_dquat().normalize());
            // The chord between unit quaternions is half the angle, and precise where an arc cosine is not.
            let angle = 2.0 * (p - q).length().min((p + q).length());
            (a.t_s - b.t_s).abs().max(f64::from((a.pose.position - b.pose.position).length())).max(angle)
        };
        a.keyframes().iter().zip(b.keyframes()).map(one).fold(0.0, f64::max)
    }

    fn poses() -> CameraPath {
        let mut keyframes = Vec::new();
        let mut noise = Noise::new(7);
        let mut random = || noise.value();
        let mut t_s = -3.0;
        for number in 0..2000 {
            let q = Quat::from_xyzw(random(), random(), random(), random()).normalize();
            let q = match number % 4 {
                // Straight up and down and close to it, where yaw and roll are about one axis.
                0 => Pose::from_ypr(Vec3::ZERO, 3.0 * random(), std::f32::consts::FRAC_PI_2, random()).orientation,
                1 => Pose::from_ypr(Vec3::ZERO, 3.0 * random(), -1.57 + 2e-3 * random(), random()).orientation,
                _ => q,
            };
            t_s += 1e-3 + f64::from(random().abs());
            let position = Vec3::new(100.0 * random(), random() * 1e-6, 1e4 * random());
            keyframes.push(Keyframe { t_s, pose: Pose { position, orientation: q } });
        }
        CameraPath::new(keyframes).unwrap()
    }

    #[test]
    fn what_is_written_is_read() {
        let path = poses();
        for (format, name) in [(WriteFormat::Json, "p.json"), (WriteFormat::Csv, "p.csv")] {
            let text = write(&path, format);
            let back = crate::read(name, text.as_bytes(), &crate::ImportOptions::default(), &mut crate::alone).unwrap();
            let off = difference(&path, &back.path);
            assert!(off < 1e-6, "{name}: {off}");
            assert_eq!(back.notes, Vec::<String>::new());
        }
    }

    #[test]
    fn it_is_written_for_people() {
        let at = |t_s, x, yaw| Keyframe { t_s, pose: Pose::from_ypr(Vec3::new(x, -0.0, 0.1), yaw, 0.0, 0.0) };
        let path = CameraPath::new(vec![at(0.0, 1.0, 0.0), at(2.5, 0.5, std::f32::consts::FRAC_PI_2)]).unwrap();
        assert_eq!(
            write(&path, WriteFormat::Json),
            "[\n  {\"t\": 0, \"position\": [1, 0, 0.1], \"ypr\": [0, 0, 0]},\n  \
             {\"t\": 2.5, \"position\": [0.5, 0, 0.1], \"ypr\": [90, 0, 0]}\n]\n"
        );
        assert_eq!(write(&path, WriteFormat::Csv), "t,x,y,z,yaw,pitch,roll\n0,1,0,0.1,0,0,0\n2.5,0.5,0,0.1,90,0,0\n");
    }
}
