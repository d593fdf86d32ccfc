//! Options of a path estimate: the distribution of directions, the strategies for direct light, and
//! the MIS heuristic.
//!
//! Delta lobes are followed with every distribution. If a ray hits a light, the MIS weight depends
//! on the previous vertex: `PrevVertex` is this vertex, with the density of the ray's direction.

use crate::bsdf::{Bsdf, BsdfSample, Scattering};
use crate::color::Spectrum;
use crate::integrator::vertex::Vertex;
use crate::light_sampling::LightSampleContext;
use crate::math::{Vec2, Vec3};
use crate::sampling::mis::{balance_heuristic, power_heuristic};
use crate::sampling::warp::{
    UNIFORM_HEMISPHERE_PDF, cosine_hemisphere, cosine_hemisphere_of_sphere, cosine_hemisphere_pdf, uniform_hemisphere,
    uniform_hemisphere_of_sphere,
};
use crate::scene::Incident;

/// Sampling of directions at a surface. Delta lobes are always followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Directions {
    /// Uniform over the hemisphere.
    Uniform,
    /// Density proportional to the cosine with the normal.
    Cosine,
    /// Density proportional to the cosine: the direction is the normal plus a point of the unit
    /// sphere, from [`crate::sampler::Fibonacci`].
    Fibonacci,
    /// Density proportional to the cosine: the direction is the normal plus a point of the unit
    /// sphere, from [`crate::sampler::PerturbedQmc`].
    PerturbedQmc,
    /// Uniform over the hemisphere: a point of the unit sphere, from
    /// [`crate::sampler::PerturbedQmc`], mirrored to the upper half.
    PerturbedQmcUniform,
    /// Sampled from the BSDF: density about proportional to the BSDF times the cosine.
    #[default]
    Bsdf,
}

/// Strategies for direct light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DirectLight {
    /// Only emission that scattered rays hit.
    None,
    /// Only light sampling.
    Light,
    /// Light sampling, and emission that scattered rays hit, combined by multiple importance
    /// sampling.
    #[default]
    Mis,
}

/// Weights of two strategies in multiple importance sampling (Veach 1997, §9.2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Heuristic {
    /// Weights proportional to the densities of the strategies.
    Balance,
    /// Weights proportional to the squared densities of the strategies.
    #[default]
    Power,
}

/// Sampling options of an estimator. The defaults have the smallest error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Strategy {
    /// Sampling of directions.
    pub directions: Directions,
    /// Strategies for direct light.
    pub direct: DirectLight,
    /// MIS heuristic.
    pub heuristic: Heuristic,
}

/// The previous vertex of a ray. MIS needs this vertex if the ray hits a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PrevVertex {
    /// Light sampling context of this vertex.
    pub from: LightSampleContext,
    /// Density of the ray's direction, per solid angle.
    pub pdf: f32,
    /// True if the direction was sampled from a delta lobe, so that light sampling cannot find it.
    pub is_delta: bool,
    /// Number of light samples that were taken at this vertex.
    pub light_samples: u32,
}

impl PrevVertex {
    /// Previous vertex of the ray that leaves `vertex` in the direction of `sample`.
    #[inline(always)]
    pub fn new(vertex: &Vertex, sample: &BsdfSample, light_samples: u32) -> Self {
        Self {
            from: vertex.light_context(),
            pdf: sample.pdf,
            is_delta: sample.is_delta(),
            light_samples,
        }
    }
}

impl Directions {
    /// Samples a direction at `vertex`.
    #[inline(always)]
    pub(crate) fn sample(self, vertex: &Vertex, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        match self {
            Self::Bsdf => vertex.sample(u_lobe, u),
            _ => self.sample_hemisphere(vertex, u_lobe, u),
        }
    }

    /// [`Directions::sample`] for distributions over the hemisphere. The BSDF samples delta lobes.
    #[inline(never)]
    fn sample_hemisphere(self, vertex: &Vertex, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let (bsdf, wo) = (vertex.bsdf, vertex.wo);
        let smooth = vertex.smooth_probability();
        if u_lobe >= smooth {
            return vertex.sample(u_lobe, u);
        }
        let mut wi = match self {
            Self::Uniform => uniform_hemisphere(u),
            Self::PerturbedQmcUniform => uniform_hemisphere_of_sphere(u),
            Self::Fibonacci | Self::PerturbedQmc => cosine_hemisphere_of_sphere(u),
            _ => cosine_hemisphere(u),
        };
        // On transmitting surfaces, half of the directions are on each side.
        let passed = bsdf.glossy_eta(wo).filter(|_| u_lobe < 0.5 * smooth);
        wi.z = wi.z.copysign(if passed.is_some() { -wo.z } else { wo.z });
        let (f, pdf) = self.eval_pdf(vertex, wi);
        (pdf > 0.0).then(|| BsdfSample {
            eta: passed.unwrap_or(1.0),
            ..BsdfSample::new(f, wi, pdf, Scattering::Diffuse)
        })
    }

    /// Value of the BSDF of `vertex` for light from `wi` (local frame) without the cosine, and the
    /// density per solid angle with which [`Directions::sample`] samples `wi`.
    #[inline(always)]
    pub(crate) fn eval_pdf(self, vertex: &Vertex, wi: Vec3) -> (Spectrum, f32) {
        let (f, pdf) = vertex.eval_pdf(wi);
        match self {
            Self::Bsdf => (f, pdf),
            _ => (f, self.hemisphere_pdf(vertex.bsdf, vertex.wo, wi)),
        }
    }

    /// Density per solid angle with which [`Directions::sample_hemisphere`] samples `wi`.
    #[inline(never)]
    fn hemisphere_pdf(self, bsdf: &Bsdf, wo: Vec3, wi: Vec3) -> f32 {
        // If all lobes only reflect, as on most surfaces, only the hemisphere of `wo` is sampled.
        let share = match (bsdf.glossy_eta(wo), wo.z * wi.z > 0.0) {
            (None, false) => return 0.0,
            (None, true) => 1.0,
            (Some(_), _) => 0.5,
        };
        let hemisphere = match self {
            Self::Uniform | Self::PerturbedQmcUniform => UNIFORM_HEMISPHERE_PDF,
            _ => cosine_hemisphere_pdf(wi.z.abs()),
        };
        bsdf.smooth_probability(wo) * share * hemisphere
    }
}

impl Strategy {
    /// Returns `true` if direct light includes light sampling.
    pub fn samples_lights(&self) -> bool {
        self.direct != DirectLight::None
    }

    /// Returns `true` if a ray that leaves a smooth lobe and hits a light adds the emission of the
    /// light. A ray that leaves a delta lobe always adds the emission.
    pub(crate) fn counts_emission_hits(&self) -> bool {
        self.direct != DirectLight::Light
    }

    /// MIS weight of the emission `light` that a ray hits. `prev` is the previous vertex, `None` at
    /// the camera.
    #[inline(always)]
    pub(crate) fn emission_weight(&self, prev: Option<&PrevVertex>, light: &Incident) -> f32 {
        let Some(prev) = prev.filter(|prev| !prev.is_delta) else {
            return 1.0;
        };
        match self.direct {
            DirectLight::None => 1.0,
            DirectLight::Light => 0.0,
            DirectLight::Mis => self.heuristic.weight(prev.pdf, prev.light_samples as f32 * light.pdf),
        }
    }

    /// MIS weight of a light sample of density `pdf`, against a scattered ray in the same
    /// direction. `is_delta` is `true` for delta lights.
    #[inline(always)]
    pub(crate) fn light_weight(&self, pdf: f32, is_delta: bool, scattering_pdf: f32) -> f32 {
        if is_delta || self.direct != DirectLight::Mis {
            return 1.0;
        }
        self.heuristic.weight(pdf, scattering_pdf)
    }
}

impl Heuristic {
    /// Unnormalised weight of a strategy relative to another strategy. `ratio` is the ratio of
    /// their densities.
    pub(crate) fn raised(self, ratio: f64) -> f64 {
        match self {
            Self::Balance => ratio,
            Self::Power => ratio * ratio,
        }
    }

    fn weight(self, pdf: f32, other_pdf: f32) -> f32 {
        match self {
            Self::Balance => balance_heuristic(pdf, other_pdf),
            Self::Power => power_heuristic(pdf, other_pdf),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The weights for two strategies (paths) and for many strategies (bidirectional methods) have
    /// the same exponent.
    #[test]
    fn both_forms_of_a_heuristic_agree() {
        for heuristic in [Heuristic::Balance, Heuristic::Power] {
            for [pdf, other] in [[1.0f32, 3.0], [0.2, 0.7], [5.0, 0.1]] {
                let expected = 1.0 / (1.0 + heuristic.raised(f64::from(other) / f64::from(pdf)));
                let weight = f64::from(heuristic.weight(pdf, other));
                assert!((weight - expected).abs() < 1e-6, "{weight} {expected}");
            }
        }
    }
}
