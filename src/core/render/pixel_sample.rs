//! The sink of one sample of a pixel: radiance, weight, first surface and rays. `World::camera_ray` starts the sample.

use super::cancellation::Cancellation;
use super::observer::Observer;
use super::statistics::RayCounts;
use crate::color::Spectrum;
use crate::film::FirstSurface;
use crate::integrator::{CameraView, Gathered, RayKind, RaySink, Sink};

/// Sink of one sample.
pub struct PixelSample<'a, R> {
    pub(super) weight: f32,
    pub(super) radiance: R,
    pub(super) surface: Option<FirstSurface>,
    view: Option<CameraView<R>>,
    /// Share in which the sample sees the background, after [`PixelSample::finish`].
    pub(super) background: Spectrum,
    pub(super) rays: RayCounts,
    pub(super) cancellation: Cancellation<'a>,
}

impl<'a, R: Default> PixelSample<'a, R> {
    pub(super) fn new(observer: &'a impl Observer) -> Self {
        Self {
            weight: 0.0,
            radiance: R::default(),
            surface: None,
            view: None,
            background: Spectrum::ZERO,
            rays: RayCounts::default(),
            cancellation: Cancellation::new(observer),
        }
    }
}

impl<R: Gathered> PixelSample<'_, R> {
    /// Puts what the camera ray has seen of the background and the ground to the light that the integrator has found. Gives whether the sample is valid.
    pub(super) fn finish(&mut self) -> bool {
        let Some(view) = self.view.take() else {
            return self.radiance.sum().is_valid();
        };
        match view.finish(self.radiance) {
            Some(seen) => {
                (self.radiance, self.background) = seen;
                true
            }
            None => false,
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

    fn camera_view(&mut self, view: CameraView<R>) {
        self.view = Some(view);
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
