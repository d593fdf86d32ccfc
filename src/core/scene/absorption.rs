//! Absorption inside bodies: light that travels a distance d through a body with the absorption
//! coefficient σ is multiplied by exp(−σ d) (Bouguer 1729, Lambert 1760, Beer 1852), channel by
//! channel.
//!
//! A body is the space behind a surface that transmits light. A path segment lies in a body if it
//! starts on the back of such a surface, or hits such a surface from behind. A ray stores the body
//! at its origin ([`Ray::body`]), and the hit determines the body at the other end. If both ends of
//! a segment are in bodies, the mean of both absorption coefficients is used, so that a path has
//! the same transmittance in both directions. The body of a segment between two opaque surfaces is
//! unknown, so the segment does not absorb light.

use super::Scene;
use crate::color::Spectrum;
use crate::geometry::Hit;
use crate::math::Ray;

impl Scene {
    /// Returns true if any body absorbs light.
    #[inline(always)]
    pub fn has_absorption(&self) -> bool {
        self.has_absorption
    }

    /// Id of the body behind the surface at `hit`, as stored in [`Ray::body`]. 0 if the body does
    /// not absorb light.
    #[inline(always)]
    pub fn body_behind(&self, hit: &Hit) -> u32 {
        if self.has_absorption {
            self.absorbing_body(self.shape(hit.geom).material.0)
        } else {
            0
        }
    }

    fn absorbing_body(&self, material: u32) -> u32 {
        if self.absorptions[material as usize].is_black() {
            0
        } else {
            material + 1
        }
    }

    /// Transmittance along `ray` up to `hit`, its closest hit.
    #[inline(never)]
    pub fn transmittance_to(&self, hit: &Hit, ray: &Ray) -> Spectrum {
        let body = match self.body_behind(hit) {
            0 => 0,
            body if self.surface_point(hit, ray.time).ng.dot(ray.direction) > 0.0 => body,
            _ => 0,
        };
        self.transmittance_within([ray.body, body], hit.t * ray.direction.length())
    }

    /// Transmittance of the whole length of `ray`, which hits nothing. 1 for a ray of infinite
    /// length.
    #[inline(never)]
    pub fn transmittance_along(&self, ray: &Ray) -> Spectrum {
        if ray.t_max < f32::INFINITY {
            self.transmittance_within([ray.body, 0], ray.t_max * ray.direction.length())
        } else {
            Spectrum::ONE
        }
    }

    /// Transmittance of a segment of the length `length`, scene units. `ends` are the ids of the
    /// bodies at both ends, 0 for none.
    fn transmittance_within(&self, ends: [u32; 2], length: f32) -> Spectrum {
        let known = || ends.into_iter().filter(|&body| body > 0);
        let sum = known().fold(Spectrum::ZERO, |sum, body| sum + self.absorptions[body as usize - 1]);
        match known().count() {
            0 => Spectrum::ONE,
            count => {
                let depth = sum * (length / count as f32);
                Spectrum::from(depth.to_array().map(|depth| (-depth).exp()))
            }
        }
    }
}
