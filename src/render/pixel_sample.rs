use super::cancellation::Cancellation;
use super::observer::Observer;
use super::statistics::RayCounts;
use crate::film::FirstSurface;
use crate::integrator::{Gathered, RayKind, RaySink, Sink};

/// What one sample gave.
pub struct PixelSample<'a, R> {
    pub(super) weight: f32,
    pub(super) radiance: R,
    pub(super) surface: Option<FirstSurface>,
    pub(super) rays: RayCounts,
    pub(super) cancellation: Cancellation<'a>,
}

impl<'a, R: Default> PixelSample<'a, R> {
    pub(super) fn new(observer: &'a impl Observer) -> Self {
        Self {
            weight: 0.0,
            radiance: R::default(),
            surface: None,
            rays: RayCounts::default(),
            cancellation: Cancellation::new(observer),
        }
    }
}

impl<R: Gathered> Sink for PixelSample<'_, R> {
    type Radiance = R;

    fn weight(&mut self, weight: f32) {
        self.weight = weight;
    }

    fn radiance(&mut self, radiance: R) {
        self.radiance += radiance;
    }

    fn first_surface(&mut self, surface: FirstSurface) {
        self.surface = Some(surface);
    }
}

impl<R> RaySink for PixelSample<'_, R> {
    fn ray(&mut self, kind: RayKind) {
        self.rays.count(kind);
    }

    fn cut_walk(&mut self) {
        self.rays.cut_walk();
    }

    fn is_cancelled(&self) -> bool {
        self.cancellation.look()
    }
}
