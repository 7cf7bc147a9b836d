//! The share of each instance: the step that takes off most error for its cost, again and again.

use super::Grant;

/// Bands in which instances mask each other.
pub(super) const BANDS: usize = 4;
/// What one that waits takes of its whole cost.
const WAITING: f32 = 0.02;
/// What is missing is off by no more than this, dB.
const MOST_DB: f32 = 20.0;
/// Bands so much fainter than the loudest are not heard: -40 dB.
const FAINT: f32 = 1e-4;
/// A grant that is held is worth so much more than one that is not: about 2 dB of loudness.
const HELD: f32 = 1.6;
/// Fainter than this is silence, mean square.
const SILENCE: f32 = 1e-12;

/// What a grant takes of the whole cost, and how far off it is, in differences that are just noticed, each about a decibel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) share: f32,
    pub(super) jnds: f32,
}

/// What is known of an instance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Claim {
    /// Mean squares at the ears by band, played in full.
    pub(super) powers: [f32; BANDS],
    /// Processor time over sound's time of all of the scene; 0 where it is not known.
    pub(super) whole: f32,
    /// What its scene can be played for by grant; of one that waits they do not count.
    pub(super) points: [Point; Grant::COUNT],
    /// What it has now.
    pub(super) held: Grant,
    /// The one grant besides waiting that it may have for now, because it has just been given it.
    pub(super) kept: Option<Grant>,
    /// The most that its settings ask for.
    pub(super) most: Grant,
}

impl Claim {
    fn sounds(&self) -> bool {
        self.powers.iter().sum::<f32>() > SILENCE
    }

    fn cost(&self, grant: Grant) -> f32 {
        self.whole * if grant == Grant::WAITS { WAITING } else { self.points[usize::from(grant.index())].share }
    }

    /// What the mix, of so much in each band, is off by with a grant, mean of the bands that are heard, dB. What is louder in a
    /// band hides it there.
    fn error(&self, grant: Grant, mix: &[f32; BANDS]) -> f32 {
        let loudest = mix.iter().copied().fold(0.0, f32::max);
        let heard = self.powers.iter().zip(mix).filter(|(_, all)| **all > FAINT * loudest);
        let off = |(own, all): (&f32, &f32)| {
            let share = own / all;
            if grant == Grant::WAITS {
                (-10.0 * (1.0 - share).max(1e-6).log10()).min(MOST_DB)
            } else {
                share * self.points[usize::from(grant.index())].jnds
            }
        };
        let (sum, count) = heard.map(off).fold((0.0, 0.0_f32), |(sum, count), off| (sum + off, count + 1.0));
        sum / count.max(1.0)
    }

    fn may_have(&self, grant: Grant) -> bool {
        grant <= self.most && self.kept.is_none_or(|kept| grant == kept.min(self.most))
    }
}

/// What each may play when all together may take `limit`, in seconds of one core per second of sound.
///
/// Greedy by what a step takes off the error of the mix per processor time. Silent instances sleep and cost nothing; each may
/// begin with what it has.
pub(super) fn allocate(claims: &[Claim], limit: f32) -> Vec<Grant> {
    let mut mix = [0.0; BANDS];
    claims.iter().for_each(|claim| mix.iter_mut().zip(claim.powers).for_each(|(all, own)| *all += own));
    let mut left = limit - claims.iter().filter(|claim| claim.sounds()).map(|claim| claim.cost(Grant::WAITS)).sum::<f32>();
    let start = |claim: &Claim| if claim.sounds() { Grant::WAITS } else { claim.held.max(Grant::LEAST) };
    let mut grants: Vec<Grant> = claims.iter().map(start).collect();
    loop {
        let mut best: Option<(f32, usize, Grant)> = None;
        for (index, claim) in claims.iter().enumerate().filter(|(_, claim)| claim.sounds()) {
            let now = grants[index];
            for next in Grant::all().filter(|next| *next > now && claim.may_have(*next)) {
                let cost = claim.cost(next) - claim.cost(now);
                if cost > left {
                    continue;
                }
                let held = if next <= claim.held { HELD } else { 1.0 };
                let worth = held * (claim.error(now, &mix) - claim.error(next, &mix)) / cost.max(1e-6);
                if best.is_none_or(|(most, ..)| worth > most) {
                    best = Some((worth, index, next));
                }
            }
        }
        let Some((_, index, next)) = best else { return grants };
        left -= claims[index].cost(next) - claims[index].cost(grants[index]);
        grants[index] = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHOLE: f32 = 0.005;

    fn claim(power: f32) -> Claim {
        let shares = [0.0, 0.4, 0.5, 0.65, 0.8, 1.0].into_iter().zip([0.0, 2.0, 1.0, 0.5, 0.25, 0.0]);
        let mut points = shares.map(|(share, jnds)| Point { share, jnds });
        let points = std::array::from_fn(|_| points.next().unwrap());
        Claim { powers: [power; BANDS], whole: WHOLE, points, held: Grant::FULL, kept: None, most: Grant::FULL }
    }

    fn cost(claims: &[Claim], grants: &[Grant]) -> f32 {
        claims.iter().zip(grants).map(|(claim, grant)| claim.cost(*grant)).sum()
    }

    #[test]
    fn enough_for_all_is_given_to_all() {
        let claims = [claim(1e-3), claim(1e-9), claim(1e-6)];
        assert_eq!(allocate(&claims, 0.0151), [Grant::FULL; 3]);
        let new = Claim { whole: 0.0, ..claim(1.0) };
        assert_eq!(allocate(&[new], 0.001), [Grant::FULL], "measured first");
    }

    #[test]
    fn the_loud_come_first_and_the_limit_holds() {
        let claims: Vec<_> = (0..12).map(|n| claim(10_f32.powf(-0.5 * n as f32))).collect();
        for limit in [0.0, 0.002, 0.01, 0.02, 0.03, 0.05] {
            let grants = allocate(&claims, limit);
            assert!(grants[0] >= grants[1] && grants[1] >= grants[11], "{limit}: {grants:?}");
            assert!(cost(&claims, &grants) <= limit.max(12.0 * WAITING * WHOLE) + 1e-6, "{limit}: {grants:?}");
        }
        assert_eq!(allocate(&claims, 0.01)[11], Grant::WAITS);
        // Half of the cost is enough for all of equal loudness, none of which has to wait.
        let grants = allocate(&[claim(1e-3); 12], 6.0 * WHOLE);
        assert!(grants.iter().all(|grant| *grant >= Grant::LEAST), "{grants:?}");
    }

    #[test]
    fn what_others_hide_waits_before_what_is_heard_alone() {
        let mut masked = claim(0.0);
        masked.powers[0] = 1e-4;
        let mut alone = claim(0.0);
        alone.powers[3] = 1e-5;
        let mut loud = claim(0.0);
        loud.powers[0] = 1e-2;
        let limit = WHOLE * (1.0 + 0.4 + 3.0 * WAITING);
        let [loud, alone, masked] = allocate(&[loud, alone, masked], limit)[..] else { panic!() };
        assert!(loud > Grant::WAITS && alone > Grant::WAITS && masked == Grant::WAITS, "{loud:?}, {alone:?}, {masked:?}");
    }

    #[test]
    fn a_grant_is_kept_until_another_is_clearly_louder() {
        let limit = WHOLE * (0.4 + 2.0 * WAITING) + 1e-6;
        let pair = |first: f32, held: [Grant; 2]| {
            let least = |power, held| Claim { held, most: Grant::LEAST, ..claim(power) };
            allocate(&[least(first, held[0]), least(1e-4, held[1])], limit)
        };
        let first = [Grant::LEAST, Grant::WAITS];
        let second = [Grant::WAITS, Grant::LEAST];
        assert_eq!(pair(1.2e-4, first), first);
        assert_eq!(pair(1.2e-4, second), second, "changed at once");
        assert_eq!(pair(4e-4, second), first, "never changed");
        // What has just changed stays, or waits.
        let half = Grant::of_index(3);
        let kept = Claim { kept: Some(half), held: half, ..claim(1.0) };
        assert_eq!((allocate(&[kept], 1.0), allocate(&[kept], 0.002)), (vec![half], vec![Grant::WAITS]));
    }

    #[test]
    fn the_silent_cost_nothing_and_begin_at_once() {
        let waits = Claim { held: Grant::WAITS, ..claim(0.0) };
        let claims = [claim(0.0), claim(1e-4), waits];
        assert_eq!(allocate(&claims, WHOLE + 1e-6), [Grant::FULL, Grant::FULL, Grant::LEAST]);
    }

    #[test]
    fn nobody_gets_more_than_is_set() {
        let most = Grant::of_index(3);
        assert_eq!(allocate(&[Claim { most, ..claim(1.0) }], 1.0), [most]);
    }
}
