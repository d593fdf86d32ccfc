//! Timers of a render: checkpoints, images, previews and the time limit.
//!
//! If a timer is due, the observer stops the render. The command writes files, and then continues
//! the render. The module `render` does not depend on time.

use std::time::{Duration, Instant};

/// Times at which the render pauses or ends.
pub(super) struct Clock {
    pub checkpoint: Timer,
    pub images: Timer,
    pub preview: Timer,
    /// Time at which `--time-limit` ends the render, if there is a limit.
    end: Option<Instant>,
    /// Earliest time of the next pause, so that the render makes progress even if writing is slow.
    rest: Option<Instant>,
}

impl Clock {
    /// Starts a timer for each interval: `checkpoint` and `images` in seconds, and `preview`. The
    /// render ends at `end`.
    pub fn new(checkpoint: Option<f64>, images: Option<f64>, preview: Option<Duration>, end: Option<Instant>) -> Self {
        let seconds = |s: f64| Duration::try_from_secs_f64(s).ok();
        Self {
            checkpoint: Timer::new(checkpoint.and_then(seconds)),
            images: Timer::new(images.and_then(seconds)),
            preview: Timer::new(preview),
            end,
            rest: None,
        }
    }

    /// Time at which the render pauses next.
    pub fn pause(&self) -> Option<Instant> {
        let timers = [&self.checkpoint, &self.images, &self.preview];
        let due = timers.into_iter().filter_map(|timer| timer.due).min();
        due.map(|due| self.rest.map_or(due, |rest| due.max(rest)))
    }

    /// Time at which the render ends.
    pub fn end(&self) -> Option<Instant> {
        self.end
    }

    /// Sets the earliest time of the next pause: the render continues for at least as long as
    /// `pause`, the duration of the last pause.
    pub fn rest_after(&mut self, pause: Duration) {
        self.rest = Instant::now().checked_add(pause);
    }

    /// Returns true if the end of the render has passed.
    pub fn is_over(&self) -> bool {
        self.end.is_some_and(|end| Instant::now() >= end)
    }
}

/// Timer of a repeated event. Without an interval it is never due.
pub(super) struct Timer {
    interval: Option<Duration>,
    due: Option<Instant>,
}

impl Timer {
    /// A timer that is due for the first time after `interval`.
    fn new(interval: Option<Duration>) -> Self {
        let mut timer = Self {
            interval: None,
            due: None,
        };
        timer.restart_with(interval);
        timer
    }

    /// Restarts the timer: it is due again after the new `interval`.
    pub fn restart_with(&mut self, interval: Option<Duration>) {
        self.interval = interval;
        self.restart();
    }

    /// Restarts the timer: it is due again after the same interval.
    pub fn restart(&mut self) {
        self.due = self.interval.and_then(|interval| Instant::now().checked_add(interval));
    }

    pub fn is_due(&self) -> bool {
        self.due.is_some_and(|due| Instant::now() >= due)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Even if writing takes longer than the intervals, the render gets half of the time.
    #[test]
    fn slow_writing_leaves_half_of_the_time_to_render() {
        let mut clock = Clock::new(Some(1e-6), Some(1e-6), None, Some(Instant::now()));
        let soon = |due: Option<Instant>| due.is_some_and(|due| due < Instant::now() + Duration::from_secs(1));
        assert!(soon(clock.pause()) && soon(clock.end()));
        clock.rest_after(Duration::from_secs(60));
        assert!(
            clock
                .pause()
                .is_some_and(|due| due > Instant::now() + Duration::from_secs(50))
        );
        // The time limit ends the render even before the next pause.
        assert!(soon(clock.end()));
        let never = Clock::new(None, None, None, None);
        assert_eq!((never.pause(), never.end()), (None, None));
    }
}
