//! Sinks that forward to the sink of a sample. `SummingSink` sums the light that a path finds after
//! a given vertex, so that the sum can be multiplied by a factor later. `ClampingSink` limits
//! indirect light.

use super::found_light::LightSum;
use super::{CameraView, FoundLight, PathEvent, RayKind, RaySink, Sink};
use crate::bsdf::ScatteringEvent;
use crate::color::Spectrum;
use crate::film::FirstSurface;

/// Implements [`RaySink`] for a type by forwarding rays and records to its field `out`.
macro_rules! rays_go_to_out {
    ($($head:tt)+) => {
        $($head)+ {
            #[inline(always)]
            fn ray(&mut self, kind: RayKind) {
                self.out.ray(kind);
            }

            fn cut_walk(&mut self) {
                self.out.cut_walk();
            }

            fn is_cancelled(&self) -> bool {
                self.out.is_cancelled()
            }

            #[inline(always)]
            fn records(&self) -> bool {
                self.out.records()
            }

            fn record(&mut self, event: PathEvent) {
                self.out.record(event);
            }
        }
    };
}

/// A sink that sums the light of the rest of a path, from a given vertex on. Forwards rays and
/// records to the sink of the path.
pub(crate) struct SummingSink<'o, O> {
    out: &'o mut O,
    /// Sum of the light received so far.
    pub sum: LightSum,
    /// Number of scattering events of the path before this rest.
    depth: u32,
    /// Scattering events of the rest of the path, if the sink separates classes of paths.
    events: Vec<ScatteringEvent>,
}

impl<'o, O: Sink> SummingSink<'o, O> {
    /// Empty sum for a path that has had `depth` scattering events. `out` is the sink of the path.
    pub fn new(depth: u32, out: &'o mut O) -> Self {
        Self {
            out,
            sum: LightSum::default(),
            depth,
            events: Vec::new(),
        }
    }
}

impl<O: Sink> Sink for SummingSink<'_, O> {
    fn weight(&mut self, _: f32) {}

    #[inline(always)]
    fn light(&mut self, light: FoundLight) {
        self.sum.radiance += light.radiance;
        if self.out.separates_parts() {
            self.part(light);
        }
        if self.out.records() && !light.radiance.is_black() {
            self.out.record(PathEvent::Light(light.radiance));
        }
    }

    fn part(&mut self, light: FoundLight) {
        let of_rest = light.scatterings.saturating_sub(self.depth) as usize;
        let before = of_rest.saturating_sub(light.events.len());
        let before = &self.events[..before.min(self.events.len())];
        self.sum.add_part(FoundLight {
            events: &[before, light.events].concat(),
            ..light
        });
    }

    fn first_surface(&mut self, _: FirstSurface) {}

    #[inline(always)]
    fn separates_parts(&self) -> bool {
        self.out.separates_parts()
    }

    #[inline(always)]
    fn separates_paths(&self) -> bool {
        self.out.separates_paths()
    }

    fn scattered(&mut self, depth: u32, event: ScatteringEvent) {
        self.events.truncate(depth.saturating_sub(self.depth) as usize);
        self.events.push(event);
    }
}

rays_go_to_out!(impl<O: RaySink> RaySink for SummingSink<'_, O>);

/// A sink that limits the luminance of the light that a sample receives after the first bounce.
pub(crate) struct ClampingSink<'o> {
    out: &'o mut dyn Sink,
    /// Sum of the light after the first bounce.
    indirect: LightSum,
}

impl<'o> ClampingSink<'o> {
    /// Empty sum for a sample. `out` is the sink of the sample.
    pub fn new(out: &'o mut dyn Sink) -> Self {
        Self {
            out,
            indirect: LightSum::default(),
        }
    }

    /// Passes the light after the first bounce to the sink of the sample. Scales the light down if
    /// its luminance is above `limit`.
    pub fn finish(mut self, limit: f32) {
        let luminance = self.indirect.radiance.luminance();
        let factor = if luminance > limit { limit / luminance } else { 1.0 };
        self.indirect.pass_on(Spectrum::splat(factor), 2, &mut self.out);
    }
}

impl Sink for ClampingSink<'_> {
    fn weight(&mut self, weight: f32) {
        self.out.weight(weight);
    }

    fn light(&mut self, light: FoundLight) {
        if light.scatterings <= 1 {
            self.out.light(light);
            return;
        }
        self.indirect.radiance += light.radiance;
        if self.out.separates_parts() {
            self.indirect.add_part(light);
        }
    }

    fn part(&mut self, light: FoundLight) {
        match light.scatterings {
            0 | 1 => self.out.part(light),
            _ => self.indirect.add_part(light),
        }
    }

    fn first_surface(&mut self, surface: FirstSurface) {
        self.out.first_surface(surface);
    }

    fn camera_view(&mut self, view: CameraView) {
        self.out.camera_view(view);
    }

    fn line(&mut self) {
        self.out.line();
    }

    fn separates_parts(&self) -> bool {
        self.out.separates_parts()
    }

    fn separates_paths(&self) -> bool {
        self.out.separates_paths()
    }

    fn scattered(&mut self, depth: u32, event: ScatteringEvent) {
        self.out.scattered(depth, event);
    }
}

rays_go_to_out!(impl RaySink for ClampingSink<'_>);
