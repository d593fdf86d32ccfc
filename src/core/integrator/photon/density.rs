//! Density estimation (Jensen 1996): radiance from the photons near a point. `sppm` and
//! `photon_map` share this estimate.

use super::photons::Photon;
use crate::integrator::FoundLight;
use crate::integrator::found_light::LightSum;
use crate::integrator::vertex::Vertex;
use crate::math::Vec3;
use crate::scene::Scene;
use std::f32::consts::PI;

/// Minimum cosine between the normals of two points of one surface. If the cosine is smaller, the
/// points count as points of different surfaces, such as two walls of a corner.
const MIN_COSINE: f32 = 0.7;

/// Returns `true` if two neighbouring points with the unit geometric normals `ng` and `other` are
/// on one surface.
pub(crate) fn is_one_surface(ng: Vec3, other: Vec3) -> bool {
    ng.dot(other).abs() >= MIN_COSINE
}

/// Estimate of the light that a vertex scatters to its viewer, from the photons around the vertex.
/// The photons give the density of flux at the vertex (Jensen 1996, eq. 6).
///
/// With N paths, and photons i of power Φᵢ within a disk of radius r,
///
/// ```text
/// L(ωₒ) ≈ 1 / (π r² N) Σᵢ f(ωₒ, ωᵢ) |cos θᵢ| / |cos θ'ᵢ| Φᵢ
/// ```
///
/// θ is the angle with the shading normal of the vertex, and θ' the angle with the geometric normal
/// at the photon; on flat surfaces both angles are equal. The mean of the estimate is the mean
/// scattered light over the disk. The estimate has a bias that grows with r², for three reasons.
/// Light varies within the disk. The disk may extend over the edge of a surface. A curved surface
/// has more area within the ball than the disk has.
pub(crate) struct Density<'v> {
    scene: &'v Scene,
    vertex: &'v Vertex<'v>,
    sum: LightSum,
    /// True if the sink separates sources of light.
    has_parts: bool,
}

impl<'v> Density<'v> {
    /// Estimate around `vertex` without photons. If `has_parts`, the light of each source is also
    /// summed separately.
    pub fn new(scene: &'v Scene, vertex: &'v Vertex<'v>, has_parts: bool) -> Self {
        Self {
            scene,
            vertex,
            sum: LightSum::default(),
            has_parts,
        }
    }

    /// Returns `true` if `photon` is on the surface of the vertex, according to the normal of the
    /// photon.
    pub fn is_of_surface(&self, photon: &Photon) -> bool {
        is_one_surface(photon.ng(), self.vertex.point.ng)
    }

    /// Adds the light of `photon`, if the photon is on the surface of the vertex. Light from the
    /// other side counts if the surface transmits it. Light from below the horizon of one of the
    /// normals ([`Vertex::is_one_way`]) is not added, because camera paths estimate this light.
    // ANCHOR: estimate
    pub fn add(&mut self, photon: &Photon) {
        if !self.is_of_surface(photon) || self.vertex.is_one_way(photon.wi()) {
            return;
        }
        let wi = self.vertex.frame.to_local(photon.wi());
        let factor = wi.z.abs() / photon.wi().dot(photon.ng()).abs();
        let (f, _) = self.vertex.eval_pdf(wi);
        if factor.is_finite() && !f.is_black() {
            let light = f * photon.power() * factor;
            self.sum.radiance += light;
            if self.has_parts {
                self.sum.add_part(FoundLight::of(light, photon.light, self.scene, 2));
            }
        }
    }
    // ANCHOR_END: estimate

    /// Sum of the light of the photons, and the factor that converts the sum to radiance. `paths`
    /// is the number of light paths that were traced for the photons, and `squared` the squared
    /// radius of the disk. The factor is 0 for a radius of 0, for which there is no estimate.
    // ANCHOR: radiance
    pub fn radiance(self, paths: u32, squared: f32) -> (LightSum, f32) {
        let density = 1.0 / (PI * squared * paths as f32);
        if density.is_finite() {
            (self.sum, density)
        } else {
            (LightSum::default(), 0.0)
        }
    }
    // ANCHOR_END: radiance
}
