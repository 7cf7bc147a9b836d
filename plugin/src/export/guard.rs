//! Panics end here: one that left a function which a host calls would end the host.

use std::panic::{AssertUnwindSafe, catch_unwind};

/// Does something for a host; after a panic, which the framework's hook has logged, the host gets the fallback.
pub(crate) fn guard<T>(fallback: T, done: impl FnOnce() -> T) -> T {
    catch_unwind(AssertUnwindSafe(done)).unwrap_or(fallback)
}

/// Whether something has panicked, and may be half changed.
#[derive(Default)]
pub(crate) struct Fuse {
    blown: bool,
}

impl Fuse {
    /// Does something, unless anything has panicked before; none after a panic.
    pub(crate) fn run<T>(&mut self, done: impl FnOnce() -> T) -> Option<T> {
        if self.blown {
            return None;
        }
        let done = guard(None, || Some(done()));
        self.blown = done.is_none();
        done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn after_a_panic_nothing_is_done_any_more() {
        let mut fuse = Fuse::default();
        assert_eq!(fuse.run(|| 1), Some(1));
        assert_eq!(fuse.run(|| [1, 2][..].iter().map(|n| 2 / (n - 1)).sum::<i32>()), None);
        assert_eq!(fuse.run(|| 1), None);
        assert_eq!(guard(3, || panic!("for a test")), 3);
    }
}
