//! What a camera ray sees first: a surface, the background, or the ground (`background.rs`). A
//! surface has auxiliary channels: the albedo, normal and depth of every image, and the channels of
//! `--aov` (`film/aov.rs`).

use super::background::{Background, BackgroundLight, CameraView, Shadow};
use super::vertex::Vertex;
use super::world::World;
use super::{LightSource, Sink};
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::film::{Features, FirstSurface};
use crate::light::LightSampleContext;
use crate::math::{Ray, Vec2};
use crate::scene::Ground;

impl<A: Accel> World<'_, A> {
    /// Passes `vertex`, the first surface that the camera ray `ray` hits, to the sink. The ground
    /// counts as background, not as a surface. So depths, mattes and the metering of the exposure
    /// use only the objects.
    ///
    /// `beta` is the transmittance in front of the surface.
    #[inline(always)]
    pub(super) fn see(&self, vertex: &Vertex, (ray, beta): (&Ray, Spectrum), out: &mut impl Sink) {
        match self.scene.ground().filter(|ground| ground.is_at(&vertex.hit)) {
            Some(ground) => out.camera_view(self.ground_view(ground, vertex, (ray, beta))),
            None => out.first_surface(self.first_surface(vertex)),
        }
    }

    /// View of the ground at `vertex`. The sink computes the fraction of unshadowed light from the
    /// light that the sample finds.
    #[inline(never)]
    fn ground_view(&self, ground: &Ground, vertex: &Vertex, (ray, beta): (&Ray, Spectrum)) -> CameraView {
        let (factor, base) = ground.shadow(vertex.point.p, ray.time, self.scene.lights());
        CameraView::Ground(Shadow {
            factor,
            base: base * beta,
            background: self.behind(ray),
        })
    }

    /// View of the ground at `vertex`, for integrators that compute the light on the ground as
    /// negative light: the light that objects block.
    #[inline(never)]
    pub(super) fn shadow_view(&self, ground: &Ground, vertex: &Vertex, (ray, beta): (&Ray, Spectrum)) -> CameraView {
        let (factor, _) = ground.shadow(vertex.point.p, ray.time, self.scene.lights());
        CameraView::Ground(Shadow {
            factor,
            base: beta,
            background: self.behind(ray),
        })
    }

    /// Background radiance along `ray`. `None` if the background is transparent.
    fn behind(&self, ray: &Ray) -> Option<BackgroundLight> {
        let (background, up) = (self.backdrop.background, self.backdrop.up);
        if background == Background::Transparent {
            return None;
        }
        if let Some(radiance) = background.radiance(ray.direction, up) {
            return Some(BackgroundLight::Plain(radiance));
        }
        let lights = self.scene.escaped(
            self.light_selection,
            LightSampleContext::any_side(ray.origin),
            ray.direction,
        );
        let lights = lights.map(|light| (light.radiance, LightSource::of(light.id, self.scene)));
        Some(BackgroundLight::Lights(lights.collect()))
    }

    /// Adds the background to `out` for the camera ray `ray`, which leaves the scene with
    /// throughput `beta`. Returns `false` if the environment lights are the background. The
    /// integrator then adds their light.
    #[inline(always)]
    pub(super) fn see_background(&self, ray: &Ray, beta: Spectrum, out: &mut impl Sink) -> bool {
        if self.backdrop.background == Background::Light {
            return false;
        }
        self.see_other_background(ray, beta, out);
        true
    }

    #[inline(never)]
    fn see_other_background(&self, ray: &Ray, beta: Spectrum, out: &mut impl Sink) {
        let background = self.behind(ray);
        background
            .iter()
            .flat_map(|light| light.lights(beta))
            .for_each(|light| out.light(light));
        out.camera_view(CameraView::Background(beta));
    }

    /// Auxiliary channels of `vertex`, the first surface of a camera path.
    pub(super) fn first_surface(&self, vertex: &Vertex) -> FirstSurface {
        FirstSurface {
            features: self.features.then(|| self.features_of(vertex)),
            albedo: vertex.albedo(),
            normal: vertex.point.ns * 1f32.copysign(vertex.wo.z),
            depth: self.camera.depth(vertex.point.p, vertex.point.time),
            emitted: self.emitted_luminance(vertex),
        }
    }

    /// Luminance of the light that the surface of `vertex` emits to the camera.
    #[inline(always)]
    fn emitted_luminance(&self, vertex: &Vertex) -> f32 {
        match self.scene.shape(vertex.hit.geom).first_light {
            Some(_) => self.luminance_of_lamp(vertex),
            None => 0.0,
        }
    }

    #[inline(never)]
    fn luminance_of_lamp(&self, vertex: &Vertex) -> f32 {
        let hit = &vertex.hit;
        let (p, to_camera) = (vertex.point.p, vertex.frame.to_world(vertex.wo));
        // For sphere lamps, use a point on the ray as context. The distance of this point changes
        // only the density, which is not used.
        let context = LightSampleContext::any_side(p + to_camera * hit.t);
        let light = self
            .scene
            .emitted(self.light_selection, hit, &context, (p, -to_camera), vertex.point.time);
        light.map_or(0.0, |light| light.radiance.luminance())
    }
}

impl<A: Accel> World<'_, A> {
    /// Auxiliary channels of `--aov` for the surface at `vertex`.
    #[inline(never)]
    fn features_of(&self, vertex: &Vertex) -> Features {
        let hit = &vertex.hit;
        // Compute the film position of the point at shutter open and at shutter close
        let moves = self.scene.is_moving() || self.camera.is_moving();
        let film = |time: f32| {
            let p = self.scene.placed(hit, time).point(hit.b1, hit.b2).p;
            self.camera.film_of(p, time)
        };
        let ends = self.camera.shutter().map(|time| moves.then(|| film(time)).flatten());
        let motion = match ends {
            [Some(open), Some(close)] => (close - open) * Vec2::new(1.0, -1.0),
            _ => Vec2::ZERO,
        };
        Features {
            p: vertex.point.p,
            uv: self.scene.uv(hit).unwrap_or_default(),
            motion,
            points: Default::default(),
            object: self.scene.object(hit),
            part: self.scene.part(hit),
            material: self.scene.shape(hit.geom).material.0,
        }
    }
}
