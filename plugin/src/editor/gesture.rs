//! Automation gestures: every value that the editor sets lies between one begin and one end.

use crate::parameter::Parameter;

/// A gesture that nothing has moved for this long is over, seconds: wheel and arrow keys have no release of their own.
const REST_S: f64 = 0.4;

/// What receives gestures: the host.
pub trait Automation {
    /// The user takes hold of a parameter.
    fn begin(&self, parameter: Parameter);
    /// A plain value, as [`crate::project::params::PromenadeParams::hosted`] counts.
    fn set(&self, parameter: Parameter, plain: f32);
    /// The user lets go.
    fn end(&self, parameter: Parameter);
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Until {
    /// Until a frame does not hold it; whether this one has.
    Released(bool),
    /// A time, seconds.
    Time(f64),
}

#[derive(Clone, Copy, Debug)]
struct Open {
    value: f32,
    until: Until,
}

/// The gestures that are going on.
#[derive(Debug)]
pub struct Gestures {
    open: [Option<Open>; Parameter::EVERY.len()],
    /// Values that the host was sent and may not have taken yet.
    sent: [Option<f32>; Parameter::EVERY.len()],
}

impl Default for Gestures {
    fn default() -> Self {
        Self { open: [const { None }; Parameter::EVERY.len()], sent: [None; Parameter::EVERY.len()] }
    }
}

impl Gestures {
    /// The value that the user has set and the host may not have taken yet.
    pub fn value(&self, parameter: Parameter) -> Option<f32> {
        self.open[parameter.number()].map(|open| open.value)
    }

    /// Sets a value while the pointer is down; to be called each frame, moved or not, until it is released.
    pub fn hold(&mut self, host: &dyn Automation, parameter: Parameter, value: f32) {
        self.move_to(host, parameter, value, Until::Released(true));
    }

    /// Sets a value by a step of the wheel or a key; more steps in quick succession are one gesture.
    pub fn nudge(&mut self, host: &dyn Automation, parameter: Parameter, value: f32, now_s: f64) {
        self.move_to(host, parameter, value, Until::Time(now_s + REST_S));
    }

    /// Sets a value at once.
    pub fn set(&mut self, host: &dyn Automation, parameter: Parameter, value: f32) {
        if self.open[parameter.number()].is_some() {
            self.move_to(host, parameter, value, Until::Released(false));
        } else {
            host.begin(parameter);
            host.set(parameter, value);
            host.end(parameter);
            self.sent[parameter.number()] = Some(value);
        }
    }

    fn move_to(&mut self, host: &dyn Automation, parameter: Parameter, value: f32, until: Until) {
        let place = &mut self.open[parameter.number()];
        let moved = match place {
            Some(open) => open.value != value,
            None => {
                host.begin(parameter);
                true
            }
        };
        if moved {
            host.set(parameter, value);
            self.sent[parameter.number()] = Some(value);
        }
        *place = Some(Open { value, until });
    }

    /// Ends what was not held in this frame or has rested. Seconds until the next is to end, if one rests.
    pub fn end_frame(&mut self, host: &dyn Automation, now_s: f64) -> Option<f64> {
        let mut next: Option<f64> = None;
        for (parameter, place) in Parameter::EVERY.into_iter().zip(&mut self.open) {
            let Some(open) = place else { continue };
            let over = match &mut open.until {
                Until::Released(held) => !std::mem::take(held),
                Until::Time(end_s) => {
                    let left_s = *end_s - now_s;
                    next = Some(next.unwrap_or(left_s).min(left_s)).filter(|s| *s > 0.0);
                    left_s <= 0.0
                }
            };
            if over {
                host.end(parameter);
                *place = None;
            }
        }
        next
    }

    /// Whether none is going on.
    pub fn are_over(&self) -> bool {
        self.open.iter().all(Option::is_none)
    }

    /// Whether the host has taken all values that it was sent; `has` says whether it has one.
    pub fn have_landed(&mut self, has: impl Fn(Parameter, f32) -> bool) -> bool {
        for (parameter, sent) in Parameter::EVERY.into_iter().zip(&mut self.sent) {
            *sent = sent.filter(|value| !has(parameter, *value));
        }
        self.sent.iter().all(Option::is_none)
    }

    /// Waits for no value any more that the host was sent.
    pub fn forget_sent(&mut self) {
        self.sent.fill(None);
    }

    /// Ends all of them.
    pub fn close(&mut self, host: &dyn Automation) {
        for (parameter, place) in Parameter::EVERY.into_iter().zip(&mut self.open) {
            if place.take().is_some() {
                host.end(parameter);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;

    #[derive(Default)]
    struct Log(RefCell<Vec<String>>);

    impl Log {
        fn take(&self) -> String {
            self.0.take().join(" ")
        }
    }

    impl Automation for Log {
        fn begin(&self, parameter: Parameter) {
            self.0.borrow_mut().push(format!("+{}", parameter.id()));
        }
        fn set(&self, parameter: Parameter, plain: f32) {
            self.0.borrow_mut().push(format!("{}={plain}", parameter.id()));
        }
        fn end(&self, parameter: Parameter) {
            self.0.borrow_mut().push(format!("-{}", parameter.id()));
        }
    }

    #[test]
    fn a_drag_is_one_gesture_and_a_rest_within_it_sets_nothing() {
        let (log, mut gestures) = (Log::default(), Gestures::default());
        for value in [1.0, 1.0, 2.0] {
            gestures.hold(&log, Parameter::X, value);
            assert_eq!(gestures.end_frame(&log, 0.0), None);
        }
        assert_eq!(gestures.value(Parameter::X), Some(2.0));
        gestures.end_frame(&log, 0.0);
        assert_eq!(log.take(), "+x x=1 x=2 -x");
        assert_eq!(gestures.value(Parameter::X), None);
        gestures.end_frame(&log, 0.0);
        assert_eq!(log.take(), "");
    }

    #[test]
    fn steps_in_quick_succession_are_one_gesture() {
        let (log, mut gestures) = (Log::default(), Gestures::default());
        for now_s in [0.0, 0.3, 0.6] {
            gestures.nudge(&log, Parameter::Yaw, now_s as f32, now_s);
            assert!(gestures.end_frame(&log, now_s).is_some_and(|s| s > 0.0));
        }
        assert!(gestures.end_frame(&log, 0.9).is_some());
        assert_eq!(gestures.end_frame(&log, 1.1), None);
        assert_eq!(log.take(), "+yaw yaw=0 yaw=0.3 yaw=0.6 -yaw");
    }

    #[test]
    fn a_value_at_once_has_a_gesture_of_its_own_or_joins_one() {
        let (log, mut gestures) = (Log::default(), Gestures::default());
        gestures.set(&log, Parameter::Accuracy, 2.0);
        assert_eq!(log.take(), "+accuracy accuracy=2 -accuracy");
        gestures.hold(&log, Parameter::Accuracy, 1.0);
        gestures.set(&log, Parameter::Accuracy, 3.0);
        gestures.end_frame(&log, 0.0);
        assert_eq!(log.take(), "+accuracy accuracy=1 accuracy=3 -accuracy");
    }

    #[test]
    fn values_have_landed_once_the_host_has_all_of_them() {
        let (log, mut gestures) = (Log::default(), Gestures::default());
        assert!(gestures.have_landed(|_, _| false), "none was sent");
        gestures.set(&log, Parameter::Slot, 2.0);
        gestures.hold(&log, Parameter::X, 1.0);
        gestures.hold(&log, Parameter::X, 1.5);
        assert!(!gestures.have_landed(|parameter, value| parameter == Parameter::X && value == 1.5));
        assert!(gestures.have_landed(|parameter, value| parameter == Parameter::Slot && value == 2.0));
        gestures.nudge(&log, Parameter::Yaw, 5.0, 0.0);
        assert!(!gestures.have_landed(|_, _| false));
        gestures.forget_sent();
        assert!(gestures.have_landed(|_, _| false));
    }

    #[test]
    fn closing_ends_everything_once() {
        let (log, mut gestures) = (Log::default(), Gestures::default());
        gestures.hold(&log, Parameter::X, 1.0);
        gestures.nudge(&log, Parameter::Yaw, 1.0, 0.0);
        log.take();
        gestures.close(&log);
        gestures.close(&log);
        assert_eq!(log.take(), "-x -yaw");
    }
}
