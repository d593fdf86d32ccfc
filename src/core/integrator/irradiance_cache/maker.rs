//! Makes records of irradiance: where, and from which rays.

use super::hemisphere::{Seen, Strata};
use super::record::Record;
use super::{MAX_MIRRORS, layer};
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::geometry::{Side, SurfacePoint};
use crate::integrator::listeners::Summed;
use crate::integrator::path::integrator::PathNumbers;
use crate::integrator::path::state::PathState;
use crate::integrator::vertex::Vertex;
use crate::integrator::{PathIntegrator, RayKind, Sink};
use crate::material::BsdfSlot;
use crate::math::{Frame, Ray, Vec2, Vec3};
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Radius of a record in widths of a pixel, at least and at most (Křivánek et al. 2006; Tabellion and Lamorlette 2004). Smaller ones cost more
/// rays than the paths of the few pixels that they serve; larger ones would miss what is far from them and yet seen.
const PIXELS: [f32; 2] = [20.0, 200.0];

/// Makes records of irradiance.
#[derive(Debug)]
pub struct RecordMaker<'a, A> {
    /// Follows the light that rays of the hemisphere meet; shares no paths.
    pub path: PathIntegrator<'a, A>,
    /// Rays of the hemisphere, about.
    pub rays: u32,
}

/// A surface point at which a record may be made.
#[derive(Clone, Copy, Debug)]
pub struct RecordSite {
    point: SurfacePoint,
    /// The side of the shading normal from which it is seen: 1 or −1.
    side: f32,
    /// Number of scattering events between the camera and the point.
    depth: u32,
    /// Width of a pixel at the point, scene units.
    pixel: f32,
    /// The sample that has found it.
    key: SampleKey,
}

impl RecordSite {
    /// Position in world space.
    pub fn p(&self) -> Vec3 {
        self.point.p
    }

    /// The sample that has found it.
    pub fn key(&self) -> SampleKey {
        self.key
    }

    /// Unit normal, on the side from which the surface is seen.
    pub fn n(&self) -> Vec3 {
        self.point.ns * self.side
    }
}

impl<A: Accel> RecordMaker<'_, A> {
    /// Number of scatterings that [`IrradianceCache`](super::IrradianceCache) distinguishes.
    pub fn layer(&self, place: &RecordSite) -> u32 {
        layer(self.path.max_depth, place.depth)
    }

    /// The first matte surface that is seen in the sample `key` through the point `film` (pixels), behind mirrors and glass; `None` where light comes
    /// another way.
    pub fn find<S: Sampler>(
        &self,
        key: SampleKey,
        film: Vec2,
        sampler: &mut S,
        out: &mut impl Sink,
    ) -> Option<RecordSite> {
        let world = &self.path.world;
        sampler.start(key);
        let time = world.time(sampler);
        let first = world.camera.ray(film, sampler.get_2d(Dimension::LENS), time);
        let (mut ray, mut length) = (first, 0.0);
        for depth in 0..=MAX_MIRRORS {
            let kind = if depth == 0 { RayKind::Camera } else { RayKind::Bounce };
            let (hit, _) = world.intersect(&ray, kind, out);
            let hit = hit?;
            let slot = BsdfSlot::new();
            let vertex = world.vertex(&hit, &ray, None, &slot);
            length += hit.t;
            if is_cached(&vertex, depth, self.path.max_depth) {
                return Some(RecordSite {
                    point: vertex.point,
                    side: 1f32.copysign(vertex.wo.z),
                    depth,
                    // As if the way were straight
                    pixel: world.camera.pixel_width(first.at(length), time),
                    key,
                });
            }
            let u_lobe = sampler.get_1d(Dimension::bounce(depth, Bounce::Lobe));
            let u = sampler.get_2d(Dimension::bounce(depth, Bounce::Direction));
            let directions = self.path.strategy.directions;
            let sample = directions.sample(&vertex, u_lobe, u)?;
            if !sample.is_delta() {
                return None;
            }
            ray = self.path.world.ray_along(&vertex, sample.wi);
        }
        None
    }

    /// The record at `place`, and how many rays came back with light that is none; `None` where there can be no record.
    ///
    /// Lights that rays meet first are left out: they are direct light.
    pub fn make<S: Sampler>(&self, place: &RecordSite, sampler: &mut S, out: &mut impl Sink) -> (Option<Record>, u64) {
        let strata = Strata::new(self.rays);
        let frame = Frame::from_z(place.n());
        let side = match place.side < 0.0 {
            true => Side::Back,
            false => Side::Front,
        };

        // What comes from everywhere
        let mut dropped = 0;
        let look = |index| {
            if out.is_cancelled() {
                return Seen::NOTHING;
            }
            let key = SampleKey {
                sample: index,
                ..place.key
            };
            sampler.start(key);
            let u = sampler.get_2d(Dimension::bounce(place.depth, Bounce::Direction));
            let direction = frame.to_world(strata.direction(index, u));
            let origin = self.path.world.origin_on(&place.point, side, direction);
            let ray = Ray::new(origin, direction).when(place.point.time);
            let mut seen = self.look(
                PathNumbers {
                    key,
                    sampler,
                    wavelength: None,
                },
                &ray,
                place.depth + 1,
                out,
            );
            // Surfaces nearer than that change within the pixel.
            seen.distance = seen.distance.max(place.pixel).max(f32::MIN_POSITIVE);
            if !seen.radiance.is_valid() {
                seen.radiance = Spectrum::ZERO;
                dropped += 1;
            }
            seen
        };
        let seen: Vec<Seen> = (0..strata.rays()).map(look).collect();
        let gathered = strata.gather(&seen);
        let gradients = gathered.gradients.to_world(&frame);

        // Where gradients are steep a record holds less far, but not less than some pixels; nor may it then say that there is less than no light.
        let luminance = gathered.irradiance.luminance();
        let [min, max] = PIXELS.map(|pixels| pixels * place.pixel);
        let steepness = gradients.steepness();
        let radius = gathered.distance.min(luminance / steepness).min(max).max(min);
        let max_steepness = luminance / radius;
        let record = Record {
            p: place.p(),
            n: place.n(),
            radius,
            irradiance: gathered.irradiance,
            gradients: match steepness > max_steepness {
                true => gradients.with_translation_scaled(max_steepness / steepness),
                false => gradients,
            },
            effective_rays: gathered.effective_rays,
        };
        let is_usable = radius > 0.0 && radius.is_finite() && record.at(place.p(), place.n()).is_valid();
        (is_usable.then_some(record), dropped)
    }

    /// The surface that `ray` hits, which has left another one after `depth` scattering events, that one
    /// included.
    fn look<S: Sampler>(&self, numbers: PathNumbers<S>, ray: &Ray, depth: u32, out: &mut impl Sink) -> Seen {
        let traced = self.path.world.intersect(ray, RayKind::Bounce, out);
        let (Some(hit), _) = traced else {
            return Seen::NOTHING;
        };
        // Emission that the ray finds is direct light.
        let path = PathState {
            depth,
            skips_emission: true,
            ..PathState::new(*ray)
        };
        let mut light = Summed::new(depth, out);
        self.path.li(path, Some(traced), numbers, &mut light);
        Seen {
            radiance: light.sum.radiance,
            distance: hit.t,
        }
    }
}

/// Whether the indirect light of `vertex`, which was met after `depth` scatterings by mirrors and the like, may be in a cache: it is the same for all
/// directions, and there is any.
pub(super) fn is_cached(vertex: &Vertex, depth: u32, max_depth: Option<u32>) -> bool {
    depth <= MAX_MIRRORS && vertex.bsdf.is_lambert() && max_depth.is_none_or(|max| depth + 1 < max)
}
