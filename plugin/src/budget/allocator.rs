//! The share of each instance: the step that takes off most error for its cost, again and again.

use super::Grant;

/// Error of what is played by grant, as a share of the source's energy: a draft lacks its room (-2 to -6 dB in the factory
/// scenes).
const ERRORS: [f32; Grant::ALL.len()] = [1.0, 0.4, 0.0];
/// What a grant costs beside the full one, as long as an instance has not played it for a while.
pub(super) const USUAL_COSTS: [f32; Grant::ALL.len()] = [0.02, 0.5, 1.0];
/// A grant that is held is worth so much more than one that is not: about 2 dB of loudness.
const HELD: f32 = 1.6;
/// Fainter than this is silence, mean square.
const SILENCE: f32 = 1e-12;

/// What is known of an instance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Claim {
    /// Mean square at the ears, played in full.
    pub(super) loudness: f32,
    /// Processor time over sound's time by grant; 0 where it is not known.
    pub(super) costs: [f32; Grant::ALL.len()],
    /// What it has now.
    pub(super) held: Grant,
    /// The most that its settings ask for.
    pub(super) most: Grant,
}

impl Claim {
    /// Costs by grant, none below the one before: what is not known is like others' of its kind.
    fn costs(&self) -> [f32; Grant::ALL.len()] {
        let known = |&grant: &Grant| self.costs[grant as usize] > 0.0;
        let scale = Grant::ALL[1..]
            .iter()
            .rev()
            .copied()
            .find(known)
            .map_or(0.0, |grant| self.costs[grant as usize] / USUAL_COSTS[grant as usize]);
        let mut costs = self.costs;
        let mut least = 0.0_f32;
        for (cost, usual) in costs.iter_mut().zip(USUAL_COSTS) {
            *cost = if *cost > 0.0 { *cost } else { usual * scale }.max(least);
            least = *cost;
        }
        costs
    }
}

/// What each may play when all together may take `limit`, in seconds of one core per second of sound.
///
/// Greedy by the energy that a step puts right per processor time. Silent instances sleep and cost nothing; each may begin with
/// as much as is left, and with the direct sound at least.
pub(super) fn allocate(claims: &[Claim], limit: f32) -> Vec<Grant> {
    let costs: Vec<_> = claims.iter().map(Claim::costs).collect();
    let sounds = |claim: &Claim| claim.loudness > SILENCE;
    let start = |claim: &Claim| if sounds(claim) { Grant::Nothing } else { Grant::Draft };
    let mut grants: Vec<Grant> = claims.iter().map(start).collect();
    let waiting = claims.iter().zip(&costs).filter(|(claim, _)| sounds(claim)).map(|(_, costs)| costs[0]);
    let mut left = limit - waiting.sum::<f32>();
    loop {
        let mut best: Option<(f32, usize, Grant)> = None;
        for (index, claim) in claims.iter().enumerate().filter(|(_, claim)| sounds(claim)) {
            let now = grants[index];
            for next in Grant::ALL.into_iter().filter(|next| *next > now && *next <= claim.most) {
                let cost = costs[index][next as usize] - costs[index][now as usize];
                if cost > left {
                    continue;
                }
                let held = if next <= claim.held { HELD } else { 1.0 };
                let error = ERRORS[now as usize] - ERRORS[next as usize];
                let worth = held * claim.loudness * error / cost.max(1e-6);
                if best.is_none_or(|(most, ..)| worth > most) {
                    best = Some((worth, index, next));
                }
            }
        }
        let Some((_, index, next)) = best else { break };
        left -= costs[index][next as usize] - costs[index][grants[index] as usize];
        grants[index] = next;
    }
    for ((grant, claim), costs) in grants.iter_mut().zip(claims).zip(&costs).filter(|((_, claim), _)| !sounds(claim)) {
        *grant = if costs[claim.most as usize] <= left { claim.most } else { Grant::Draft };
    }
    grants
}

#[cfg(test)]
mod tests {
    use super::*;

    const COSTS: [f32; 3] = [0.0001, 0.002, 0.005];

    fn claim(loudness: f32) -> Claim {
        Claim { loudness, costs: COSTS, held: Grant::Full, most: Grant::Full }
    }

    fn cost(grants: &[Grant]) -> f32 {
        grants.iter().map(|grant| COSTS[*grant as usize]).sum()
    }

    #[test]
    fn enough_for_all_is_given_to_all() {
        let claims = [claim(1e-3), claim(1e-9), claim(1e-6)];
        assert_eq!(allocate(&claims, 0.0151), [Grant::Full; 3]);
    }

    #[test]
    fn the_loud_come_first_and_the_limit_holds() {
        let claims: Vec<_> = (0..12).map(|n| claim(10_f32.powf(-0.5 * n as f32))).collect();
        for limit in [0.0, 0.002, 0.01, 0.02, 0.03, 0.05] {
            let grants = allocate(&claims, limit);
            assert!(grants.windows(2).all(|pair| pair[0] >= pair[1]), "{limit}: {grants:?}");
            assert!(cost(&grants) <= limit.max(12.0 * COSTS[0]) + 1e-6, "{limit}: {grants:?}");
        }
        assert_eq!(allocate(&claims, 0.01)[11], Grant::Nothing);
    }

    #[test]
    fn a_grant_is_kept_until_another_is_clearly_louder() {
        let limit = COSTS[1] + COSTS[0] + 1e-5;
        let pair = |first: f32, held: [Grant; 2]| {
            let drafts = |loudness, held| Claim { held, most: Grant::Draft, ..claim(loudness) };
            allocate(&[drafts(first, held[0]), drafts(1e-4, held[1])], limit)
        };
        let first = [Grant::Draft, Grant::Nothing];
        let second = [Grant::Nothing, Grant::Draft];
        assert_eq!(pair(1.3e-4, first), first);
        assert_eq!(pair(1.3e-4, second), second, "changed at once");
        assert_eq!(pair(4e-4, second), first, "never changed");
    }

    #[test]
    fn the_silent_cost_nothing_and_begin_at_once() {
        let claims = [claim(0.0), claim(1e-4), claim(0.0)];
        assert_eq!(allocate(&claims, COSTS[2] + 1e-6), [Grant::Draft, Grant::Full, Grant::Draft]);
        assert_eq!(allocate(&claims, 2.0 * COSTS[2] + 1e-6), [Grant::Full; 3], "each may begin with what is left");
    }

    #[test]
    fn nobody_gets_more_than_is_set() {
        let claims = [Claim { most: Grant::Draft, ..claim(1.0) }];
        assert_eq!(allocate(&claims, 1.0), [Grant::Draft]);
    }

    #[test]
    fn what_is_not_known_is_like_others_of_its_kind() {
        let unknown = Claim { costs: [0.0, 0.0, 0.01], ..claim(1.0) };
        assert_eq!(allocate(&[unknown], 0.0101), [Grant::Full]);
        assert_eq!(allocate(&[unknown], 0.008), [Grant::Draft]);
        let new = Claim { costs: [0.0; 3], ..claim(1.0) };
        assert_eq!(allocate(&[new], 0.001), [Grant::Full], "measured first");
    }
}
