//! Emitting triangles.
//!
//! Points are sampled by area. Sampling by solid angle needs arc functions in f64. On the benchmark
//! scenes, these cost more time than the lower error saves (docs/notebook/2026-11.md, "Sampling
//! emitting triangles and choosing lights").

use super::bounds::{LightBounds, ReceiverRegion};
use super::{Emission, LightSample};
use crate::color::Spectrum;
use crate::geometry::{Facet, PlacedTriangle, Placement, SurfacePoint, corners_at, triangle_area};
use crate::math::{DVec3, Vec2, Vec3};
use crate::sampling::spherical_triangle::SphericalTriangle;
use crate::sampling::warp::{cosine_hemisphere_pdf, uniform_triangle};
use std::f64::consts::PI;

/// Sampling of points on an emitting triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TriangleSampling {
    /// Uniform over the area. This takes less time.
    #[default]
    Area,
    /// Uniform over the solid angle, if the solid angle is large enough. This has less noise near
    /// large lights.
    SolidAngle,
}

/// Range of solid angles, sr, in which sampling by solid angle reduces noise. For a smaller
/// triangle, area sampling is as good. If a triangle fills nearly the whole hemisphere, the
/// receiver is so close to the plane of the triangle that the arcs of the edges are inaccurate.
const SOLID_ANGLES: std::ops::Range<f64> = 3e-4..6.2;

/// A triangle that emits the same radiance in every direction of its front side.
#[derive(Clone, Copy, Debug)]
pub struct TriangleLight {
    corners: [Vec3; 3],
    normal: Vec3,
    /// Maximum, over the points of the triangle, of the distance at which rays start off the
    /// surface, scene units. It is the offset of a corner, because ray offsets grow with the
    /// coordinates of a point.
    ray_offset: f32,
    area: f32,
    radiance: Spectrum,
    sampling: TriangleSampling,
    /// True if the order of the second and the third corner is opposite to the order in the mesh.
    is_mirrored: bool,
}

impl TriangleLight {
    /// The triangle with these corners, emitting `radiance`, W·sr⁻¹·m⁻².
    pub fn new(corners: [Vec3; 3], radiance: Spectrum, sampling: TriangleSampling) -> Self {
        let [p0, p1, p2] = corners;
        let facet = Facet::new(corners);
        let ray_offset = |b1, b2| SurfacePoint::new(corners, facet, b1, b2).ray_offset;
        Self {
            corners,
            normal: facet.normal(),
            ray_offset: ray_offset(0.0, 0.0).max(ray_offset(1.0, 0.0)).max(ray_offset(0.0, 1.0)),
            area: triangle_area(p0, p1, p2) as f32,
            radiance,
            sampling,
            is_mirrored: false,
        }
    }

    /// Light of a mesh triangle after its placement in the scene.
    pub fn placed(triangle: &PlacedTriangle, radiance: Spectrum, sampling: TriangleSampling) -> Self {
        let mut light = Self::new(triangle.corners, radiance, sampling);
        light.ray_offset += triangle.rounding();
        light.is_mirrored = triangle.is_mirrored();
        light
    }

    /// Copy of the triangle with the radiance `radiance`.
    pub(super) fn emitting(self, radiance: Spectrum) -> Self {
        Self { radiance, ..self }
    }

    /// Corners, world space.
    pub(super) fn corners(&self) -> [Vec3; 3] {
        self.corners
    }

    /// Unit normal of the front.
    pub(super) fn normal(&self) -> Vec3 {
        self.normal
    }

    /// Radiance of the front.
    pub(super) fn radiance(&self) -> Spectrum {
        self.radiance
    }

    /// Radiance that leaves the triangle in direction `w`.
    pub fn emitted(&self, w: Vec3) -> Spectrum {
        if w.dot(self.normal) > 0.0 {
            self.radiance
        } else {
            Spectrum::ZERO
        }
    }

    /// Samples incident light at `p` from a point of the triangle. `None` if `p` is behind the
    /// triangle.
    #[inline(always)]
    pub(super) fn sample(&self, p: Vec3, u: Vec2) -> Option<LightSample> {
        // There is no light behind the triangle. Check this first, since it is the most common
        // reason to return.
        if (p - self.corners[0]).dot(self.normal) <= 0.0 {
            return None;
        }
        self.sample_at(p, self.barycentrics(p, u))
    }

    /// Samples emitted light: a point uniform over the area, and a direction with a density
    /// proportional to the cosine.
    pub(super) fn sample_emission(&self, u_position: Vec2, u_direction: Vec2) -> Emission {
        self.emission_at(uniform_triangle(u_position), u_direction)
    }

    /// Emission from the point with barycentric coordinates `b1` and `b2`.
    pub(super) fn emission_at(&self, (b1, b2): (f32, f32), u_direction: Vec2) -> Emission {
        let [p0, p1, p2] = self.corners;
        let p = (1.0 - b1 - b2) * p0 + b1 * p1 + b2 * p2;
        Emission::of_surface(
            p,
            self.normal,
            self.ray_offset,
            self.radiance,
            1.0 / self.area,
            u_direction,
        )
    }

    /// Densities of emission sampling: `1 / A` per area for the start point, and `cos θ / π` per
    /// solid angle for the unit direction `w` if the normal is `ng`.
    pub(super) fn emission_pdfs(&self, ng: Vec3, w: Vec3) -> [f32; 2] {
        [1.0 / self.area, cosine_hemisphere_pdf(w.dot(ng))]
    }

    /// Barycentric coordinates of the point that [`TriangleLight::sample`] samples for `p` and `u`.
    #[inline(always)]
    pub(super) fn barycentrics(&self, p: Vec3, u: Vec2) -> (f32, f32) {
        match self.sampling {
            TriangleSampling::Area => uniform_triangle(u),
            TriangleSampling::SolidAngle => self.barycentrics_by_solid_angle(p, u),
        }
    }

    /// Converts barycentric coordinates of this light to barycentric coordinates of the mesh's
    /// second and third corner.
    pub(super) fn of_mesh(&self, (b1, b2): (f32, f32)) -> (f32, f32) {
        if self.is_mirrored { (b2, b1) } else { (b1, b2) }
    }

    /// Incident light at `p` from the point with barycentric coordinates `b1` and `b2`.
    #[inline(always)]
    pub(super) fn sample_at(&self, p: Vec3, (b1, b2): (f32, f32)) -> Option<LightSample> {
        let [p0, p1, p2] = self.corners;
        let q = (1.0 - b1 - b2) * p0 + b1 * p1 + b2 * p2;
        let squared = p.distance_squared(q);
        let wi = (q - p) * (1.0 / squared.sqrt());
        let pdf = match self.sampling {
            TriangleSampling::Area => self.pdf_by_area(squared, -wi.dot(self.normal)),
            TriangleSampling::SolidAngle => self.pdf(p, q, wi),
        };
        // The density is NaN if `p` and the point on the light coincide.
        if !(pdf > 0.0 && pdf < f32::INFINITY) {
            return None;
        }
        Some(LightSample {
            wi,
            radiance: self.radiance,
            pdf,
            is_delta: false,
            // Move the point to the front side, on which the receiving point lies
            target: Some(q + self.normal * self.ray_offset),
        })
    }

    /// Density per solid angle with which the direction `wi` from `p` to the point `q` of the
    /// triangle is sampled. 0 if `p` is behind the triangle.
    ///
    /// For a point sampled by area, the density is the density per area, `1 / A`, times `r² / cos
    /// θ`.
    pub fn pdf(&self, p: Vec3, q: Vec3, wi: Vec3) -> f32 {
        let cos_light = -wi.dot(self.normal);
        if cos_light <= 0.0 {
            return 0.0;
        }
        if let Some(seen) = self.seen(p) {
            return (1.0 / seen.solid_angle()) as f32;
        }
        let pdf = self.pdf_by_area(p.distance_squared(q), cos_light);
        // The density can be NaN if the triangle is degenerate or seen edge-on. There is no sample
        // then.
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    /// Density per solid angle of a point that is sampled by area: `r² / (A cos θ)`, where r² is
    /// `squared`, the squared distance.
    #[inline(always)]
    fn pdf_by_area(&self, squared: f32, cos_light: f32) -> f32 {
        squared / (cos_light * self.area)
    }

    /// Solid angle that the triangle has at `p`. `None` if the triangle is sampled by area for the
    /// receiving point `p`.
    fn seen(&self, p: Vec3) -> Option<SphericalTriangle> {
        if self.sampling == TriangleSampling::Area {
            return None;
        }
        SphericalTriangle::new(self.corners, p).filter(|seen| SOLID_ANGLES.contains(&seen.solid_angle()))
    }

    /// Barycentric coordinates of a point that is sampled uniformly over the solid angle at `p`. If
    /// [`TriangleLight::seen`] returns `None`, the point is sampled by area.
    #[inline(never)]
    fn barycentrics_by_solid_angle(&self, p: Vec3, u: Vec2) -> (f32, f32) {
        let hit = self
            .seen(p)
            .and_then(|seen| seen.sample(u))
            .and_then(|w| self.intersect_line(p.as_dvec3(), w));
        hit.unwrap_or_else(|| uniform_triangle(u))
    }

    /// Barycentric coordinates of the point at which the line from `p` along `w` crosses the
    /// triangle's plane. They are clamped to the triangle because of rounding.
    fn intersect_line(&self, p: DVec3, w: DVec3) -> Option<(f32, f32)> {
        let [p0, p1, p2] = self.corners.map(Vec3::as_dvec3);
        let (e1, e2, s) = (p1 - p0, p2 - p0, p - p0);
        let (h, q) = (w.cross(e2), s.cross(e1));
        let determinant = e1.dot(h);
        let (b1, b2) = (s.dot(h) / determinant, w.dot(q) / determinant);
        if !(b1.is_finite() && b2.is_finite()) {
            return None;
        }
        let (b1, b2) = (b1.clamp(0.0, 1.0), b2.clamp(0.0, 1.0));
        let excess = (b1 + b2).max(1.0);
        Some(((b1 / excess) as f32, (b2 / excess) as f32))
    }

    /// Position, size and emission of the light for the light tree.
    pub(super) fn bounds(&self) -> LightBounds {
        let center = self.corners.iter().fold(Vec3::ZERO, |sum, &p| sum + p / 3.0);
        let radius = self.corners.iter().fold(0.0, |r: f32, p| r.max(p.distance(center)));
        LightBounds {
            center,
            radius,
            intensity: self.area * self.radiance.luminance(),
            axis: self.normal,
            spread: 0.0,
        }
    }

    /// Estimate of the mean irradiance at `region`: the mean over points of the triangle. A
    /// triangle with a larger solid angle uses more points.
    pub(super) fn irradiance(&self, region: &ReceiverRegion) -> f32 {
        let whole = self.bounds();
        let distance = whole.center.distance(region.center);
        let n = match whole.radius / distance {
            x if x < 0.1 => 1,
            x if x < 0.4 => 2,
            _ => 4,
        };
        let mut sum = 0.0;
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let u = (Vec2::new(i as f32, j as f32) + 0.5) / n as f32;
            let (b1, b2) = uniform_triangle(u);
            let [p0, p1, p2] = self.corners;
            let center = (1.0 - b1 - b2) * p0 + b1 * p1 + b2 * p2;
            sum += region.irradiance(&LightBounds {
                center,
                radius: 0.0,
                ..whole
            });
        }
        sum / (n * n) as f32
    }

    /// Area in square scene units.
    pub(super) fn area(&self) -> f64 {
        f64::from(self.area)
    }

    /// Power in watts: `π A L`.
    pub(super) fn power(&self) -> f64 {
        PI * self.area as f64 * self.radiance.luminance() as f64
    }
}

/// Times at which a moving triangle is evaluated. The mean of the results approximates the mean
/// over the shutter interval.
const TIMES: [f32; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

/// A moving triangle that emits.
#[derive(Clone, Debug)]
pub struct MovingTriangle {
    /// Corners at the times 0 and 1, before placement.
    ends: [[Vec3; 3]; 2],
    placement: Placement,
    radiance: Spectrum,
    sampling: TriangleSampling,
}

impl MovingTriangle {
    /// The triangle whose corners move from `ends[0]` to `ends[1]`, placed by `placement`, emitting
    /// `radiance`, W·sr⁻¹·m⁻².
    pub fn new(ends: [[Vec3; 3]; 2], placement: Placement, radiance: Spectrum, sampling: TriangleSampling) -> Self {
        Self {
            ends,
            placement,
            radiance,
            sampling,
        }
    }

    /// Copy of the triangle with the radiance `radiance`.
    pub(super) fn emitting(&self, radiance: Spectrum) -> Self {
        Self {
            radiance,
            ..self.clone()
        }
    }

    /// Radiance of the front.
    pub(super) fn radiance(&self) -> Spectrum {
        self.radiance
    }

    /// The triangle at `time`.
    #[inline(never)]
    pub fn at(&self, time: f32) -> TriangleLight {
        let corners = corners_at(self.ends[0], self.ends[1], time);
        let placed = PlacedTriangle::new(corners, None, Some(self.placement.at(time)));
        TriangleLight::placed(&placed, self.radiance, self.sampling)
    }

    /// Mean of [`TriangleLight::irradiance`] over [`TIMES`].
    pub(super) fn irradiance(&self, region: &ReceiverRegion) -> f32 {
        TIMES.iter().map(|&time| self.at(time).irradiance(region)).sum::<f32>() / TIMES.len() as f32
    }

    /// Power in watts: the mean of `π A L` over [`TIMES`]. So a triangle has power even if its area
    /// is 0 at some of these times.
    pub(super) fn power(&self) -> f64 {
        TIMES.iter().map(|&time| self.at(time).power()).sum::<f64>() / TIMES.len() as f64
    }
}
