//! Reports the progress of loading the scene to the pages.

use super::hub::Hub;
use crate::io::LoadObserver;
use serde_json::json;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Kind of the loading message. It sorts before all other kinds.
const KIND: &str = "0 loading";
/// Minimum time between two messages about the same work.
const INTERVAL: Duration = Duration::from_millis(100);

/// Progress of loading a scene, for pages.
pub(super) struct LoadingMessages<'a> {
    hub: &'a Hub,
    work: Mutex<LoadingStep>,
}

/// Current part of the work.
struct LoadingStep {
    doing: String,
    units: u64,
    done: u64,
    reported: Instant,
}

impl<'a> LoadingMessages<'a> {
    /// Progress before the first part of the work starts.
    pub fn new(hub: &'a Hub) -> Self {
        let work = LoadingStep {
            doing: String::new(),
            units: 1,
            done: 0,
            reported: Instant::now(),
        };
        let work = Mutex::new(work);
        Self { hub, work }
    }

    fn report(&self, work: &mut LoadingStep) {
        work.reported = Instant::now();
        let share = work.done.min(work.units) as f64 / work.units.max(1) as f64;
        let text = json!({ "type": "status", "phase": "loading", "doing": work.doing, "share": share });
        self.hub.greet(KIND, &text.to_string());
    }
}

impl LoadObserver for LoadingMessages<'_> {
    fn begin(&self, what: &str, units: u64) {
        let mut work = self.work.lock().unwrap_or_else(PoisonError::into_inner);
        (work.doing, work.units, work.done) = (what.into(), units, 0);
        self.report(&mut work);
    }

    fn advance(&self, units: u64) {
        let mut work = self.work.lock().unwrap_or_else(PoisonError::into_inner);
        work.done = work.done.saturating_add(units);
        if work.reported.elapsed() >= INTERVAL {
            self.report(&mut work);
        }
    }
}

impl Drop for LoadingMessages<'_> {
    /// Removes the loading message, so that new pages do not get it.
    fn drop(&mut self) {
        self.hub.remove_greeting(KIND);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_are_told_what_is_done() {
        let hub = Hub::new();
        let page = hub.join();
        let loading = LoadingMessages::new(&hub);
        loading.begin("reading a.obj", 4);
        std::thread::sleep(INTERVAL);
        loading.advance(1);
        let (messages, _) = hub.outgoing(page, false);
        let shares = messages.iter().map(|text| text.contains("\"share\":0.25"));
        assert_eq!(shares.collect::<Vec<_>>(), [false, true], "{messages:?}");
        assert!(messages[0].contains("reading a.obj"), "{messages:?}");
        // A page opened during loading gets the message; a later page does not.
        assert_eq!(hub.outgoing(hub.join(), false).0.len(), 1);
        drop(loading);
        assert!(hub.outgoing(hub.join(), false).0.is_empty());
    }
}
