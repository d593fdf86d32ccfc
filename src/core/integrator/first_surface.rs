//! What a camera ray sees first: a surface, the background, or the ground (`background.rs`). A
//! surface has auxiliary channels: the albedo, normal and depth of every image, and the channels of
//! `--aov` (`film/aov.rs`).

use super::background::{Background, BackgroundLight, CameraView, Shadow};
use super::vertex::Vertex;
use super::world::World;
use super::{LightSource, RayKind, RaySink, Sink};
use crate::accel::Accel;
use crate::bsdf::{BsdfSample, TransportMode};
use crate::color::Spectrum;
use crate::film::{Features, FirstSurface};
use crate::light_sampling::LightSampleContext;
use crate::material::BsdfSlot;
use crate::math::{Ray, Vec2, Vec3};
use crate::scene::Ground;

/// Maximum number of mirrors and glass surfaces through which guides are followed. A ray through a
/// bottle meets four surfaces.
const MAX_PASSED: u32 = 8;

/// Albedo and normal that guide denoisers.
#[derive(Clone, Copy, Debug)]
struct Guide {
    albedo: Spectrum,
    /// Unit shading normal in world space, on the side of the viewer.
    normal: Vec3,
}

impl Guide {
    /// Guide of the surface at `vertex` alone.
    #[inline(always)]
    fn of(vertex: &Vertex) -> Self {
        Self {
            albedo: vertex.albedo(),
            normal: vertex.point.ns * 1f32.copysign(vertex.wo.z),
        }
    }
}

impl<A: Accel> World<'_, A> {
    /// Passes `vertex`, the first surface that the camera ray `ray` hits, to the sink. The ground
    /// counts as background, not as a surface. So depths, mattes and the metering of the exposure
    /// use only the objects.
    ///
    /// `beta` is the transmittance in front of the surface.
    #[inline(always)]
    pub(super) fn see(&self, vertex: &Vertex, ray: &Ray, beta: Spectrum, out: &mut impl Sink) {
        match self.scene.ground().filter(|ground| ground.is_at(&vertex.hit)) {
            Some(ground) => out.camera_view(self.ground_view(ground, vertex, ray, beta)),
            None => {
                let first = self.first_surface(vertex, out);
                out.first_surface(first);
            }
        }
    }

    /// View of the ground at `vertex`. The sink computes the fraction of unshadowed light from the
    /// light that the sample finds.
    #[inline(never)]
    fn ground_view(&self, ground: &Ground, vertex: &Vertex, ray: &Ray, beta: Spectrum) -> CameraView {
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
    pub(super) fn shadow_view(&self, ground: &Ground, vertex: &Vertex, ray: &Ray, beta: Spectrum) -> CameraView {
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
    pub(super) fn first_surface(&self, vertex: &Vertex, out: &mut impl RaySink) -> FirstSurface {
        let guide = self.guide(vertex, 0, out);
        FirstSurface {
            features: self.features.then(|| self.features_of(vertex)),
            albedo: guide.albedo,
            normal: guide.normal,
            depth: self.camera.depth(vertex.point.p, vertex.point.time),
            emitted: self.emitted_luminance(vertex),
        }
    }

    /// Guide of the surface at `vertex`. If most of its light comes from one direction, such as in
    /// a mirror or in clear glass, the guide shows the surface in this direction. `passed` is the
    /// number of mirrors and glass surfaces before `vertex`.
    ///
    /// Denoisers keep the edges and textures of guides. So they keep those of a reflection, too.
    #[inline(always)]
    fn guide(&self, vertex: &Vertex, passed: u32, out: &mut impl RaySink) -> Guide {
        let own = Guide::of(vertex);
        if vertex.bsdf.has_delta() && passed < MAX_PASSED {
            self.guide_behind(vertex, own, passed, out).unwrap_or(own)
        } else {
            own
        }
    }

    /// Guide of the surface that a mirror or clear glass at `vertex` shows, with the albedo of all
    /// other light of `vertex`. `own` is the guide of `vertex` alone. `None` if no delta direction
    /// has half of the light, or if the ray leaves the scene.
    #[inline(never)]
    fn guide_behind(&self, vertex: &Vertex, own: Guide, passed: u32, out: &mut impl RaySink) -> Option<Guide> {
        // Flux towards the viewer. The mode of importance does not scale it by the squared index
        let flux = |sample: &BsdfSample| sample.weight * sample.pdf;
        let directions = vertex.bsdf.delta_directions(vertex.wo, TransportMode::Importance);
        let brightest = directions.max_by(|a, b| flux(a).luminance().total_cmp(&flux(b).luminance()))?;
        let flux = flux(&brightest);
        if flux.luminance() < 0.5 * own.albedo.luminance() {
            return None;
        }
        let ray = self.ray_along(vertex, brightest.wi);
        let (hit, tint) = self.intersect(&ray, RayKind::Bounce, out);
        let slot = BsdfSlot::new();
        let next = self.vertex(&hit?, &ray, None, &slot);
        let shown = self.guide(&next, passed + 1, out);
        Some(Guide {
            albedo: (own.albedo - flux).max(Spectrum::ZERO) + flux * tint * shown.albedo,
            ..shown
        })
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
