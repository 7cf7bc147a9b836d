//! FIR responses of two ears or of an Ambisonic microphone, for one source or for emitters around it.

use crate::SofaError;
use crate::delay::delayed;
use crate::recorded::{About, Recorded};
use crate::spherical::Side;
use crate::variables::{Variables, facing, failed};
use hdf5_pure::File;
use promenade_audio::{FileError, file};
use promenade_core::Pose;
use promenade_core::glam::{Quat, Vec3};
use std::path::Path;

/// Values of responses read at a time.
const BLOCK_VALUES: usize = 1 << 23;
/// A delay stored beside a response, samples.
const MAX_DELAY: f64 = 1_000_000.0;
/// How far ears may be from the middle of a head, metres.
const MOST_BESIDE_M: f32 = 0.2;
/// Conventions of microphones in rooms, whose two receivers need not be ears.
const MICROPHONES: [&str; 2] = ["SingleRoomSRIR", "SingleRoomMIMOSRIR"];

/// The convention of loudspeakers around a listener, of which there may be one.
const SPEAKERS: &str = "MultiSpeakerBRIR";
/// The convention of responses of headphones, whose drivers are emitters that no axis of the responses counts.
const HEADPHONES: &str = "SimpleHeadphoneIR";

/// Where the axes of `Data.IR` are.
struct Layout {
    measurements: usize,
    receivers: usize,
    emitters: usize,
    frames: usize,
    /// Whether the emitters come after the samples.
    emitters_last: bool,
}

/// An open SOFA file, held while its responses are read on the thread that opened it.
pub struct Sofa<'a>(Variables<'a>);

/// What a file itself does not say, or says wrongly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SofaOptions {
    /// The side to which azimuths grow, instead of the left.
    pub azimuth_positive: Option<Side>,
    /// Which emitter of a file with several, counted from 0; without it only files with one are read.
    pub source: Option<usize>,
}

/// Responses in a set, and samples of both ears of all of them together: 2 GiB of `f32`.
const MAX_RESPONSES: usize = 200_000;
const MAX_SAMPLES: usize = 1 << 29;

/// Refuses a set that memory should not hold, before it is allocated.
///
/// # Errors
/// No response, more than 200,000, or more than 2 GiB of samples.
pub fn check_size(path: &Path, responses: usize, frames: usize) -> Result<(), FileError> {
    let wrong = |expected: String, found: usize| Err(FileError::content(path, expected, found.to_string()));
    if responses == 0 {
        return Err(FileError::content(path, "at least one response", "none"));
    }
    if responses > MAX_RESPONSES {
        return wrong(format!("at most {MAX_RESPONSES} responses"), responses);
    }
    let samples = responses.saturating_mul(frames).saturating_mul(2);
    if samples > MAX_SAMPLES {
        return wrong(format!("at most {MAX_SAMPLES} samples"), samples);
    }
    Ok(())
}

impl<'a> Sofa<'a> {
    /// Opens a regular file.
    ///
    /// # Errors
    /// It cannot be read, or is no HDF5.
    pub fn open(path: &'a Path) -> Result<Self, SofaError> {
        file::check(path).map_err(SofaError::read(path))?;
        Ok(Self(Variables { path, file: File::open_streaming(path).map_err(failed(path))? }))
    }
}

impl Sofa<'_> {
    pub(crate) fn variables(&self) -> &Variables<'_> {
        &self.0
    }

    /// Hands on all responses of two ears, the left ear's channel first. Also says whether the file lists the right ear first:
    /// such labels are sometimes wrong.
    ///
    /// # Errors
    /// Anything else than responses of two ears, more of them than memory should hold, a file that is damaged or incomplete.
    /// The message names file and variable.
    pub fn of_ears(&self, options: SofaOptions, mut take: impl FnMut(Recorded)) -> Result<(About, bool), SofaError> {
        let layout = self.layout()?;
        let convention = self.0.attribute("SOFAConventions");
        if layout.receivers != 2 || convention == HEADPHONES {
            let ambisonic =
                if layout.receivers > 2 { " (promenade responses ambisonic makes them of Ambisonic ones)" } else { "" };
            let found = format!("{}{}", layout.receivers, of(&convention));
            return Err(self.0.wrong("Data.IR", format!("2 receivers, the ears of a listener{ambisonic}"), found));
        }
        let exchanged = self.left_receiver(&convention)? == 1;
        let about = self.each(&layout, options, |mut recorded| {
            if exchanged {
                recorded.channels.reverse();
            }
            take(recorded);
        })?;
        Ok((about, exchanged))
    }

    /// Hands on all responses of a pair of headphones, the left ear's channel first.
    ///
    /// # Errors
    /// Another convention than SimpleHeadphoneIR; otherwise as [`Sofa::of_ears`].
    pub fn of_headphones(&self, mut take: impl FnMut(Recorded)) -> Result<About, SofaError> {
        let convention = self.0.attribute("SOFAConventions");
        if convention != HEADPHONES {
            let found = if convention.is_empty() { "none".to_owned() } else { convention };
            return Err(self.0.wrong("SOFAConventions", format!("headphone responses ({HEADPHONES})"), found));
        }
        let layout = self.layout()?;
        if layout.receivers != 2 {
            return Err(self.0.wrong("Data.IR", "2 receivers, the ears of a listener", layout.receivers));
        }
        let exchanged = self.left_receiver(&convention)? == 1;
        self.each(&layout, SofaOptions::default(), |mut recorded| {
            if exchanged {
                recorded.channels.reverse();
            }
            take(recorded);
        })
    }

    /// Hands on all responses of an Ambisonic microphone, whose channels are the receivers.
    ///
    /// # Errors
    /// Variables that are missing or damaged, no Ambisonic convention, capsules in different places.
    pub fn of_harmonics(&self, options: SofaOptions, take: impl FnMut(Recorded)) -> Result<About, SofaError> {
        let layout = self.layout()?;
        self.check_harmonics()?;
        self.each(&layout, options, take)
    }

    /// The direction of each response's source as the listener sees it: forward, left, up. Of any length.
    ///
    /// # Errors
    /// Variables of places that are missing, damaged or of other shapes.
    pub fn directions(&self) -> Result<Vec<Vec3>, SofaError> {
        let layout = self.layout()?;
        let listeners = self.listeners(layout.measurements)?;
        let sources = self.sources(layout.measurements, layout.emitters, 0, SofaOptions::default())?;
        Ok(listeners.iter().zip(sources).map(|(listener, source)| listener.to_head(source)).collect())
    }

    /// Samples per second.
    ///
    /// # Errors
    /// None that can be believed.
    pub fn sample_rate_hz(&self) -> Result<f64, SofaError> {
        self.0.sample_rate()
    }

    /// The axes by the type of the data: measurements, receivers, samples for `FIR`; measurements, receivers, emitters, samples
    /// for `FIRE`; measurements, receivers, samples, emitters for `FIR-E`.
    fn layout(&self) -> Result<Layout, SofaError> {
        let data_type = self.0.attribute("DataType");
        let axes = match data_type.as_str() {
            "FIR" => "MRN",
            "FIRE" => "MREN",
            "FIR-E" => "MRNE",
            _ => {
                let found = format!("\"{data_type}\"{}", of(&self.0.attribute("SOFAConventions")));
                return Err(self.0.wrong("DataType", "impulse responses, FIR, FIRE or FIR-E", found));
            }
        };
        let shape = self.0.shape("Data.IR")?;
        if shape.len() != axes.len() {
            let expected = format!("the {} axes {axes} of {data_type}", axes.len());
            return Err(self.0.wrong("Data.IR", expected, format!("{shape:?}")));
        }
        let axis = |name: char| axes.find(name).map_or(1, |at| shape[at]);
        let layout = Layout {
            measurements: axis('M'),
            receivers: axis('R'),
            emitters: axis('E'),
            frames: axis('N'),
            emitters_last: data_type == "FIR-E",
        };
        // The file's own dimensions, where it has them, say whether its writer meant the same.
        let drivers = self.0.attribute("SOFAConventions") == HEADPHONES;
        for name in ['R', 'E', 'N'].into_iter().filter(|name| !(drivers && *name == 'E')) {
            let stated = if self.0.has(&name.to_string()) { self.0.shape(&name.to_string())?.first().copied() } else { None };
            if let Some(stated) = stated.filter(|stated| *stated != axis(name)) {
                let expected = format!("the axes {axes} of {data_type} with {name} = {stated}, as its dimension says");
                return Err(self.0.wrong("Data.IR", expected, format!("{shape:?}")));
            }
        }
        if layout.frames == 0 {
            return Err(self.0.wrong("Data.IR", "at least one sample of each response", "none"));
        }
        check_size(self.0.path, layout.measurements.saturating_mul(layout.receivers.div_ceil(2)), layout.frames)?;
        Ok(layout)
    }

    /// Hands all responses of the chosen emitter on, their delays put back.
    fn each(&self, layout: &Layout, options: SofaOptions, mut take: impl FnMut(Recorded)) -> Result<About, SofaError> {
        let &Layout { measurements, receivers, emitters, frames, emitters_last } = layout;
        let emitter = match options.source {
            Some(n) if n < emitters => n,
            None if emitters == 1 => 0,
            chosen => {
                let found = chosen.map_or("none chosen".to_owned(), |n| n.to_string());
                let expected = format!("the number of one of its {emitters} emitters, counted from 0");
                return Err(self.0.wrong("Data.IR", expected, found));
            }
        };
        let sample_rate_hz = self.0.sample_rate()?;
        let listeners = self.listeners(measurements)?;
        let sources = self.sources(measurements, emitters, emitter, options)?;
        let delays = self.delays(layout, emitter)?;
        let per_measurement = receivers.saturating_mul(emitters).saturating_mul(frames);
        let block = (BLOCK_VALUES / per_measurement.max(1)).max(1);
        let data = self.0.dataset("Data.IR")?;
        for first in (0..measurements).step_by(block) {
            let count = block.min(measurements - first);
            let values = data.read_f64_rows(first as u64, count as u64).map_err(failed(self.0.path))?;
            if values.len() != count * per_measurement {
                return Err(self.0.wrong("Data.IR", format!("{} values", count * per_measurement), values.len()));
            }
            for (offset, values) in values.chunks_exact(per_measurement).enumerate() {
                let m = first + offset;
                let channel = |(receiver, delay): (usize, &f64)| {
                    let of_receiver = &values[receiver * emitters * frames..][..emitters * frames];
                    let samples: Vec<f64> = if emitters_last {
                        of_receiver.iter().skip(emitter).step_by(emitters).copied().collect()
                    } else {
                        of_receiver[emitter * frames..][..frames].to_vec()
                    };
                    delayed(&samples, *delay)
                };
                take(Recorded {
                    listener: listeners[m],
                    source: Some(sources[m]),
                    distance_m: None,
                    channels: delays[m].iter().enumerate().map(channel).collect(),
                    name: format!("measurement {m}"),
                });
            }
        }
        let title =
            [self.0.attribute("Title"), self.0.attribute("DatabaseName")].into_iter().find(|t| !t.is_empty() && t != "none");
        let file_name = || self.0.path.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let credit = [self.0.attribute("Organization"), self.0.attribute("AuthorContact")];
        Ok(About {
            title: title.unwrap_or_else(file_name),
            credit: credit.into_iter().filter(|c| !c.is_empty()).collect::<Vec<_>>().join(", "),
            licence: self.0.attribute("License"),
            sample_rate_hz,
        })
    }

    /// Which of two receivers is the left ear: the one further along y. Files list them in either order.
    fn left_receiver(&self, convention: &str) -> Result<usize, SofaError> {
        if !self.0.has("ReceiverPosition") {
            return Ok(0);
        }
        let (shape, _) = self.0.values("ReceiverPosition")?;
        let columns = shape.get(2).copied().unwrap_or(1);
        let places: Vec<Vec3> = match shape[..] {
            [2, 3] => self.0.points("ReceiverPosition", 0, 2, Side::Left)?.points,
            _ => (0..2)
                .map(|r| Ok(self.0.points("ReceiverPosition", r, columns, Side::Left)?.at(0)))
                .collect::<Result<_, SofaError>>()?,
        };
        let beside = |p: &Vec3| p.y.abs() > 0.0 && p.length() <= MOST_BESIDE_M;
        let apart = places[0].distance(places[1]) > 1e-6;
        if MICROPHONES.contains(&convention) && apart && !(places.iter().all(beside) && places[0].y * places[1].y < 0.0) {
            let expected = format!("2 receivers at the ears, one on either side of the head within {MOST_BESIDE_M} m");
            let found = format!("{} and {}{}", places[0], places[1], of(convention));
            return Err(self.0.wrong("ReceiverPosition", expected, found));
        }
        // Receivers that are not told apart are left and right, the order of the standard's conventions.
        Ok(usize::from(places[1].y > places[0].y + 1e-6))
    }

    /// Refuses receivers that are capsules of a microphone and no spherical harmonics. Those that are all in one place may be
    /// these.
    fn check_harmonics(&self) -> Result<(), SofaError> {
        let name = "ReceiverPosition";
        if !self.0.has(name) || self.0.text(name, "Type")? == "spherical harmonics" {
            return Ok(());
        }
        let (shape, values) = self.0.values(name)?;
        let (columns, coordinates) = (shape.get(2).copied().unwrap_or(1), shape.get(1).copied().unwrap_or(1));
        let one_place = values.iter().enumerate().all(|(i, v)| *v == values[i % (coordinates * columns).max(1)]);
        if one_place {
            return Ok(());
        }
        let found = format!("capsules in different places{}", of(&self.0.attribute("SOFAConventions")));
        Err(self.0.wrong(name, "Ambisonic channels, of the type spherical harmonics", found))
    }

    fn listeners(&self, measurements: usize) -> Result<Vec<Pose>, SofaError> {
        let positions = self.0.points_or("ListenerPosition", measurements, Vec3::ZERO)?;
        let views = self.0.points_or("ListenerView", measurements, Vec3::X)?;
        let ups = self.0.ups("ListenerUp", "ListenerView", measurements, &views)?;
        (0..measurements)
            .map(|m| {
                let orientation = facing(views.at(m), ups.at(m)).ok_or_else(|| {
                    let found = format!("view {} and up {} of measurement {m}", views.at(m), ups.at(m));
                    self.0.wrong("ListenerView", "a view and an up across it", found)
                })?;
                Ok(Pose { position: positions.at(m), orientation })
            })
            .collect()
    }

    fn sources(
        &self,
        measurements: usize,
        emitters: usize,
        emitter: usize,
        options: SofaOptions,
    ) -> Result<Vec<Vec3>, SofaError> {
        let positive = options.azimuth_positive.unwrap_or(Side::Left);
        let positions = self.0.points("SourcePosition", 0, measurements, positive)?;
        // A single emitter stands for the source itself; several, and loudspeakers, lie around it in its own axes.
        let several = emitters > 1 || self.0.attribute("SOFAConventions") == SPEAKERS && self.0.has("EmitterPosition");
        let around = several.then(|| self.0.points("EmitterPosition", emitter, measurements, positive)).transpose()?;
        if positive == Side::Right && !positions.spherical && !around.as_ref().is_some_and(|a| a.spherical) {
            let expected = "spherical coordinates, whose azimuths may run to the right";
            return Err(self.0.wrong("SourcePosition", expected, "Cartesian ones"));
        }
        let Some(around) = around else {
            return Ok((0..measurements).map(|m| positions.at(m)).collect());
        };
        let views = self.0.points_or("SourceView", measurements, Vec3::X)?;
        let ups = self.0.ups("SourceUp", "SourceView", measurements, &views)?;
        let turn = |m: usize| facing(views.at(m), ups.at(m)).unwrap_or(Quat::IDENTITY);
        Ok((0..measurements).map(|m| positions.at(m) + turn(m) * around.at(m)).collect())
    }

    /// Delays of all receivers for each measurement, samples.
    fn delays(&self, layout: &Layout, emitter: usize) -> Result<Vec<Vec<f64>>, SofaError> {
        let &Layout { measurements, receivers, emitters, .. } = layout;
        if !self.0.has("Data.Delay") {
            return Ok(vec![vec![0.0; receivers]; measurements]);
        }
        let (shape, values) = self.0.values("Data.Delay")?;
        let (rows, columns) = match shape[..] {
            [rows, r] if r == receivers => (rows, 1),
            [rows, r, e] if r == receivers && (e == 1 || e == emitters) => (rows, e),
            _ => {
                let expected = format!("a delay for each of {receivers} receivers");
                return Err(self.0.wrong("Data.Delay", expected, format!("{shape:?}")));
            }
        };
        if rows != 1 && rows != measurements {
            return Err(self.0.wrong("Data.Delay", format!("1 or {measurements} measurements"), rows));
        }
        if let Some(bad) = values.iter().find(|v| !(0.0..=MAX_DELAY).contains(*v)) {
            return Err(self.0.wrong("Data.Delay", format!("0 to {MAX_DELAY} samples"), bad));
        }
        let column = if columns == 1 { 0 } else { emitter };
        let at = |m: usize, r: usize| values[((if rows == 1 { 0 } else { m }) * receivers + r) * columns + column];
        Ok((0..measurements).map(|m| (0..receivers).map(|r| at(m, r)).collect()).collect())
    }
}

/// The convention of a file in words, after what was found.
fn of(convention: &str) -> String {
    if convention.is_empty() { String::new() } else { format!(" (a file of the convention {convention})") }
}
