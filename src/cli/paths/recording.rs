//! Traces samples, and records the events of their paths.

use super::trace::Trace;
use crate::film::FirstSurface;
use crate::integrator::{FoundLight, PathEvent, RayKind, RaySink, Sink};
use crate::math::UVec2;
use crate::sampler::SampleKey;
use crate::session::{RenderContext, Renderer};
use std::cell::RefCell;

/// Traces of the sample `index` that send light to `pixel`. The sample of the pixel itself comes
/// first. With integrators that take samples in iterations (photons, Markov chains), all samples of
/// other pixels and all chains that send light to the pixel follow.
pub(super) fn record(renderer: &Renderer, pixel: UVec2, index: u32) -> Vec<Trace> {
    let (session, accel) = (renderer.session(), renderer.accel().as_dyn());
    let settings = session.settings();
    let integrator = settings.chosen_integrator();
    let context = RenderContext {
        world: session.world(&accel),
        prepared: renderer.prepared(),
    };
    let filter = context.world.filter;
    let mut sampler = settings.random_numbers();
    let own = SampleKey::new(pixel.x, pixel.y, index);

    // Integrators that take samples pixel by pixel
    let recorded = RefCell::new(RecordedEvents::default());
    let listener = |is_requested| -> Box<dyn Sink + '_> {
        Box::new(Listener {
            recorded: &recorded,
            is_requested,
        })
    };
    if integrator.sample(context, (settings.resolution, own), &mut sampler, &listener) {
        let recorded = recorded.into_inner();
        return vec![Trace::new(own, recorded.weight, &recorded.events, pixel, filter)];
    }

    // Integrators that take samples in iterations
    let mut traces = Vec::new();
    session.install(|| {
        integrator.record_iteration(
            context,
            (settings.resolution, pixel, index),
            &settings.random_numbers(),
            &mut |found| {
                let mut trace = Trace::new(found.key, found.weight, &found.events, pixel, filter);
                if found.key.pixel() != pixel {
                    trace.keep_what_counts();
                }
                traces.push(trace);
            },
        );
    });
    traces.sort_by_key(|trace| (trace.key.pixel() != pixel, trace.key.y, trace.key.x));
    traces
}

/// Events and weight received by the sink.
#[derive(Default)]
struct RecordedEvents {
    events: Vec<PathEvent>,
    weight: f32,
}

/// Listener to one sample of a packet. All samples of a packet are traced together.
struct Listener<'a> {
    recorded: &'a RefCell<RecordedEvents>,
    /// True if the sample is the requested one.
    is_requested: bool,
}

impl Sink for Listener<'_> {
    fn weight(&mut self, weight: f32) {
        if self.is_requested {
            self.recorded.borrow_mut().weight = weight;
        }
    }

    fn light(&mut self, light: FoundLight) {
        self.record(PathEvent::Added {
            film: None,
            radiance: light.radiance,
        });
    }

    fn first_surface(&mut self, _: FirstSurface) {}
}

impl RaySink for Listener<'_> {
    fn ray(&mut self, _: RayKind) {}

    fn cut_walk(&mut self) {}

    fn records(&self) -> bool {
        self.is_requested
    }

    fn record(&mut self, event: PathEvent) {
        if self.is_requested {
            self.recorded.borrow_mut().events.push(event);
        }
    }
}
