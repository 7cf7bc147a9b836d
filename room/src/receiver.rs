//! The head that a room is heard with.

use promenade_core::glam::Vec3;
use promenade_core::head::harmonics;
use promenade_core::{
    AMBISONIC_CHANNELS, AmbisonicHead, Bands, Facing, Field, FieldGrid, Rows, Scene, StftGrid, TransferShape,
};

/// Where the levels of direct sound and image sources are compared, Hz: below what third-order Ambisonics resolve.
const COMPARED_HZ: [f64; 8] = [400.0, 500.0, 600.0, 700.0, 800.0, 900.0, 1000.0, 1100.0];

/// Share of the sample rate up to which a head is trusted.
const TRUSTED: f64 = 0.42;

/// A head as scenes of image sources have it: its filters for the direct sound by direction, for image sources in third-order Ambisonics, and
/// the coherence of a diffuse field between its ears.
#[derive(Clone, Debug)]
pub struct Receiver {
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
}

impl Receiver {
    /// A head from its parts: the real coherence of a diffuse field between the ears by band, what it makes of the direct sound by direction at
    /// 1 m, and its filters for image sources of the same level. `None` if they do not fit together.
    #[must_use]
    pub fn new(grid: StftGrid, bands: Bands, coherence: Vec<f32>, direct: &Field, head: AmbisonicHead) -> Option<Self> {
        let (Facing::Emitter { .. }, Rows::Whole(rows)) = (&direct.grid().facing, direct.rows()) else { return None };
        let shape = direct.shape();
        let fits =
            shape == TransferShape { bins: grid.bins(), bands: coherence.len(), taps: 0 } && bands.count() == shape.bands;
        if !fits || direct.grid().position.iter().any(|axis| axis.count() > 1) {
            return None;
        }
        Some(Self {
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
        })
    }

    /// The same with whom to credit for it, and under which licence.
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
        let energies = (0..receiver.nodes.nodes()).flat_map(|node| receiver.energies(node));
        let [direct, images] = energies.fold([0.0; 2], |sum, found| [sum[0] + found[0], sum[1] + found[1]]);
        let scale = (images / direct).sqrt();
        scale.is_finite().then_some(Self { scale: scale as f32, ..receiver })
    }

    /// Energy of both ears in a direction at each compared frequency, of the direct sound and of an image source.
    fn energies(&self, node: usize) -> impl Iterator<Item = [f64; 2]> {
        let row = &self.rows[node * self.shape.row_len()..][..2 * self.shape.bins];
        let basis = harmonics(3, self.nodes.node(node).1);
        let rate = self.head.sample_rate_hz;
        COMPARED_HZ.into_iter().map(move |hz| {
            let bin = ((hz / self.grid.bin_hz(1)).round() as usize).min(self.shape.bins - 1);
            let (mixture, difference) = (f64::from(row[bin]), f64::from(row[self.shape.bins + bin]));
            let direct = 2.0 * mixture.powi(2) * (1.0 + difference.powi(2));
            let image = |ear: usize| {
                let sample = |i: usize| -> f64 {
                    let filters = (0..AMBISONIC_CHANNELS).zip(&basis);
                    filters.map(|(c, y)| f64::from(y * self.head.filters[(2 * c + ear) * self.head.len() + i])).sum()
                };
                let turn = std::f64::consts::TAU * self.grid.bin_hz(bin) / rate;
                let (re, im) = (0..self.head.len()).fold((0.0, 0.0), |(re, im), i| {
                    let (sine, cosine) = (turn * i as f64).sin_cos();
                    (re + cosine * sample(i), im - sine * sample(i))
                });
                re * re + im * im
            };
            [direct, image(0) + image(1)]
        })
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
