//! The sink of one sample of a pixel: it collects radiance, filter weight, first surface and ray
//! counts. `World::camera_ray` starts the sample.

use super::cancellation::Cancellation;
use super::light_parts::LightParts;
use super::observer::Observer;
use super::statistics::RayCounts;
use crate::bsdf::ScatteringEvent;
use crate::color::Spectrum;
use crate::film::{FilmSample, FirstSurface};
use crate::integrator::{CameraView, FoundLight, RayKind, RaySink, Sink};

/// Sink of one sample of a pixel.
pub struct PixelSample<'a> {
    weight: f32,
    pub(super) radiance: Spectrum,
    surface: Option<FirstSurface>,
    view: Option<CameraView>,
    is_on_line: bool,
    /// Fraction of the sample, per channel, that shows the background. Set by
    /// [`PixelSample::finish`].
    background: Spectrum,
    pub(super) rays: RayCounts,
    pub(super) cancellation: Cancellation<'a>,
}

impl<'a> PixelSample<'a> {
    pub(super) fn new(observer: &'a impl Observer) -> Self {
        Self {
            weight: 0.0,
            radiance: Spectrum::ZERO,
            surface: None,
            view: None,
            is_on_line: false,
            background: Spectrum::ZERO,
            rays: RayCounts::default(),
            cancellation: Cancellation::new(observer),
        }
    }

    /// Finishes the sample. If the camera ray sees the background or the ground, changes the
    /// integrator's light and `parts` accordingly ([`CameraView::finish`]). Returns `true` if the
    /// sample is valid. The caller must drop an invalid sample ([`PixelSample::drop_light`]).
    pub(super) fn finish(&mut self, parts: Option<&mut LightParts>) -> bool {
        let seen = match self.view.take() {
            None => self.radiance.is_valid().then_some((self.radiance, self.background)),
            Some(view) => {
                if let Some(parts) = parts {
                    parts.finish(&view);
                }
                view.finish(self.radiance)
            }
        };
        if let Some(seen) = seen {
            (self.radiance, self.background) = seen;
        }
        seen.is_some()
    }

    /// Makes the sample and its `parts` black.
    pub(super) fn drop_light(&mut self, parts: Option<&mut LightParts>) {
        self.radiance = Spectrum::ZERO;
        if let Some(parts) = parts {
            *parts = LightParts::new(parts.paths);
        }
    }

    /// Multiplies the finished sample and its `parts` by the filter weight, and returns them for
    /// the film.
    pub(super) fn weighted<'s>(&'s mut self, parts: Option<&'s mut LightParts>) -> FilmSample<'s> {
        if let Some(surface) = &mut self.surface {
            surface.emitted *= self.weight;
        }
        let mut sample = FilmSample {
            radiance: self.radiance * self.weight,
            surface: self.surface.as_ref(),
            is_on_line: self.is_on_line,
            background: self.background * self.weight,
            ..FilmSample::default()
        };
        if let Some(parts) = parts {
            parts.scale(Spectrum::splat(self.weight));
            (sample.parts, sample.classes) = (parts.by_group(), parts.by_class());
        }
        sample
    }
}

impl Sink for PixelSample<'_> {
    fn weight(&mut self, weight: f32) {
        self.weight = weight;
    }

    #[inline(always)]
    fn light(&mut self, light: FoundLight) {
        self.radiance += light.radiance;
    }

    fn first_surface(&mut self, surface: FirstSurface) {
        self.surface = Some(surface);
    }

    fn camera_view(&mut self, view: CameraView) {
        self.view = Some(view);
    }

    fn line(&mut self) {
        self.is_on_line = true;
    }
}

impl RaySink for PixelSample<'_> {
    fn ray(&mut self, kind: RayKind) {
        self.rays.count(kind);
    }

    fn cut_walk(&mut self) {
        self.rays.cut_walk();
    }

    fn is_cancelled(&self) -> bool {
        self.cancellation.should_stop()
    }
}

/// Sink of one sample that also separates its light into groups of lights and classes of paths.
pub(super) struct PartedSample<'s, 'a> {
    pub sample: &'s mut PixelSample<'a>,
    pub parts: &'s mut LightParts<'a>,
}

impl Sink for PartedSample<'_, '_> {
    fn weight(&mut self, weight: f32) {
        self.sample.weight(weight);
    }

    fn light(&mut self, light: FoundLight) {
        self.sample.light(light);
        self.parts.add(&light);
    }

    fn part(&mut self, light: FoundLight) {
        self.parts.add(&light);
    }

    fn first_surface(&mut self, surface: FirstSurface) {
        self.sample.first_surface(surface);
    }

    fn camera_view(&mut self, view: CameraView) {
        self.sample.camera_view(view);
    }

    fn line(&mut self) {
        self.sample.line();
    }

    fn separates_parts(&self) -> bool {
        true
    }

    fn separates_paths(&self) -> bool {
        self.parts.paths.is_some()
    }

    fn scattered(&mut self, depth: u32, event: ScatteringEvent) {
        self.parts.scattered(depth, event);
    }
}

impl RaySink for PartedSample<'_, '_> {
    fn ray(&mut self, kind: RayKind) {
        self.sample.ray(kind);
    }

    fn cut_walk(&mut self) {
        self.sample.cut_walk();
    }

    fn is_cancelled(&self) -> bool {
        self.sample.is_cancelled()
    }
}
