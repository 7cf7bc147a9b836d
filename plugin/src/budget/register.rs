//! Whom the budget is shared out among: the accounts of all instances, as long as they live.

use super::Account;
use crate::worker::lock::lock;
use std::sync::{Arc, Mutex, Weak};

static ALL: Mutex<Vec<Weak<Account>>> = Mutex::new(Vec::new());

/// Adds an instance's account, once.
pub(super) fn add(account: &Arc<Account>) {
    let mut all = lock(&ALL);
    all.retain(|known| known.strong_count() > 0);
    if !all.iter().any(|known| std::ptr::eq(known.as_ptr(), Arc::as_ptr(account))) {
        all.push(Arc::downgrade(account));
    }
}

/// All of them, in the order in which they came.
pub(super) fn accounts() -> Vec<Arc<Account>> {
    lock(&ALL).iter().filter_map(Weak::upgrade).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_account_counts_once_and_as_long_as_it_lives() {
        let known = |account: &Arc<Account>| accounts().iter().filter(|held| Arc::ptr_eq(held, account)).count();
        let [first, second] = [(); 2].map(|()| Arc::<Account>::default());
        [&first, &second, &first].into_iter().for_each(add);
        assert_eq!([known(&first), known(&second)], [1, 1]);
        let gone = Arc::downgrade(&first);
        drop(first);
        assert!(gone.upgrade().is_none() && known(&second) == 1, "the register keeps nothing alive");
    }
}
