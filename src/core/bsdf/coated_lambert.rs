use super::energy::{self, ConductorEnergy, ConductorTables, DirectionTerms, EnergyLookup};
use super::{Fresnel, same_hemisphere};
use crate::color::Spectrum;
use crate::math::Vec3;
use crate::sampling::warp::cosine_hemisphere_pdf;
use std::f32::consts::PI;

/// Ideal diffuse reflection below a coat, a colourless [`super::RoughConductor`]. The coat weakens
/// the light on the way in and on the way out. Symmetric on both sides of the surface.
///
/// `f = albedo (1 − E(wo)) (1 − E(wi)) / (π (1 − Ē))`, where `E` is the albedo of the coat towards
/// a direction, and `Ē` the cosine-weighted mean of `E` (Kelemen and Szirmay-Kalos 2001, "A
/// Microfacet Based Coupled Specular-Matte BRDF Model with Importance Sampling"). The lobe is
/// reciprocal. With albedo 1, base and coat together reflect all light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoatedLambert {
    albedo: Spectrum,
    /// Reflectance of the coat along the normal.
    f0: f32,
    roughness: f32,
    /// Single reflections of the coat lose energy. Multiple reflections return this fraction of the
    /// loss.
    several: f32,
    /// Mean transmittance of the coat.
    passed: f32,
}

impl CoatedLambert {
    /// Albedo, reflectance of the coat along the normal, and roughness.
    pub(super) fn parameters(&self) -> (Spectrum, f32, f32) {
        (self.albedo, self.f0, self.roughness)
    }

    /// Roughness `√α` of the coat.
    pub(super) fn roughness(&self) -> f32 {
        self.roughness
    }

    /// Returns the parameters for [`super::BsdfLanes`]: the albedo, the mean transmittance of the
    /// coat, the number 1 for a base with a coat, and two numbers of the coat. The first is the
    /// reflectance along the normal, the second is the fraction of the energy loss that multiple
    /// reflections return.
    pub(super) fn lane_parameters(&self) -> (Spectrum, f32, f32, [f32; 2]) {
        (self.albedo, self.passed, 1.0, [self.f0, self.several])
    }

    /// Lobe below a coat of microfacets of width `alpha`, with Schlick's reflectance `f0` along the
    /// normal.
    pub fn new(albedo: Spectrum, alpha: f32, f0: f32) -> Self {
        let roughness = alpha.max(0.0).sqrt();
        let [missing, grazing] = ConductorTables::new(roughness)
            .loss_and_grazing()
            .map(|shares| shares.mean());
        let f = Fresnel::Schlick { f0: [f0; 3] }.mean().max_component();
        let several = energy::several_reflections(f, missing);
        Self {
            albedo,
            f0,
            roughness,
            several,
            passed: passed(f0, several, missing, grazing),
        }
    }

    /// Terms of the lobe that depend on one direction: the transmittance of the coat.
    #[inline(always)]
    pub(super) fn terms(&self, energy: &mut EnergyLookup) -> DirectionTerms {
        let ConductorEnergy { loss, grazing, .. } = energy.of(self.roughness);
        DirectionTerms {
            share: passed(self.f0, self.several, loss, grazing),
            ..DirectionTerms::default()
        }
    }

    /// Returns the value of the lobe, sr⁻¹, and the density of `wi` per solid angle. The density is
    /// cosine-weighted, as in [`Lambert`](super::Lambert).
    #[inline(always)]
    pub(super) fn eval_pdf(&self, o: &DirectionTerms, i: &DirectionTerms, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        if !same_hemisphere(wo, wi) || self.albedo.is_black() {
            return (Spectrum::ZERO, 0.0);
        }
        let f = self.albedo * (o.share * i.share / (PI * self.passed));
        (f, cosine_hemisphere_pdf(wi.z.abs()))
    }

    /// Mean albedo under uniform light.
    pub(super) fn albedo(&self) -> Spectrum {
        self.albedo * self.passed
    }

    /// Directional albedo towards `wo`.
    #[inline(always)]
    pub(super) fn albedo_towards(&self, terms: &DirectionTerms) -> Spectrum {
        self.albedo * terms.share
    }
}

/// Transmittance of a coat with reflectance `f0` along the normal. Single reflections lose the
/// fraction `missing` of the light, and multiple reflections return the fraction `several` of this
/// loss. `grazing` is the albedo of single reflections, each weighted by `(1 − cos)⁵`.
#[inline(always)]
fn passed(f0: f32, several: f32, missing: f32, grazing: f32) -> f32 {
    1.0 - (f0 * (1.0 - missing - grazing) + grazing + several * missing)
}
