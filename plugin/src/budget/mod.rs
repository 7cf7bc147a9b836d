//! A budget of processor time that all instances of the process share, spent where it is heard.
//!
//! An allocator off the audio threads looks at all instances some times a second and grants each what it may play ([`Grant`]),
//! by how loud it is at the ears and what it costs. Without a limit nobody is asked and everything is played as it is set.

mod account;
mod allocator;
mod grant;
pub mod limit;
mod register;
mod spender;
mod stop_watch;

pub use account::Account;
pub use grant::Grant;
pub(crate) use spender::Spender;

use crate::budget::limit::{ALLOCATION, limit_percent};
use crate::worker::{ALLOCATOR, Task, TaskHandle, lock::lock};
use allocator::allocate;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time between two looks at all instances.
const PERIOD: Duration = Duration::from_millis(100);
/// The allocator, for an instance to hold as long as it may play.
///
/// # Errors
/// The system gives no thread.
fn join() -> std::io::Result<Arc<TaskHandle>> {
    let mut held = lock(&ALLOCATION);
    if let Some(handle) = held.upgrade() {
        return Ok(handle);
    }
    let handle = Arc::new(ALLOCATOR.add(Arc::new(Allocation))?);
    *held = Arc::downgrade(&handle);
    handle.schedule();
    Ok(handle)
}

/// One look at all instances.
struct Allocation;

impl Task for Allocation {
    fn run(&self) -> Option<Instant> {
        let percent = limit_percent()?;
        let accounts = register::accounts();
        let claims: Vec<_> = accounts.iter().map(|account| account.claim()).collect();
        for (account, grant) in accounts.iter().zip(allocate(&claims, percent / 100.0)) {
            account.give(grant);
        }
        Some(Instant::now() + PERIOD)
    }
}
