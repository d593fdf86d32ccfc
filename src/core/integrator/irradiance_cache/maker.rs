//! Makes irradiance records: finds their positions and traces their hemisphere rays.

use super::hemisphere::{HemisphereHit, Strata};
use super::record::Record;
use super::{MAX_MIRRORS, layer};
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::geometry::{Side, SurfacePoint};
use crate::integrator::listeners::SummingSink;
use crate::integrator::path::integrator::PathNumbers;
use crate::integrator::path::state::PathState;
use crate::integrator::vertex::Vertex;
use crate::integrator::{PathIntegrator, RayKind, Sink};
use crate::material::BsdfSlot;
use crate::math::{Frame, Ray, Vec2, Vec3};
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Minimum and maximum radius of a record, in widths of a pixel (Křivánek et al. 2006; Tabellion
/// and Lamorlette 2004). The rays of a smaller record would cost more than paths from the few
/// pixels that use the record. A larger record would miss visible changes of the light far from the
/// record.
const PIXELS: [f32; 2] = [20.0, 200.0];

/// Maker of irradiance records.
#[derive(Debug)]
pub struct RecordMaker<'a, A> {
    /// Path tracer that computes the radiance along hemisphere rays, without path reuse.
    pub path: PathIntegrator<'a, A>,
    /// Approximate number of hemisphere rays of a record.
    pub rays: u32,
}

/// A surface point at which a record may be made.
#[derive(Clone, Copy, Debug)]
pub struct RecordSite {
    point: SurfacePoint,
    /// Side of the shading normal that the camera sees: 1 or −1.
    side: f32,
    /// Number of scattering events between the camera and the point.
    depth: u32,
    /// Width of a pixel at the point, in scene units.
    pixel: f32,
    /// Key of the sample that found the point.
    key: SampleKey,
}

impl RecordSite {
    /// Position of the point in world space.
    pub fn p(&self) -> Vec3 {
        self.point.p
    }

    /// Key of the sample that found the point.
    pub fn key(&self) -> SampleKey {
        self.key
    }

    /// Unit shading normal, on the side that the camera sees.
    pub fn n(&self) -> Vec3 {
        self.point.ns * self.side
    }
}

impl<A: Accel> RecordMaker<'_, A> {
    /// Layer of [`IrradianceCache`](super::IrradianceCache) for the records at `place`.
    pub fn layer(&self, place: &RecordSite) -> u32 {
        layer(self.path.max_depth, place.depth)
    }

    /// Finds the first matte surface on the path of the sample `key` through the film point `film`
    /// (pixels). Before that surface, the path may be reflected by mirrors and pass through glass.
    /// `None` if another lobe scatters the path first, or if the path hits no surface.
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
                    // Use the width of a pixel as if the path continued straight through mirrors
                    // and glass
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

    /// Makes the record at `place`. Returns the record and the number of rays with invalid light.
    /// The record is `None` if it would be invalid.
    ///
    /// Emission of the first surface that a hemisphere ray hits is not added, because it is direct
    /// light.
    pub fn make<S: Sampler>(&self, place: &RecordSite, sampler: &mut S, out: &mut impl Sink) -> (Option<Record>, u64) {
        let strata = Strata::new(self.rays);
        let frame = Frame::from_z(place.n());
        let side = if place.side < 0.0 { Side::Back } else { Side::Front };

        // Trace rays in all directions
        let mut dropped = 0;
        let trace_ray = |index| {
            if out.is_cancelled() {
                return HemisphereHit::NOTHING;
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
            let mut seen = self.trace_ray(
                PathNumbers {
                    key,
                    sampler,
                    wavelength: None,
                },
                &ray,
                place.depth + 1,
                out,
            );
            // Light from surfaces that are nearer than the width of a pixel changes within a pixel,
            // so shorter distances are set to this width.
            seen.distance = seen.distance.max(place.pixel).max(f32::MIN_POSITIVE);
            if !seen.radiance.is_valid() {
                seen.radiance = Spectrum::ZERO;
                dropped += 1;
            }
            seen
        };
        let seen: Vec<HemisphereHit> = (0..strata.rays()).map(trace_ray).collect();
        let gathered = strata.gather(&seen);
        let gradients = gathered.gradients.to_world(&frame);

        // A steep gradient reduces the radius, but not below the minimum. At the minimum the
        // gradient is reduced instead, so that irradiance does not become negative.
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
            gradients: if steepness > max_steepness {
                gradients.with_translation_scaled(max_steepness / steepness)
            } else {
                gradients
            },
            effective_rays: gathered.effective_rays,
        };
        let is_usable = radius > 0.0 && radius.is_finite() && record.at(place.p(), place.n()).is_valid();
        (is_usable.then_some(record), dropped)
    }

    /// Traces the hemisphere ray `ray`, which starts after `depth` scattering events, and follows a
    /// path from its hit. Returns radiance and distance of the hit.
    fn trace_ray<S: Sampler>(
        &self,
        numbers: PathNumbers<S>,
        ray: &Ray,
        depth: u32,
        out: &mut impl Sink,
    ) -> HemisphereHit {
        let traced = self.path.world.intersect(ray, RayKind::Bounce, out);
        let (Some(hit), _) = traced else {
            return HemisphereHit::NOTHING;
        };
        // Skip the emission that the ray hits, because it is direct light.
        let path = PathState {
            depth,
            skips_emission: true,
            ..PathState::new(*ray)
        };
        let mut light = SummingSink::new(depth, out);
        self.path.li(path, Some(traced), numbers, &mut light);
        HemisphereHit {
            radiance: light.sum.radiance,
            distance: hit.t,
        }
    }
}

/// Returns `true` if the cache may have the indirect light of `vertex`, which the path hits after
/// `depth` mirrors or panes. The surface must scatter light equally in all directions, and the
/// depth limit must allow indirect light.
pub(super) fn is_cached(vertex: &Vertex, depth: u32, max_depth: Option<u32>) -> bool {
    depth <= MAX_MIRRORS && vertex.bsdf.is_lambert() && max_depth.is_none_or(|max| depth + 1 < max)
}
