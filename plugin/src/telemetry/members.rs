//! The instances of a process: which of them share a listener group, and the share of the budget of each.

use crate::budget::{Account, Grant};
use crate::parameter::{Parameter, cast::index, choices::GroupChoice};
use crate::project::leader::{MOVING, SavedLeader};
use crate::project::params::PromenadeParams;
use crate::telemetry::host_side::{HostSide, Track};
use crate::worker::lock::lock;
use nice_plug::prelude::Enum;
use std::sync::{Arc, Mutex, Weak};

/// An instance by what is known of it, as long as it lives.
struct Known {
    params: Weak<PromenadeParams>,
    side: Weak<HostSide>,
    account: Weak<Account>,
}

static ALL: Mutex<Vec<Known>> = Mutex::new(Vec::new());

/// An instance of a group.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    /// The track that it is on.
    pub track: Track,
    /// Whether it is asked to lead.
    pub leads: bool,
}

/// Adds an instance, once.
pub fn join(params: &Arc<PromenadeParams>, side: &Arc<HostSide>, account: &Arc<Account>) {
    let mut all = lock(&ALL);
    all.retain(|known| known.params.strong_count() > 0);
    if !all.iter().any(|known| std::ptr::eq(known.params.as_ptr(), Arc::as_ptr(params))) {
        let (params, side) = (Arc::downgrade(params), Arc::downgrade(side));
        if let Some(of) = params.upgrade() {
            let theirs = params.clone();
            of.leader.find_by(move || theirs.upgrade().and_then(|params| leader_of(&params)));
        }
        all.push(Known { params, side, account: Arc::downgrade(account) });
    }
}

/// An instance that takes part in the budget.
#[derive(Clone, Debug, PartialEq)]
pub struct Spending {
    /// The track that it is on.
    pub track: Track,
    /// What it may play.
    pub grant: Grant,
    /// What that takes, share of one core; 0 before it was measured.
    pub cost: f32,
}

/// The share of each, in the order in which they came.
pub fn spending() -> Vec<Spending> {
    let alive = |known: &Known| Some((known.side.upgrade()?, known.account.upgrade()?));
    let all: Vec<_> = lock(&ALL).iter().filter_map(alive).collect();
    all.into_iter()
        .map(|(side, account)| Spending { track: side.track(), grant: account.held(), cost: account.cost() })
        .collect()
}

/// The key of the group that an instance is in.
fn group_of(params: &PromenadeParams) -> Option<u64> {
    let group = GroupChoice::from_index(index(params.heard(Parameter::Group))).number();
    group.map(|number| params.project.group(number))
}

/// What moves the leader that an instance follows; none where it leads or is in no group, nothing without a leader here.
fn leader_of(of: &PromenadeParams) -> Option<Option<SavedLeader>> {
    let all: Vec<_> = lock(&ALL).iter().filter_map(|known| known.params.upgrade()).collect();
    let leads = |params: &PromenadeParams| params.heard(Parameter::Lead) > 0.5;
    let Some(group) = group_of(of).filter(|_| !leads(of)) else { return Some(None) };
    let leader = all.iter().find(|other| leads(other) && group_of(other) == Some(group))?;
    let values = MOVING.map(|parameter| leader.heard(parameter));
    Some(Some(SavedLeader { values, walk: leader.saved_walk.get().0 }))
}

/// The instances of a group by its key, in the order in which they came.
pub fn of_group(key: u64) -> Vec<Member> {
    let alive = |known: &Known| Some((known.params.upgrade()?, known.side.upgrade()?));
    let all: Vec<_> = lock(&ALL).iter().filter_map(alive).collect();
    let members = all.into_iter().filter(|(params, _)| group_of(params) == Some(key));
    members.map(|(params, side)| Member { track: side.track(), leads: params.heard(Parameter::Lead) > 0.5 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nice_plug::params::persist::PersistentField;

    #[test]
    fn a_group_lists_its_instances_as_long_as_they_live() {
        let instance = |name: &str, leads: bool| {
            let (params, side) = (Arc::new(PromenadeParams::default()), Arc::new(HostSide::default()));
            side.set_track(Track { name: name.to_owned(), colour: Some([1, 2, 3]) });
            params.remote.set(Parameter::Group, GroupChoice::D.to_index() as f32, 0.0);
            params.remote.set(Parameter::Lead, f32::from(u8::from(leads)), 0.0);
            let account = Arc::default();
            join(&params, &side, &account);
            join(&params, &side, &account);
            (params, side)
        };
        let (first, second) = (instance("Violin", false), instance("Choir", true));
        let key = PromenadeParams::default().project.group(3);
        let names = || of_group(key).into_iter().map(|m| (m.track.name, m.leads)).collect::<Vec<_>>();
        assert_eq!(names(), [("Violin".to_owned(), false), ("Choir".to_owned(), true)]);
        second.0.remote.set(Parameter::X, 2.5, 0.0);
        let found = |params: &PromenadeParams| params.leader.map(Clone::clone);
        assert_eq!(found(&second.0), None, "who leads follows nobody");
        assert_eq!(found(&first.0).map(|leader| leader.values[0]), Some(2.5));
        drop(first);
        assert_eq!(names(), [("Choir".to_owned(), true)]);
        drop(second);
        assert_eq!(names(), []);
    }
}
