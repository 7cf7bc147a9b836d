//! Answers to questions that take long, once a question has not changed for a while.

use crate::worker::{Task, lock::lock, repaint::Repaint};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// What is asked.
pub trait Question: Send + Sync {
    /// What is found.
    type Answer: Send + Sync;
    /// A question is answered when it has not changed for so long.
    const REST: Duration;

    /// Whether the answer is the same but for differences that no picture shows.
    fn is_like(&self, other: &Self) -> bool;
    /// Finds the answer, as long as it is `wanted`.
    fn answer(&self, wanted: &dyn Fn() -> bool) -> Option<Self::Answer>;
}

/// A question with its answer.
type Answered<Q> = (Arc<Q>, Arc<<Q as Question>::Answer>);

/// The newest question and the newest answer; a worker goes from one to the other.
pub struct Settled<Q: Question> {
    asked: Mutex<Option<(Arc<Q>, Instant)>>,
    newest: Mutex<Option<Answered<Q>>>,
    repaint: Repaint,
}

impl<Q: Question> Settled<Q> {
    /// Nothing is asked yet; `repaint` is asked for a picture when there is an answer.
    pub fn new(repaint: Repaint) -> Arc<Self> {
        Arc::new(Self { asked: Mutex::new(None), newest: Mutex::new(None), repaint })
    }

    /// Asks in place of what was asked before. Returns whether that is new, so that the worker is to be woken.
    pub fn ask(&self, question: Q) -> bool {
        let mut asked = lock(&self.asked);
        let same = asked.as_ref().is_some_and(|(old, _)| old.is_like(&question));
        if !same {
            *asked = Some((Arc::new(question), Instant::now()));
        }
        !same
    }

    /// Asks nothing any more: an answer that is being found is given up.
    pub fn withdraw(&self) {
        *lock(&self.asked) = None;
    }

    /// The newest answer with its question.
    pub fn newest(&self) -> Option<Answered<Q>> {
        lock(&self.newest).clone()
    }

    /// Whether the newest answer is that to the newest question.
    pub fn is_fresh(&self) -> bool {
        let asked = lock(&self.asked).as_ref().map(|(question, _)| Arc::clone(question));
        let newest = self.newest();
        asked.zip(newest).is_some_and(|(asked, (of, _))| Arc::ptr_eq(&asked, &of))
    }
}

impl<Q: Question> Task for Settled<Q> {
    fn run(&self) -> Option<Instant> {
        let (question, since) = lock(&self.asked).clone()?;
        if self.is_fresh() {
            return None;
        }
        let due = since + Q::REST;
        if Instant::now() < due {
            return Some(due);
        }
        let wanted = || lock(&self.asked).as_ref().is_some_and(|(newest, _)| Arc::ptr_eq(newest, &question));
        // Another question meanwhile has scheduled the task again.
        let answer = question.answer(&wanted)?;
        *lock(&self.newest) = Some((question, Arc::new(answer)));
        self.repaint.request_repaint();
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Double(f32);

    impl Question for Double {
        type Answer = f32;
        const REST: Duration = Duration::from_millis(200);

        fn is_like(&self, other: &Self) -> bool {
            (self.0 - other.0).abs() < 0.1
        }

        fn answer(&self, wanted: &dyn Fn() -> bool) -> Option<f32> {
            wanted().then_some(2.0 * self.0)
        }
    }

    #[test]
    fn a_question_is_answered_once_it_rests_and_a_like_one_is_no_other() {
        let settled = Settled::<Double>::new(Repaint::default());
        assert!(settled.run().is_none() && settled.newest().is_none());
        assert!(settled.ask(Double(1.0)) && settled.ask(Double(3.0)) && !settled.ask(Double(3.05)));
        let due = settled.run().expect("it was asked just now");
        std::thread::sleep(due.saturating_duration_since(Instant::now()) + Duration::from_millis(1));
        assert!(!settled.is_fresh() && settled.run().is_none());
        assert_eq!(settled.newest().map(|(of, found)| (of.0, *found)), Some((3.0, 6.0)));
        assert!(settled.is_fresh() && settled.run().is_none());
        settled.ask(Double(4.0));
        assert!(!settled.is_fresh() && settled.newest().is_some(), "the old answer is kept until there is another");
        settled.withdraw();
        assert!(settled.run().is_none());
        assert_eq!(settled.newest().map(|(_, found)| *found), Some(6.0));
    }
}
