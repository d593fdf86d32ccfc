//! The trail of a path: the light that it has found and its scattering events, in order from the camera.
//!
//! A path tracer finds light in the order of its vertices, but the class of light depends on all events between it and the camera. The trail keeps both,
//! and is read from its end once the path is there. Nothing is kept for radiance without classes of paths.

use super::Gathered;
use crate::bsdf::ScatteringEvent;
use crate::film::LightPaths;
use std::ops::Range;

/// Steps of a path, from the camera on.
pub(crate) struct Trail<R> {
    steps: Vec<Step<R>>,
}

enum Step<R> {
    /// Light that is found here, with the throughput of the whole path.
    Light(R),
    /// The event by which the path goes on.
    Event(ScatteringEvent),
}

impl<R: Gathered> Trail<R> {
    /// No step yet.
    #[inline(always)]
    pub fn new() -> Self {
        Self { steps: Vec::new() }
    }

    /// Notes light that is found.
    #[inline(always)]
    pub fn find(&mut self, light: R) {
        if R::TELLS_PATHS && !light.sum().is_black() {
            self.steps.push(Step::Light(light));
        }
    }

    /// Notes the event by which the path goes on.
    #[inline(always)]
    pub fn go_on(&mut self, event: ScatteringEvent) {
        if R::TELLS_PATHS {
            self.steps.push(Step::Event(event));
        }
    }

    /// Number of steps.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.steps.len()
    }

    /// All events, from the camera on.
    #[inline(always)]
    pub fn events(&self) -> Vec<ScatteringEvent> {
        let event = |step: &Step<R>| match step {
            Step::Light(_) => None,
            Step::Event(event) => Some(*event),
        };
        match R::TELLS_PATHS {
            true => self.steps.iter().filter_map(event).collect(),
            false => Vec::new(),
        }
    }

    /// `light`, found at the end of the path, in the classes that it has for the camera.
    #[inline(always)]
    pub fn arriving(&self, light: R, paths: Option<&LightPaths>) -> R {
        match R::TELLS_PATHS {
            true => seen_after(light, &self.events(), paths),
            false => light,
        }
    }

    /// `sum` in the classes of the light that was found in the steps `found`, which `sum` is the sum of.
    #[inline(always)]
    pub fn told_apart(&self, sum: R, found: Range<usize>, paths: Option<&LightPaths>) -> R {
        if !R::TELLS_PATHS || sum.sum().is_black() {
            return sum;
        }
        let mut light = R::default();
        for (i, step) in self.steps.iter().enumerate().rev() {
            match step {
                Step::Light(here) if found.contains(&i) => light += *here,
                Step::Light(_) => {}
                Step::Event(event) => light = light.scattered(|| *event, paths),
            }
        }
        sum.with_classes_of(light)
    }
}

/// `light` in the classes that it has after `events`, which are in order from the camera.
#[inline(always)]
pub(crate) fn seen_after<R: Gathered>(light: R, events: &[ScatteringEvent], paths: Option<&LightPaths>) -> R {
    match R::TELLS_PATHS {
        true => events
            .iter()
            .rev()
            .fold(light, |light, event| light.scattered(|| *event, paths)),
        false => light,
    }
}
