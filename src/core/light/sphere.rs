//! Spheres that emit.
//!
//! Directions are uniform in the cone of the sphere (PBR4 §6.2.4; Shirley and Wang 1991). The cone
//! is given by its depth, 1 − cos of its half-angle. The depth is accurate for distant points, for
//! which the cosine is not. It is also accurate for points next to the surface, where the cone is a
//! half-space.
//!
//! The scene geometry contains a polyhedron around each sphere. Rays that hit the polyhedron but
//! miss the sphere pass through it (`scene/lamp_hulls.rs`).

use super::bounds::LightBounds;
use super::{Emission, LightSample};
use crate::color::Spectrum;
use crate::math::{DVec3, Frame, Ray, Vec2, Vec3, encode_fields, float::gamma};
use crate::sampling::warp::{cosine_hemisphere_pdf, uniform_disk, uniform_sphere};
use std::f64::consts::PI;

/// A sphere that emits the same radiance from all of its outer side.
#[derive(Clone, Copy, Debug)]
pub struct SphereLight {
    center: Vec3,
    radius: f32,
    radiance: Spectrum,
}

/// Point at which a ray enters a sphere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SphereEntry {
    /// Ray parameter, in lengths of the ray's direction.
    pub t: f32,
    /// Point of the sphere.
    pub p: Vec3,
    /// Unit normal at the point.
    pub n: Vec3,
}

encode_fields!(SphereLight {
    center,
    radius,
    radiance,
});

impl SphereLight {
    /// The sphere around `center` with the given radius, emitting `radiance`, W·sr⁻¹·m⁻².
    pub fn new(center: Vec3, radius: f32, radiance: Spectrum) -> Self {
        Self {
            center,
            radius,
            radiance,
        }
    }

    /// Centre of the sphere.
    pub(crate) fn center(&self) -> Vec3 {
        self.center
    }

    /// Radius of the sphere, scene units.
    pub(crate) fn radius(&self) -> f32 {
        self.radius
    }

    /// Radiance that arrives at `p` from the sphere; zero if `p` is inside the sphere.
    pub fn radiance_at(&self, p: Vec3) -> Spectrum {
        match self.depth(p) {
            Some(_) => self.radiance,
            None => Spectrum::ZERO,
        }
    }

    /// Depth of the cone of directions from `p` to the sphere, whose half-angle is θ: `1 − cos θ =
    /// sin² θ / (1 + cos θ)`. `None` if `p` is not outside the sphere.
    fn depth(&self, p: Vec3) -> Option<f64> {
        let squared = (self.center.as_dvec3() - p.as_dvec3()).length_squared();
        let sin_squared = f64::from(self.radius).powi(2) / squared;
        (sin_squared < 1.0).then(|| sin_squared / (1.0 + (1.0 - sin_squared).sqrt()))
    }

    /// Samples a direction from `p` to the sphere, uniform over its solid angle.
    #[inline(never)]
    pub(super) fn sample(&self, p: Vec3, u: Vec2) -> Option<LightSample> {
        let depth = self.depth(p)?;
        let (p, to) = (p.as_dvec3(), self.center.as_dvec3() - p.as_dvec3());
        let distance = to.length();
        // Project a point of the unit disk to the spherical cap of directions. The squared distance
        // of the point from the disk's centre is the fraction of the cap's depth.
        let disk = uniform_disk(u);
        let fallen = depth * f64::from(disk.length_squared()).min(1.0);
        let scale = (depth * (2.0 - fallen)).sqrt();
        let (z, frame) = (1.0 - fallen, Frame::from_z((to / distance).as_vec3a()));
        let (x, y) = (f64::from(disk.x) * scale, f64::from(disk.y) * scale);
        let [right, up] = [Vec3::X, Vec3::Y].map(|axis| frame.to_world(axis).as_dvec3());
        let wi = (x * right + y * up + z * (to / distance)).normalize();

        // Compute the hit point on the near side of the sphere
        let beside = distance * distance * (x * x + y * y);
        let half_chord = (f64::from(self.radius).powi(2) - beside).max(0.0).sqrt();
        let n = (p + wi * (distance * z - half_chord) - self.center.as_dvec3()).try_normalize()?;
        let q = self.center.as_dvec3() + f64::from(self.radius) * n;
        let clear = f64::from(self.end_offset(p.abs().max_element() as f32));
        Some(LightSample {
            wi: wi.as_vec3a(),
            radiance: self.radiance,
            pdf: (0.5 / (PI * depth)) as f32,
            is_delta: false,
            target: Some((q + n * clear).as_vec3a()),
        })
    }

    /// Density per solid angle at `p`, the same for all directions that hit the sphere.
    pub fn pdf(&self, p: Vec3) -> f32 {
        self.depth(p).map_or(0.0, |depth| (0.5 / (PI * depth)) as f32)
    }

    /// Distance from the sphere, scene units, at which shadow rays end and paths start. It is a
    /// bound of the rounding errors of both end points of the ray and of its direction. `size` is
    /// the largest absolute coordinate of the ray's other end point.
    fn end_offset(&self, size: f32) -> f32 {
        gamma(16) * (self.center.abs().max_element() + self.radius + size)
    }

    /// Unit normal at the point `q` of the sphere.
    pub fn normal_at(&self, q: Vec3) -> Vec3 {
        (q - self.center).normalize_or(Vec3::Z)
    }

    /// Finds the point of `ray` nearest to the centre of the sphere. Returns the ray parameter of
    /// the point, in lengths of the ray's direction, and the squared distance of the point from the
    /// centre, divided by the squared radius.
    fn approach(&self, ray: &Ray) -> (f64, f64) {
        let (to, d) = (self.center.as_dvec3() - ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let t = (to.dot(d) / d.length_squared()).clamp(f64::from(ray.t_min), f64::from(ray.t_max));
        (t, (t * d - to).length_squared() / f64::from(self.radius).powi(2))
    }

    /// Returns true if no point of `ray` lies inside the sphere.
    pub fn is_missed(&self, ray: &Ray) -> bool {
        self.approach(ray).1 >= 1.0
    }

    /// Point at which `ray` enters the sphere. `None` if the ray starts inside the sphere or misses
    /// it.
    pub(crate) fn entry(&self, ray: &Ray) -> Option<SphereEntry> {
        let (t, squared) = self.approach(ray);
        self.depth(ray.origin).filter(|_| squared < 1.0)?;
        let d = ray.direction.as_dvec3();
        let half_chord = f64::from(self.radius) * (1.0 - squared).sqrt();
        let n: DVec3 = ray.origin.as_dvec3() + t * d - half_chord * d.normalize() - self.center.as_dvec3();
        let n = n.try_normalize()?;
        let q = self.center.as_dvec3() + f64::from(self.radius) * n;
        Some(SphereEntry {
            t: (t - half_chord / d.length()) as f32,
            p: q.as_vec3a(),
            n: n.as_vec3a(),
        })
    }

    /// Distance of ray origins from the surface of the sphere, scene units.
    pub fn ray_offset(&self) -> f32 {
        self.end_offset(0.0)
    }

    /// Samples emitted light: a point uniform over the sphere, and a direction with a density
    /// proportional to the cosine.
    pub(super) fn sample_emission(&self, u_position: Vec2, u_direction: Vec2) -> Emission {
        let n = uniform_sphere(u_position);
        let p = self.center + self.radius * n;
        let pdf_position = (1.0 / self.area()) as f32;
        Emission::of_surface(p, n, self.ray_offset(), self.radiance, pdf_position, u_direction)
    }

    /// Densities of emission sampling: per area for the start point, and per solid angle for the
    /// unit direction `w` if the normal is `ng`.
    pub(super) fn emission_pdfs(&self, ng: Vec3, w: Vec3) -> [f32; 2] {
        [(1.0 / self.area()) as f32, cosine_hemisphere_pdf(w.dot(ng))]
    }

    /// Position, size and emission of the light for the light tree, as for a disk of the same
    /// radius that always faces the receiver.
    pub(super) fn bounds(&self) -> LightBounds {
        let disk = 0.25 * self.area() as f32;
        LightBounds {
            radius: self.radius,
            ..LightBounds::isotropic(self.center, disk * self.radiance.luminance())
        }
    }

    /// Irradiance at the point `p` of a surface with unit normal `n`: in closed form, also if the
    /// horizon cuts the sphere (Lagarde and de Rousiers 2014, "Moving Frostbite to Physically Based
    /// Rendering", §4.7.2).
    pub(super) fn irradiance_at(&self, p: Vec3, n: Vec3) -> Spectrum {
        let to = self.center.as_dvec3() - p.as_dvec3();
        let (distance, n) = (to.length(), n.as_dvec3());
        let (cos, sin_squared) = (to.dot(n) / distance, (f64::from(self.radius) / distance).powi(2));
        let form = match sin_squared.sqrt() {
            _ if sin_squared.is_nan() || sin_squared >= 1.0 => 0.0,
            sine if cos >= sine => sin_squared * cos,
            sine if cos <= -sine => 0.0,
            _ => {
                let sin = (1.0 - cos * cos).sqrt();
                let x = (1.0 / sin_squared - 1.0).sqrt();
                let y = (-x * cos / sin).clamp(-1.0, 1.0);
                let edge = sin * (1.0 - y * y).sqrt();
                ((cos * y.acos() - x * edge) * sin_squared + (edge / x).atan()) / PI
            }
        };
        self.radiance * (PI * form.max(0.0)) as f32
    }

    /// Area in square scene units.
    pub(super) fn area(&self) -> f64 {
        4.0 * PI * f64::from(self.radius).powi(2)
    }

    /// Power in watts: `π A L`.
    pub(super) fn power(&self) -> f64 {
        PI * self.area() * f64::from(self.radiance.luminance())
    }
}
