//! Cancellation of long work.
//!
//! Renders ask their observer between samples, work items and iterations. One sample may itself be long: loops that branch, gather, follow a chain or
//! sample all lights ask `RaySink::is_cancelled`, which asks the observer every sixteenth time. A loop that is told to end leaves, and what it found
//! is thrown away with its tile or work item.
//!
//! Two limits bound the work of a sample: no path scatters more than 1024 times, whatever `--max-depth` and roulette say, and a sample of
//! `distributed` has at most 10⁷ rays to its last vertices.

use super::observer::Observer;
use super::statistics::RayCounts;
use crate::integrator::{RayKind, RaySink};
use std::cell::Cell;

/// Looks that long loops take between two questions to the observer, which may read a clock.
const LOOKS: u32 = 16;

/// Tells the loops of one work item when to end. Once they are told they are always told, so that a work item is known not to be whole.
pub(super) struct Cancellation<'a> {
    observer: &'a dyn Observer,
    looks: Cell<u32>,
    is_cancelled: Cell<bool>,
}

impl<'a> Cancellation<'a> {
    pub fn new(observer: &'a impl Observer) -> Self {
        Self {
            observer,
            looks: Cell::new(0),
            is_cancelled: Cell::new(false),
        }
    }

    /// Whether to end now.
    pub fn look(&self) -> bool {
        let looks = self.looks.get().wrapping_add(1);
        self.looks.set(looks);
        if looks % LOOKS == 0 && !self.is_cancelled.get() {
            self.is_cancelled.set(self.observer.should_stop());
        }
        self.is_cancelled.get()
    }

    /// Whether a loop was told to end.
    pub fn is_cancelled(&self) -> bool {
        self.is_cancelled.get()
    }
}

/// Counts the rays of a work item that may be cancelled.
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
        self.cancellation.look()
    }
}
