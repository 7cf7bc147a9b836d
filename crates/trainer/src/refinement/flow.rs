//! What is learnt, and how it is solved: from the simulated levels to the measured ones.

use promenade_core::random::Random;

/// The last stretch of time, in which a flow that predicts data is not divided further.
const LEAST: f32 = 1e-3;

/// What a refinement learns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The difference between measured and simulated levels.
    Regression,
    /// The difference between measured and simulated levels, with noise added to what the network is given, as flows have it.
    NoisyRegression,
    /// The flow of pi-AVAS (equations 3 to 6): a path with constant noise, whose velocity is predicted.
    Flow,
    /// A path whose noise vanishes at its end, of which the end is predicted.
    DataFlow,
}

impl Method {
    /// Whether what it gives is a draw.
    #[must_use]
    pub fn is_drawn(self) -> bool {
        matches!(self, Self::Flow | Self::DataFlow)
    }
}

/// How a flow is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solver {
    /// First order, so many steps.
    Euler(usize),
    /// Second order: the velocity in the middle of each step.
    Midpoint(usize),
    /// Second order: the mean of the velocities at both ends of each step.
    Heun(usize),
}

/// From one set of levels to another.
#[derive(Clone, Copy)]
pub(super) struct Path {
    pub(super) method: Method,
    pub(super) sigma: f32,
}

impl Path {
    /// A time, where the path is at it, and what the network should say there.
    pub(super) fn drawn(self, from: &[f32], to: &[f32], random: &mut Random) -> (f32, Vec<f32>, Vec<f32>) {
        let t = random.uniform();
        let difference = || from.iter().zip(to).map(|(a, b)| b - a).collect();
        let mut noisy = |x: f32, share: f32| x + self.sigma * share * random.normal();
        match self.method {
            Method::Regression => (0.0, from.to_vec(), difference()),
            Method::NoisyRegression => (0.0, from.iter().map(|x| noisy(*x, 1.0)).collect(), difference()),
            Method::Flow | Method::DataFlow => {
                let is_data = self.method == Method::DataFlow;
                let share = if is_data { 1.0 - t } else { 1.0 };
                let at = from.iter().zip(to).map(|(a, b)| noisy(a + t * (b - a), share)).collect();
                (t, at, if is_data { to.to_vec() } else { difference() })
            }
        }
    }

    /// The end of the path from the simulated levels on, by what the network says at a place and a time.
    ///
    /// # Errors
    /// Those of the network.
    pub(super) fn solved<E>(
        self,
        from: &[f32],
        solver: Solver,
        random: &mut Random,
        mut network: impl FnMut(&[f32], f32) -> Result<Vec<f32>, E>,
    ) -> Result<Vec<f32>, E> {
        let is_data = self.method == Method::DataFlow;
        if matches!(self.method, Method::Regression | Method::NoisyRegression) {
            return Ok(along(from, &network(from, 0.0)?, 1.0));
        }
        let mut velocity = |x: &[f32], t: f32| {
            let mut said = network(x, t)?;
            if is_data {
                said.iter_mut().zip(x).for_each(|(end, x)| *end = (*end - x) / (1.0 - t).max(LEAST));
            }
            Ok(said)
        };
        let mut x: Vec<f32> = from.iter().map(|x| x + self.sigma * random.normal()).collect();
        let (Solver::Euler(steps) | Solver::Midpoint(steps) | Solver::Heun(steps)) = solver;
        for step in 0..steps {
            let (t, dt) = (step as f32 / steps as f32, 1.0 / steps as f32);
            let first = velocity(&x, t)?;
            let is_last = step + 1 == steps;
            x = match solver {
                Solver::Midpoint(_) => {
                    let middle = velocity(&along(&x, &first, 0.5 * dt), t + 0.5 * dt)?;
                    along(&x, &middle, dt)
                }
                // At the end of a path that ends in the data there is no velocity.
                Solver::Heun(_) if !(is_data && is_last) => {
                    let second = velocity(&along(&x, &first, dt), t + dt)?;
                    let mean: Vec<f32> = first.iter().zip(&second).map(|(a, b)| 0.5 * (a + b)).collect();
                    along(&x, &mean, dt)
                }
                _ => along(&x, &first, dt),
            };
        }
        Ok(x)
    }
}

fn along(x: &[f32], velocity: &[f32], dt: f32) -> Vec<f32> {
    x.iter().zip(velocity).map(|(x, v)| x + dt * v).collect()
}
