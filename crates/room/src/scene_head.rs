//! The head that a room is heard with.

use crate::energy_vector::{EnergyVector, ear_energy};
use promenade_acoustics::{BANDS, OCTAVES_HZ, Octaves};
use promenade_core::glam::{DVec2, Vec3};
use promenade_core::head::harmonics;
use promenade_core::{
    AMBISONIC_CHANNELS, AmbisonicHead, Bands, Facing, Field, FieldGrid, Rows, Scene, StftGrid, TransferShape,
};

/// Where the levels of direct sound and image sources are compared, Hz: below what third-order Ambisonics resolve.
const COMPARED_HZ: [f64; 8] = [400.0, 500.0, 600.0, 700.0, 800.0, 900.0, 1000.0, 1100.0];

/// Frequencies of a band at which a head's level is looked up.
const IN_BAND: usize = 4;

/// Share of the sample rate up to which a head is trusted.
const TRUSTED: f64 = 0.42;

/// A head as scenes of image sources have it: its filters for the direct sound by direction, for image sources in third-order
/// Ambisonics, and the coherence of a diffuse field between its ears.
#[derive(Clone, Debug)]
pub struct SceneHead {
    pub(crate) grid: StftGrid,
    pub(crate) bands: Bands,
    /// By band.
    pub(crate) coherence: Vec<f32>,
    /// Above this frequency nothing is known of the head, Hz.
    pub(crate) top_hz: f32,
    pub(crate) head: AmbisonicHead,
    pub(crate) credit: String,
    pub(crate) licence: String,
    /// Directions of the direct sound, and its rows at 1 m.
    pub(crate) nodes: FieldGrid,
    pub(crate) shape: TransferShape,
    rows: Vec<f32>,
    /// What brings the rows to the level of the image sources.
    scale: f32,
    /// `[elevation][band][direct sound, image source]`: see [`Self::rings`].
    rings: Vec<Vec<[f64; 2]>>,
    /// `[node][band][ear]`: energy of the direct sound from there at each ear, where a diffuse field has 1.
    ears: Vec<Vec<[f64; 2]>>,
}

impl SceneHead {
    /// A head from its parts: the real coherence of a diffuse field between the ears by band, what it makes of the direct sound
    /// by direction at 1 m, and its filters for image sources of the same level. `None` if they do not fit together.
    #[must_use]
    pub fn new(grid: StftGrid, bands: Bands, coherence: Vec<f32>, direct: &Field, head: AmbisonicHead) -> Option<Self> {
        let (Facing::Emitter { .. }, Rows::Whole(rows)) = (&direct.grid().facing, direct.rows()) else { return None };
        let shape = direct.shape();
        let fits =
            shape == TransferShape { bins: grid.bins(), bands: coherence.len(), taps: 0 } && bands.count() == shape.bands;
        if !fits || direct.grid().position.iter().any(|axis| axis.count() > 1) {
            return None;
        }
        let receiver = Self {
            grid,
            bands,
            coherence,
            top_hz: (TRUSTED * grid.sample_rate_hz) as f32,
            head,
            credit: String::new(),
            licence: String::new(),
            nodes: direct.grid().clone(),
            shape,
            rows: rows.clone(),
            scale: 1.0,
            rings: Vec::new(),
            ears: Vec::new(),
        };
        Some(Self { rings: receiver.rings(), ears: receiver.ears(), ..receiver })
    }

    /// Its short-time Fourier grid.
    #[must_use]
    pub fn grid(&self) -> &StftGrid {
        &self.grid
    }

    /// Bands of the time filters of its scenes.
    #[must_use]
    pub fn bands(&self) -> &Bands {
        &self.bands
    }

    /// Above this frequency nothing is known of it, Hz.
    #[must_use]
    pub fn top_hz(&self) -> f32 {
        self.top_hz
    }

    /// This head with whom to credit for it, and under which licence.
    #[must_use]
    pub fn with_credit(self, credit: &str, licence: &str) -> Self {
        Self { credit: credit.to_owned(), licence: licence.to_owned(), ..self }
    }

    /// The head of a scene of image sources; `None` for a scene of another kind.
    ///
    /// A scene has its direct sound at a level of its own. The head's filters for image sources say what that level is.
    #[must_use]
    pub fn of_scene(scene: &Scene) -> Option<Self> {
        let images = scene.images()?;
        let head = images.head.clone();
        let coherence = scene.tail().coherence.clone();
        let receiver = Self::new(*scene.grid(), scene.bands().clone(), coherence, scene.field()?, head)?;
        let receiver =
            Self { top_hz: scene.top_hz(), credit: scene.credit().to_owned(), licence: scene.licence().to_owned(), ..receiver };
        let energies = receiver.energies(&COMPARED_HZ);
        let [direct, images] = energies.iter().flatten().fold([0.0; 2], |sum, e| [sum[0] + e[0], sum[1] + e[1]]);
        let scale = images / direct;
        let mut rings = receiver.rings.clone();
        rings.iter_mut().flatten().for_each(|[direct, _]| *direct *= scale);
        let mut ears = receiver.ears.clone();
        ears.iter_mut().flatten().flatten().for_each(|ear| *ear *= scale);
        scale.is_finite().then_some(Self { scale: scale.sqrt() as f32, rings, ears, ..receiver })
    }

    /// Energy that an ear hears of sound from all sides of each elevation of the nodes, mean of both ears, by band, where it is
    /// 1 of a diffuse field: of the direct sound and of image sources.
    fn rings(&self) -> Vec<Vec<[f64; 2]>> {
        let Facing::Emitter { azimuth, .. } = &self.nodes.facing else { return Vec::new() };
        let in_band = |i: usize| ((i as f64 + 0.5) / IN_BAND as f64 - 0.5) / 3.0;
        let of_band = |hz: &f32| (0..IN_BAND).map(|i| f64::from(*hz) * 2.0_f64.powf(in_band(i))).collect::<Vec<f64>>();
        let hz: Vec<f64> = self.bands.centres_hz().iter().flat_map(of_band).collect();
        let of_ring = |nodes: &[Vec<[f64; 2]>]| {
            let mean = |band: usize, which: usize| {
                let found = nodes.iter().flat_map(|node| &node[band * IN_BAND..][..IN_BAND]).map(|e| e[which]);
                0.5 * found.sum::<f64>() / (nodes.len() * IN_BAND) as f64
            };
            (0..self.bands.count()).map(|band| [mean(band, 0), mean(band, 1)]).collect()
        };
        self.energies(&hz).chunks(azimuth.count()).map(of_ring).collect()
    }

    /// As the field says.
    fn ears(&self) -> Vec<Vec<[f64; 2]>> {
        let in_band = |i: usize| 2.0_f64.powf(((i as f64 + 0.5) / IN_BAND as f64 - 0.5) / 3.0);
        let bin = |hz: f64| ((hz / self.grid.bin_hz(1)).round() as usize).clamp(1, self.shape.bins - 1);
        let of_row = |row: &[f32]| {
            let of_band = |hz: &f32| {
                let mut sums = [0.0; 2];
                for bin in (0..IN_BAND).map(|i| bin(f64::from(*hz) * in_band(i))) {
                    let (mixture, difference) = (f64::from(row[bin]), f64::from(row[self.shape.bins + bin]));
                    for (sum, sign) in sums.iter_mut().zip([-1.0, 1.0]) {
                        *sum += (mixture * (1.0 + sign * difference)).powi(2) / IN_BAND as f64;
                    }
                }
                sums
            };
            self.bands.centres_hz().iter().map(of_band).collect()
        };
        self.rows.chunks_exact(self.shape.row_len()).map(of_row).collect()
    }

    /// Amplitudes at both ears by band, over those of the mean of all turns of a head, of energy of which a share comes from
    /// one side, where the head is turned by `yaw`, radians.
    #[must_use]
    pub fn sides(&self, vector: &EnergyVector, yaw: f32) -> [Vec<f32>; 2] {
        let even = || [(); 2].map(|()| vec![1.0; self.bands.count()]);
        let (Some((from, share)), Facing::Emitter { elevation, azimuth, .. }) = (vector.side(), &self.nodes.facing) else {
            return even();
        };
        let [up, around] =
            [elevation.linear(from.z.clamp(-1.0, 1.0).asin() as f32), azimuth.linear(from.y.atan2(from.x) as f32 - yaw)];
        let pairs = |(nodes, count): ([(usize, f32); 4], usize)| nodes.into_iter().take(count);
        let near: Vec<(usize, f64)> =
            pairs(up).flat_map(|(i, a)| pairs(around).map(move |(j, b)| (i * azimuth.count() + j, f64::from(a * b)))).collect();
        let means: Vec<f64> = self.heard_from(from.z).collect();
        [0, 1].map(|ear| {
            let ratio = |(band, mean): (usize, &f64)| {
                let level: f64 = near.iter().map(|(node, weight)| weight * self.ears[*node][band][ear]).sum();
                (ear_energy(share, level) / ear_energy(share, *mean)).sqrt() as f32
            };
            means.iter().enumerate().map(ratio).collect()
        })
    }

    /// [`Self::rings`] at an elevation whose sine is given, by band.
    fn ring(&self, sine: f64) -> impl Iterator<Item = [f64; 2]> {
        let (nodes, count) = match &self.nodes.facing {
            Facing::Emitter { elevation, .. } => elevation.linear(sine.clamp(-1.0, 1.0).asin() as f32),
            Facing::Head { .. } => ([(0, 1.0); 4], 1),
        };
        let nodes = nodes.into_iter().take(count);
        (0..self.bands.count()).map(move |band| {
            let of = |which: usize| nodes.clone().map(|(node, w)| f64::from(w) * self.rings[node][band][which]).sum();
            [of(0), of(1)]
        })
    }

    /// Energy that an ear hears of sound from an elevation, mean of both ears and all turns of the head, by band, where it is 1
    /// of a diffuse field. `sine` is the elevation's.
    pub fn heard_from(&self, sine: f64) -> impl Iterator<Item = f64> {
        self.ring(sine).map(|[direct, _]| direct)
    }

    /// Gains by octave that bring an image source, which is heard in third-order Ambisonics, to the head's own level at its
    /// elevation: what the order does not resolve has the level of its surroundings otherwise. `sine` is the elevation's.
    #[must_use]
    pub fn image_gains(&self, sine: f64) -> Octaves {
        let mut sums = [[0.0; 2]; BANDS];
        for (hz, found) in self.bands.centres_hz().iter().zip(self.ring(sine)) {
            let octave = (f64::from(*hz) / f64::from(OCTAVES_HZ[0])).log2().round().clamp(0.0, (BANDS - 1) as f64);
            // Bands of equal ratio, weighted as white sound has them.
            sums[octave as usize].iter_mut().zip(found).for_each(|(sum, e)| *sum += f64::from(*hz) * e);
        }
        sums.map(|[direct, image]| if image > 0.0 { (direct / image).sqrt().clamp(0.5, 2.0) as f32 } else { 1.0 })
    }

    /// Energy of both ears in each direction at some frequencies, `[node][frequency]`, of the direct sound and of an image
    /// source.
    fn energies(&self, hz: &[f64]) -> Vec<Vec<[f64; 2]>> {
        let length = self.head.len();
        let bin = |hz: f64| ((hz / self.grid.bin_hz(1)).round() as usize).clamp(1, self.shape.bins - 1);
        // Of each filter the response at each frequency, `[frequency][channel][ear]`, as real and imaginary parts.
        let respond = |hz: &f64| -> Vec<DVec2> {
            let turn = -std::f64::consts::TAU * self.grid.bin_hz(bin(*hz)) / self.head.sample_rate_hz;
            let turns: Vec<DVec2> = (0..length).map(|i| DVec2::from_angle(turn * i as f64)).collect();
            let filters = self.head.filters.chunks_exact(length);
            filters.map(|filter| filter.iter().zip(&turns).map(|(v, turn)| *turn * f64::from(*v)).sum()).collect()
        };
        let responses: Vec<Vec<DVec2>> = hz.iter().map(respond).collect();
        let of_node = |node: usize| {
            let row = &self.rows[node * self.shape.row_len()..][..2 * self.shape.bins];
            let basis = harmonics(3, self.nodes.node(node).1);
            let at = |(hz, responses): (&f64, &Vec<DVec2>)| {
                let bin = bin(*hz);
                let (mixture, difference) = (f64::from(self.scale * row[bin]), f64::from(row[self.shape.bins + bin]));
                let ear = |ear: usize| -> f64 {
                    let sum: DVec2 =
                        (0..AMBISONIC_CHANNELS).zip(&basis).map(|(c, y)| responses[2 * c + ear] * f64::from(*y)).sum();
                    sum.length_squared()
                };
                [2.0 * mixture.powi(2) * (1.0 + difference.powi(2)), ear(0) + ear(1)]
            };
            hz.iter().zip(&responses).map(at).collect()
        };
        (0..self.nodes.nodes()).map(of_node).collect()
    }

    /// The direct sound of an emitter, with `gain` besides the head's at 1 m.
    pub(crate) fn direct(&self, emitter: Vec3, gain: f32) -> Option<Field> {
        let mut rows = self.rows.clone();
        for row in rows.chunks_exact_mut(self.shape.row_len()) {
            row[..self.shape.bins].iter_mut().for_each(|mixture| *mixture *= self.scale * gain);
        }
        let mut nodes = self.nodes.clone();
        if let Facing::Emitter { position, .. } = &mut nodes.facing {
            *position = emitter;
        }
        Field::new(nodes, self.shape, Rows::Whole(rows))
    }
}
