//! The bass of a room as waves have it: the lower half of the dry sound through responses at a low rate.
//!
//! The low half is taken at about ten times the crossover, heard through one response for each ear that is mixed anew when the
//! listener moves, and brought back. All of it fits into the latency of the frames. Where there is less, the beginning of a
//! response is heard at a higher rate, and the rest of it, which may come later, at that one.

use crate::decode::NEAREST_M;
use crate::number::{single, whole};
use crate::render::low::bass_filters::{AtRate, BassFilters, EAR_M, REACH, WITH_VELOCITY};
use crate::render::low::convolver::Convolver;
use crate::render::low::crossover::Crossover;
use crate::render::part::{Heard, Hop, Part};
use crate::render::transform::lanes::WeightedSum;
use crate::scene::{BASS_SIGNALS, BassEars};
use crate::{Pose, Scene, StftGrid, Trim};
use glam::Vec3;
use pulp::Arch;
use std::ops::Range;
use std::sync::Arc;

/// Signals that are mixed at a pose, at most: those of the corners of a cell.
const MOST_SIGNALS: usize = 8 * WITH_VELOCITY;

/// The bass of a scene, for one stream.
pub(crate) struct WaveBass {
    arch: Arch,
    scene: Arc<Scene>,
    emitter: Vec3,
    filters: Arc<BassFilters>,
    crossover: Crossover,
    /// By rate of the filters.
    convolvers: Vec<Convolver>,
    /// The pose and trim that the convolvers' responses are of.
    set: Option<(Pose, Trim)>,
    /// The bass of the newest hop.
    out: [Vec<f32>; 2],
    /// The pose and trim that the hop goes to.
    wanted: Option<(Pose, Trim)>,
    /// Whether responses as they are and as they were differ in this hop.
    moves: bool,
    /// Samples since there was input, and after how many nothing sounds any more.
    quiet: usize,
    longest: usize,
}

impl WaveBass {
    /// `None` for a scene without. `filters` are the scene's at the grid's rate.
    pub(crate) fn new(scene: &Arc<Scene>, grid: &StftGrid, filters: &Arc<BassFilters>) -> Option<Self> {
        let (bass, emitter) = (scene.bass()?, scene.emitter()?);
        let mut new = Self {
            arch: Arch::new(),
            scene: Arc::clone(scene),
            emitter,
            crossover: Crossover::new(bass.crossover_hz, grid.sample_rate_hz),
            convolvers: filters.rates.iter().map(Convolver::new).collect(),
            set: None,
            out: [vec![0.0; grid.hop], vec![0.0; grid.hop]],
            wanted: None,
            moves: false,
            quiet: usize::MAX / 2,
            longest: 0,
            filters: Arc::clone(filters),
        };
        new.longest = new.tail_samples() + 2 * grid.hop;
        Some(new)
    }

    /// Takes the pose that was asked for, once the hop is heard.
    fn follow(&mut self) {
        let Some((pose, trim)) = &self.wanted.take() else { return };
        self.moves = self.set != Some((*pose, *trim));
        if self.moves {
            let fresh = self.set.is_none();
            self.convolvers.iter_mut().for_each(|convolver| std::mem::swap(&mut convolver.now, &mut convolver.before));
            self.mix(pose, trim);
            if fresh {
                for Convolver { before, now, .. } in &mut self.convolvers {
                    before.iter_mut().zip(now).for_each(|(before, now)| before.copy_from_slice(now));
                }
            }
            self.set = Some((*pose, *trim));
        }
    }

    /// Takes samples of the hop, the first of number `at`, and leaves their upper half.
    fn split(&mut self, samples: &mut [f32], at: usize) {
        self.quiet = if samples.iter().any(|x| *x != 0.0) { 0 } else { self.quiet.saturating_add(samples.len()) };
        if self.quiet > self.longest {
            if self.quiet - samples.len() <= self.longest {
                self.silence();
            }
            self.out.iter_mut().for_each(|out| out[at..at + samples.len()].fill(0.0));
            return;
        }
        self.follow();
        let count = self.out[0].len() as f32;
        for (i, x) in (at..).zip(samples) {
            let [low, high] = self.crossover.split(f64::from(*x));
            *x = single(high);
            let along = (i + 1) as f32 / count;
            let along = self.moves.then_some(along * along * (3.0 - 2.0 * along));
            let mut ears = [0.0; 2];
            for (convolver, at) in self.convolvers.iter_mut().zip(&self.filters.rates) {
                let heard = convolver.hear(at, single(low), along);
                ears.iter_mut().zip(heard).for_each(|(ear, heard)| *ear += heard);
            }
            self.out.iter_mut().zip(ears).for_each(|(out, ear)| out[i] = ear);
        }
    }

    /// Mixes what both ears hear at a pose.
    fn mix(&mut self, pose: &Pose, trim: &Trim) {
        let scene = Arc::clone(&self.scene);
        let Some(bass) = scene.bass() else { return };
        let filters = Arc::clone(&self.filters);
        let away = pose.position.distance(self.emitter);
        let travels = |at: &AtRate| f64::from(away / filters.speed_m_s) * at.rate_hz;
        let axes = Vec3::AXES.map(|axis| pose.orientation.inverse() * axis);
        for (convolver, at) in self.convolvers.iter_mut().zip(&filters.rates) {
            convolver.set_gains(bass, &filters, (at, travels(at)), trim);
        }
        for ear in 0..2 {
            let mut rows = [(0, 0.0); MOST_SIGNALS];
            let mut places = rows.iter_mut();
            for shares in bass.shares(pose.position) {
                let mut signals = [0.0; WITH_VELOCITY];
                self.ear_shares(bass.ears, ear, &shares, &axes, trim.width, &mut signals);
                let heard = signals.iter().enumerate().take(filters.signals).filter(|(_, share)| **share != 0.0);
                for ((signal, share), place) in heard.zip(&mut places) {
                    let row = shares.place * filters.signals + signal;
                    *place = (u32::try_from(row).unwrap_or_default(), *share);
                }
            }
            let free = places.len();
            let corners = &rows[..MOST_SIGNALS - free];
            // The direct sound, as late at an ear as it is for a head in long waves.
            let towards = pose.to_head(self.emitter) / away.max(1e-6);
            let (level, later_m) = match (bass.ears, ear) {
                (BassEars::Head, 0) => (1.0, -EAR_M * towards.y),
                (BassEars::Head, _) => (1.0, EAR_M * towards.y),
                (BassEars::Pair(0), 0) => (1.0, 0.0),
                (BassEars::Pair(0), _) => (towards.y, 0.0),
                (BassEars::Pair(1), 0) => (towards.z, 0.0),
                (BassEars::Pair(1), _) => (towards.x, 0.0),
                (BassEars::Pair(_), _) => (0.0, 0.0),
            };
            let level = level * trim.direct * bass.direct / away.max(NEAREST_M);
            for (n, (convolver, at)) in self.convolvers.iter_mut().zip(&filters.rates).enumerate() {
                let mixed = &mut convolver.mixed;
                self.arch.dispatch(WeightedSum { rows: &at.samples, corners, row_len: at.length, offset: 0, out: mixed });
                mixed.iter_mut().zip(&convolver.gains).for_each(|(m, g)| *m *= g);
                let out = &mut convolver.now[ear];
                move_earlier(mixed, travels(at) - at.wait, out);
                out.iter_mut().zip(&at.part).for_each(|(out, part)| *out *= part);
                if n == 0 {
                    let after = at.wait + f64::from(later_m / filters.speed_m_s) * at.rate_hz;
                    add_impulse(out, after, level);
                }
            }
        }
    }

    /// Shares of a place's signals in what an ear hears; `axes` are the world's, as the head has them.
    fn ear_shares(
        &self,
        ears: BassEars,
        ear: usize,
        shares: &crate::scene::BassShares,
        axes: &[Vec3; 3],
        width: f32,
        out: &mut [f32; WITH_VELOCITY],
    ) {
        // A slope along the head's axis to the left is the mix of the world's that this axis is of.
        let mut velocity = |along: usize| {
            for axis in 0..3 {
                out[4 + axis] = shares.straight * axes[axis][along];
            }
        };
        match (ears, ear) {
            (BassEars::Head, _) => {
                let side = width * if ear == 0 { EAR_M } else { -EAR_M };
                for (signal, out) in out.iter_mut().enumerate().take(BASS_SIGNALS) {
                    let slope: f32 = (0..3).map(|axis| axes[axis].y * shares.of[1 + axis][signal]).sum();
                    *out = shares.of[0][signal] + side * slope;
                }
            }
            (BassEars::Pair(0), 0) => out[..BASS_SIGNALS].copy_from_slice(&shares.of[0]),
            (BassEars::Pair(0), _) => velocity(1),
            (BassEars::Pair(1), 0) => velocity(2),
            (BassEars::Pair(1), _) => velocity(0),
            (BassEars::Pair(_), _) => {}
        }
    }

    fn silence(&mut self) {
        self.crossover.reset();
        self.convolvers.iter_mut().for_each(Convolver::silence);
    }
}

impl Part for WaveBass {
    /// Over the hop the listener moves to where it ends.
    fn begin(&mut self, hop: &Hop<'_>) {
        self.moves = false;
        self.wanted = Some((hop.to, hop.trim));
    }

    fn take(&mut self, hop: &mut [f32], span: Range<usize>, heard: &mut Heard<'_>) {
        self.split(&mut hop[span.clone()], span.start);
        for (ear, out) in heard.ears.iter_mut().zip(&self.out) {
            ear.iter_mut().zip(&out[span.clone()]).for_each(|(ear, out)| *ear += out);
        }
    }

    fn tail_samples(&self) -> usize {
        let rates = self.convolvers.iter().zip(&self.filters.rates);
        rates.map(|(convolver, at)| (convolver.now[0].len() + 4 * REACH) * at.every).max().unwrap_or(0)
    }

    fn reset(&mut self) {
        self.silence();
        self.convolvers.iter_mut().zip(&self.filters.rates).for_each(|(convolver, at)| convolver.missing = at.every);
        self.set = None;
        self.quiet = usize::MAX / 2;
        self.out.iter_mut().for_each(|out| out.fill(0.0));
    }

    fn memory_bytes(&self) -> usize {
        self.convolvers.iter().map(Convolver::memory_bytes).sum::<usize>() + self.out[0].len() * 8
    }
}

/// Weights of the four samples about a place that lies so far from the second to the third (Lagrange).
fn cubic(t: f32) -> [f32; 4] {
    [
        -t * (t - 1.0) * (t - 2.0) / 6.0,
        (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
        -(t + 1.0) * t * (t - 2.0) / 2.0,
        (t + 1.0) * t * (t - 1.0) / 6.0,
    ]
}

/// Puts samples into `out`, moved earlier by so many samples.
fn move_earlier(samples: &[f32], earlier: f64, out: &mut [f32]) {
    let base = earlier.floor();
    let weights = cubic(single(earlier - base));
    let at = |i: f64| if i >= 0.0 { samples.get(whole(i)).copied().unwrap_or(0.0) } else { 0.0 };
    // The outputs of which all four samples are there.
    let from = whole((1.0 - base).max(0.0)).min(out.len());
    let inner = samples.get(whole((base - 1.0).max(0.0))..).unwrap_or_default();
    let to = (from + inner.len().saturating_sub(3)).min(out.len());
    for (out, four) in out[from..to].iter_mut().zip(inner.windows(4)) {
        *out = weights.iter().zip(four).map(|(w, x)| w * x).sum();
    }
    for n in (0..from).chain(to..out.len()) {
        let first = base + n as f64 - 1.0;
        out[n] = weights.iter().enumerate().map(|(k, w)| w * at(first + k as f64)).sum();
    }
}

/// Adds an impulse between samples, by Lagrange's cubic; one before the first is at the first.
fn add_impulse(out: &mut [f32], at: f64, level: f32) {
    let at = at.max(1.0);
    let base = at.floor();
    let weights = cubic(single(at - base));
    let first = whole(base) - 1;
    for (k, weight) in weights.iter().enumerate() {
        if let Some(out) = out.get_mut(first + k) {
            *out += level * weight;
        }
    }
}
