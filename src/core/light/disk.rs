//! Disks that emit on one side.
//!
//! If the receiving point is nearer to the centre than the radius, directions are sampled uniformly
//! over the solid angle of the square around the disk (`sampling/spherical_rectangle.rs`).
//! Directions that miss the disk are rejected. The rejected fraction is at most 1 − π/4 on the
//! axis, and up to 1/2 near the rim. If the receiving point is farther away, points of the disk are
//! sampled uniformly by area, which has less variance there (docs/notebook/2026-11.md, "Disks").
//! Uniform sampling of the disk's own solid angle, a spherical ellipse, needs elliptic integrals or
//! their inversion for each sample (Guillén et al. 2017, "Area-Preserving Parameterizations for
//! Spherical Ellipses").
//!
//! The scene geometry contains the square around each disk. Rays that hit the square outside of the
//! disk pass through it (`scene/lamp_hulls.rs`).

use super::bounds::LightBounds;
use super::{Emission, LightSample, area_pdf};
use crate::color::Spectrum;
use crate::math::{Frame, Ray, Vec2, Vec3, encode_fields, float::gamma};
use crate::sampling::spherical_rectangle::SphericalRectangle;
use crate::sampling::warp::{cosine_hemisphere_pdf, uniform_disk};
use std::f64::consts::PI;

/// A disk that emits the same radiance in every direction of its front side.
#[derive(Clone, Copy, Debug)]
pub struct DiskLight {
    center: Vec3,
    /// Unit normal of the front.
    normal: Vec3,
    radius: f32,
    radiance: Spectrum,
}

encode_fields!(DiskLight {
    center,
    normal,
    radius,
    radiance,
});

impl DiskLight {
    /// The disk around `center` with the given radius and unit normal, emitting `radiance`,
    /// W·sr⁻¹·m⁻².
    pub fn new(center: Vec3, normal: Vec3, radius: f32, radiance: Spectrum) -> Self {
        Self {
            center,
            normal,
            radius,
            radiance,
        }
    }

    /// Centre of the disk.
    pub(crate) fn center(&self) -> Vec3 {
        self.center
    }

    /// Radius of the disk, scene units.
    pub(crate) fn radius(&self) -> f32 {
        self.radius
    }

    /// Unit normal of the front.
    pub(crate) fn normal(&self) -> Vec3 {
        self.normal
    }

    /// Radiance that leaves the disk in direction `w`.
    pub fn emitted(&self, w: Vec3) -> Spectrum {
        if w.dot(self.normal) > 0.0 {
            self.radiance
        } else {
            Spectrum::ZERO
        }
    }

    fn point(&self, u: Vec2) -> Vec3 {
        let place = self.radius * uniform_disk(u).extend(0.0);
        self.center + Frame::from_z(self.normal).to_world(place.into())
    }

    /// Distance of ray origins from the surface of the disk, scene units.
    fn ray_offset(&self) -> f32 {
        gamma(16) * (self.center.abs().max_element() + self.radius)
    }

    /// Solid angle that the square around the disk has at `p`. `None` if the disk is sampled by
    /// area for the receiving point `p`.
    fn seen(&self, p: Vec3) -> Option<SphericalRectangle> {
        if p.distance_squared(self.center) > self.radius * self.radius {
            return None;
        }
        let frame = Frame::from_z(self.normal);
        let edges = [Vec3::X, Vec3::Y].map(|axis| frame.to_world(axis));
        let corner = self.center - self.radius * (edges[0] + edges[1]);
        SphericalRectangle::new(corner, edges, [2.0 * self.radius; 2], p).filter(SphericalRectangle::is_accurate)
    }

    /// Samples incident light at `p` from a point of the disk. `None` if `p` is behind the disk, or
    /// if the sampled direction misses the disk.
    pub(super) fn sample(&self, p: Vec3, u: Vec2) -> Option<LightSample> {
        let (q, wi, pdf) = match self.seen(p) {
            Some(seen) => {
                let [(to, wi)] = seen.sample([u]);
                let is_on = (p + to).distance_squared(self.center) < self.radius * self.radius;
                let pdf = if is_on && to.dot(self.normal) < 0.0 {
                    1.0 / seen.solid_angle()
                } else {
                    0.0
                };
                (p + to, wi, pdf)
            }
            None => {
                let q = self.point(u);
                let wi = (q - p).try_normalize()?;
                (q, wi, area_pdf(p, q, wi, self.normal, self.area()))
            }
        };
        (pdf > 0.0).then(|| LightSample {
            wi,
            radiance: self.radiance,
            pdf,
            is_delta: false,
            target: Some(q + self.normal * self.ray_offset()),
        })
    }

    /// Density per solid angle with which the direction `wi` from `p` to the point `q` of the disk
    /// is sampled. 0 if `p` is behind the disk.
    pub fn pdf(&self, p: Vec3, q: Vec3, wi: Vec3) -> f32 {
        match self.seen(p) {
            Some(seen) if wi.dot(self.normal) < 0.0 => 1.0 / seen.solid_angle(),
            Some(_) => 0.0,
            None => area_pdf(p, q, wi, self.normal, self.area()),
        }
    }

    /// Returns true if `ray` crosses the plane of the disk outside of the disk.
    pub fn is_missed(&self, ray: &Ray) -> bool {
        let (to, d) = (self.center.as_dvec3() - ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let n = self.normal.as_dvec3();
        let t = to.dot(n) / d.dot(n);
        let squared = (t * d - to).length_squared();
        // The distance is NaN if the ray is parallel to the plane.
        squared.is_nan() || squared >= f64::from(self.radius).powi(2)
    }

    /// Samples emitted light: a point uniform over the area, and a direction with a density
    /// proportional to the cosine.
    pub(super) fn sample_emission(&self, u_position: Vec2, u_direction: Vec2) -> Emission {
        let p = self.point(u_position);
        let pdf_position = (1.0 / self.area()) as f32;
        Emission::of_surface(
            p,
            self.normal,
            self.ray_offset(),
            self.radiance,
            pdf_position,
            u_direction,
        )
    }

    /// Densities of emission sampling: per area for the start point, and per solid angle for the
    /// unit direction `w` if the normal is `ng`.
    pub(super) fn emission_pdfs(&self, ng: Vec3, w: Vec3) -> [f32; 2] {
        [(1.0 / self.area()) as f32, cosine_hemisphere_pdf(w.dot(ng))]
    }

    /// Position, size and emission of the light for the light tree.
    pub(super) fn bounds(&self) -> LightBounds {
        LightBounds {
            center: self.center,
            radius: self.radius,
            intensity: self.area() as f32 * self.radiance.luminance(),
            axis: self.normal,
            spread: 0.0,
        }
    }

    /// Corners of the regular polygon with `sides` sides and with the same area as the disk.
    pub(super) fn polygon(&self, sides: u32) -> impl Iterator<Item = Vec3> {
        let turn = 2.0 * PI / f64::from(sides);
        let radius = f64::from(self.radius) * (turn / turn.sin()).sqrt();
        let (center, frame) = (self.center, Frame::from_z(self.normal));
        (0..sides).map(move |i| {
            let (sin, cos) = (turn * f64::from(i)).sin_cos();
            center + frame.to_world(Vec3::new((radius * cos) as f32, (radius * sin) as f32, 0.0))
        })
    }

    /// Radiance of the front.
    pub(super) fn radiance(&self) -> Spectrum {
        self.radiance
    }

    /// Area in square scene units.
    pub(super) fn area(&self) -> f64 {
        PI * f64::from(self.radius).powi(2)
    }

    /// Power in watts: `π A L`.
    pub(super) fn power(&self) -> f64 {
        PI * self.area() * f64::from(self.radiance.luminance())
    }
}
