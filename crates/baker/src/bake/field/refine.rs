//! Where the nodes of a field have to lie.

use crate::bake::field::Decoders;
use crate::bake::field::basis::{Shapes, levels_db};
use promenade_core::glam::Vec3;
use promenade_core::random::Random;
use promenade_core::{Axis, Pose};
use std::collections::HashMap;
use std::f32::consts::TAU;

/// Lines through the space of poses on which the error along each axis is measured.
const LINES: usize = 16;
/// Nodes to begin with, along a circle and along a line.
const FIRST_ON_CIRCLE: usize = 8;
const FIRST_ON_LINE: usize = 4;

/// The range of one coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Span {
    pub(crate) low: f32,
    pub(crate) high: f32,
    pub(crate) circle: bool,
}

impl Span {
    fn first(&self) -> Axis {
        let count = if self.circle { FIRST_ON_CIRCLE } else { FIRST_ON_LINE };
        if self.circle {
            Axis::circle(self.low, count)
        } else if self.high - self.low > 1e-6 {
            Axis::uniform(self.low, (self.high - self.low) / (count - 1) as f32, count)
        } else {
            Axis::single(self.low)
        }
    }
}

/// x, y, z in metres, yaw, pitch and roll in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Coordinates(pub(crate) [f32; 6]);

impl Coordinates {
    /// Evenly distributed over the spans.
    pub(crate) fn random(spans: &[Span; 6], seed: u64, count: usize) -> Vec<Self> {
        let mut random = Random::new(seed);
        (0..count).map(|_| Self(spans.map(|s| s.low + (s.high - s.low) * random.uniform()))).collect()
    }

    pub(crate) fn pose(&self) -> Pose {
        let [x, y, z, yaw, pitch, roll] = self.0;
        Pose::from_ypr(Vec3::new(x, y, z), yaw, pitch, roll)
    }
}

/// Lines along each axis with what was decoded on them.
pub(crate) struct Lines {
    spans: [Span; 6],
    bases: Vec<Coordinates>,
    /// Coefficients by axis, line and bits of the coordinate.
    known: HashMap<(usize, usize, u32), Vec<f32>>,
}

/// One axis as it is refined.
struct Refined {
    axis: Axis,
    /// Mean square error of each interval, dB, at its middle.
    errors: Vec<f64>,
}

impl Refined {
    /// Share of the axis that an interval takes.
    fn share(&self, interval: usize) -> f64 {
        let (low, high) = ends(&self.axis, interval);
        let whole = if self.axis.is_circle() { TAU } else { self.axis.end() - self.axis.start() };
        f64::from((high - low) / whole)
    }

    fn mean(&self) -> f64 {
        self.errors.iter().enumerate().map(|(i, e)| self.share(i) * e).sum()
    }

    /// The interval that it pays most to halve, and the mean square error that this takes away for each factor of nodes.
    fn best(&self) -> Option<(usize, f64)> {
        let n = self.axis.count() as f64;
        let cost = ((n + 1.0) / n).ln();
        let gains = self.errors.iter().enumerate().map(|(i, e)| (i, self.share(i) * e / cost));
        gains.max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

fn intervals(axis: &Axis) -> usize {
    if axis.count() == 1 { 0 } else { axis.count() - usize::from(!axis.is_circle()) }
}

fn ends(axis: &Axis, interval: usize) -> (f32, f32) {
    let nodes = axis.nodes();
    (nodes[interval], nodes.get(interval + 1).copied().unwrap_or(axis.start() + TAU))
}

fn middle(axis: &Axis, interval: usize) -> f32 {
    let (low, high) = ends(axis, interval);
    0.5 * (low + high)
}

impl Lines {
    pub(crate) fn new(spans: [Span; 6], seed: u64) -> Self {
        Self { spans, bases: Coordinates::random(&spans, seed.wrapping_add(0x11E5), LINES), known: HashMap::new() }
    }

    /// Axes whose cubics come within `error_db` of root mean square, or as close as `most_nodes` allow; `None` if not even the
    /// coarsest axes have so few nodes.
    pub(crate) fn refine(
        &mut self,
        decoders: &mut Decoders<'_>,
        levels: &Shapes,
        error_db: f64,
        most_nodes: usize,
    ) -> Option<[Axis; 6]> {
        let mut axes: Vec<Refined> =
            self.spans.iter().map(|s| s.first()).map(|axis| Refined { errors: vec![], axis }).collect();
        let nodes = |axes: &[Refined]| axes.iter().map(|a| a.axis.count()).product::<usize>();
        if nodes(&axes) > most_nodes {
            return None;
        }
        for (number, axis) in axes.iter_mut().enumerate() {
            axis.errors = self.errors(number, &axis.axis, decoders, levels);
        }
        while axes.iter().map(Refined::mean).sum::<f64>() > error_db * error_db {
            let room = |a: &Refined| nodes(&axes) / a.axis.count() * (a.axis.count() + 1) <= most_nodes;
            let candidates = axes.iter().enumerate().filter(|(_, a)| room(a)).filter_map(|(n, a)| Some((n, a.best()?)));
            let Some((number, (interval, gain))) = candidates.max_by(|a, b| a.1.1.total_cmp(&b.1.1)) else { break };
            if gain <= 0.0 {
                break;
            }
            let split = &axes[number].axis;
            let mut finer = split.nodes().to_vec();
            finer.insert(interval + 1, middle(split, interval));
            // Halving an interval below the precision of its ends would not rise any more.
            let Some(finer) = Axis::new(finer, split.is_circle()) else { break };
            axes[number] = Refined { errors: self.errors(number, &finer, decoders, levels), axis: finer };
        }
        let axes: Vec<Axis> = axes.into_iter().map(|a| a.axis).collect();
        axes.try_into().ok()
    }

    /// Mean square error at the middle of each interval of an axis.
    fn errors(&mut self, number: usize, axis: &Axis, decoders: &mut Decoders<'_>, levels: &Shapes) -> Vec<f64> {
        let middles: Vec<f32> = (0..intervals(axis)).map(|i| middle(axis, i)).collect();
        self.learn(number, axis.nodes().iter().chain(&middles), decoders, levels);
        let at = |line: usize, value: f32| &self.known[&(number, line, value.to_bits())];
        let error = |line: usize, value: f32| {
            let mut found = vec![0.0; levels.rank()];
            let (nodes, count) = axis.cubic(value);
            for &(node, weight) in &nodes[..count] {
                found.iter_mut().zip(at(line, axis.nodes()[node])).for_each(|(f, c)| *f += weight * c);
            }
            // The shapes are orthonormal.
            found.iter().zip(at(line, value)).map(|(f, c)| f64::from(f - c).powi(2)).sum::<f64>() / levels.len() as f64
        };
        middles.iter().map(|m| (0..LINES).map(|line| error(line, *m)).sum::<f64>() / LINES as f64).collect()
    }

    /// Decodes what is not known yet of an axis.
    fn learn<'a>(
        &mut self,
        number: usize,
        values: impl Iterator<Item = &'a f32>,
        decoders: &mut Decoders<'_>,
        levels: &Shapes,
    ) {
        let mut asked = Vec::new();
        for value in values {
            for line in 0..LINES {
                let key = (number, line, value.to_bits());
                if !self.known.contains_key(&key) {
                    let mut place = self.bases[line];
                    place.0[number] = *value;
                    asked.push((key, place.pose()));
                }
            }
        }
        let poses: Vec<Pose> = asked.iter().map(|(_, pose)| *pose).collect();
        let found = decoders.map(&poses, |tf| levels.coefficients(&levels_db(tf)));
        self.known.extend(asked.into_iter().map(|(key, _)| key).zip(found));
    }
}
