//! Absorption inside bodies: light that goes a distance d through a body of the absorption coefficient σ keeps exp(−σ d) of what it had (Bouguer 1729,
//! Lambert 1760, Beer 1852), channel by channel.
//!
//! A body is what lies behind a surface that transmits light into a body. A segment of a path lies in a body if it leaves such a surface backwards or meets
//! one from behind; a ray carries the body that it starts in ([`Ray::body`]), and what it meets tells the other end. Where both ends are surfaces of
//! bodies, the mean of both coefficients counts, so that a path has the same light from either end. Of a segment between two opaque surfaces within a
//! body nothing is known, and it counts as clear.

use super::Scene;
use crate::color::Spectrum;
use crate::geometry::Hit;
use crate::math::Ray;

impl Scene {
    /// Whether any body absorbs light.
    #[inline(always)]
    pub fn has_absorption(&self) -> bool {
        self.has_absorption
    }

    /// The number of the body behind the surface at `hit`, as in [`Ray::body`]; 0 where there is none that absorbs.
    #[inline(always)]
    pub fn body_behind(&self, hit: &Hit) -> u32 {
        match self.has_absorption {
            true => self.absorbing_body(self.shape(hit.geom).material.0),
            false => 0,
        }
    }

    fn absorbing_body(&self, material: u32) -> u32 {
        match self.absorptions[material as usize].is_black() {
            true => 0,
            false => material + 1,
        }
    }

    /// Transmittance of the way along `ray` to `hit`, its closest one.
    #[inline(never)]
    pub fn transmittance_to(&self, hit: &Hit, ray: &Ray) -> Spectrum {
        let body = match self.body_behind(hit) {
            0 => 0,
            body if self.surface_point(hit, ray.time).ng.dot(ray.direction) > 0.0 => body,
            _ => 0,
        };
        self.transmittance_within([ray.body, body], hit.t * ray.direction.length())
    }

    /// Transmittance of the whole of `ray`, which meets nothing; 1 of one without an end.
    #[inline(never)]
    pub fn transmittance_along(&self, ray: &Ray) -> Spectrum {
        match ray.t_max < f32::INFINITY {
            true => self.transmittance_within([ray.body, 0], ray.t_max * ray.direction.length()),
            false => Spectrum::ONE,
        }
    }

    /// Transmittance of a segment of that length, whose ends are in these bodies.
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
