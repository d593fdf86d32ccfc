//! Cancellation of samples and work items that take long.
//!
//! A render calls its observer between samples, work items and iterations. A single sample may take
//! long. Therefore loops that branch, gather, follow a chain or sample all lights call
//! `RaySink::is_cancelled`. Every sixteenth call of `is_cancelled` calls the observer. A cancelled
//! loop returns, and the incomplete tile or work item is discarded.
//!
//! Two limits bound the work of a sample. A path has at most 1024 scattering events, for any
//! `--max-depth` and roulette. A sample of `distributed` has at most 10⁷ rays to its last vertices.

use super::observer::Observer;
use super::statistics::RayCounts;
use crate::integrator::{RayKind, RaySink};
use std::cell::Cell;

/// One in this number of calls of [`Cancellation::should_stop`] calls the observer, because the
/// observer may read a clock.
const CALLS_PER_CHECK: u32 = 16;

/// Cancellation flag of the loops of one work item. The flag is never reset, so that an incomplete
/// work item is recognised.
pub(super) struct Cancellation<'a> {
    observer: &'a dyn Observer,
    calls: Cell<u32>,
    is_cancelled: Cell<bool>,
}

impl<'a> Cancellation<'a> {
    pub fn new(observer: &'a impl Observer) -> Self {
        Self {
            observer,
            calls: Cell::new(0),
            is_cancelled: Cell::new(false),
        }
    }

    /// Returns `true` if the loop must end now. One in [`CALLS_PER_CHECK`] calls also calls the
    /// observer.
    pub fn should_stop(&self) -> bool {
        let calls = self.calls.get().wrapping_add(1);
        self.calls.set(calls);
        if calls % CALLS_PER_CHECK == 0 && !self.is_cancelled.get() {
            self.is_cancelled.set(self.observer.should_stop());
        }
        self.is_cancelled.get()
    }

    /// Returns `true` if a loop of the work item was cancelled. Does not call the observer.
    pub fn is_cancelled(&self) -> bool {
        self.is_cancelled.get()
    }
}

/// Ray counter of a work item that may be cancelled.
pub(super) struct CountedRays<'a> {
    pub counts: RayCounts,
    pub cancellation: Cancellation<'a>,
}

impl<'a> CountedRays<'a> {
    pub fn new(observer: &'a impl Observer) -> Self {
        Self {
            counts: RayCounts::default(),
            cancellation: Cancellation::new(observer),
        }
    }
}

impl RaySink for CountedRays<'_> {
    fn ray(&mut self, kind: RayKind) {
        self.counts.count(kind);
    }

    fn cut_walk(&mut self) {
        self.counts.cut_walk();
    }

    fn is_cancelled(&self) -> bool {
        self.cancellation.should_stop()
    }
}
