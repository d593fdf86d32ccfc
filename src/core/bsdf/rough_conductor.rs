use super::energy::{self, ConductorTables, DirectionTerms, EnergyLookup};
use super::ggx::Ggx;
use super::{Fresnel, half_vector, same_hemisphere};
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3};
use std::f32::consts::PI;

/// Reflection by GGX microfacets, symmetric on both sides of the surface (Walter et al. 2007; Heitz
/// 2014): a rough metal or a rough coat.
///
/// Multiple scattering between facets is added as a separate lobe (Kulla and Conty 2017), so that a
/// surface with reflectance 1 reflects all light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughConductor {
    facets: Ggx,
    /// Factor of the reflected light.
    reflectance: [f32; 3],
    fresnel: Fresnel,
    /// Value of multiple reflections, sr⁻¹, divided by the product of the energy losses of single
    /// reflections towards `wo` and `wi`.
    several: [f32; 3],
}

impl RoughConductor {
    /// Reflectance and Fresnel term.
    pub(super) fn parameters(&self) -> ([f32; 3], Fresnel) {
        (self.reflectance, self.fresnel)
    }

    /// Returns true if the Fresnel term is Schlick's formula.
    pub(super) fn is_schlick(&self) -> bool {
        matches!(self.fresnel, Fresnel::Schlick { .. })
    }

    /// Returns the parameters for [`super::BsdfLanes`]. These are the widths `αx` and `αy`, and
    /// three values by channel: factor of single reflections, reflectance along the normal, and
    /// factor of multiple reflections.
    pub(super) fn lane_parameters(&self) -> (Vec2, [[f32; 3]; 3]) {
        let f0 = match self.fresnel {
            Fresnel::Schlick { f0 } => f0,
            _ => [1.0; 3],
        };
        (self.facets.slopes(), [self.reflectance, f0, self.several])
    }

    /// Roughness `√α` of the facets. For anisotropic facets, `α` is the geometric mean of `αx` and
    /// `αy`.
    pub fn roughness(&self) -> f32 {
        self.facets.roughness()
    }

    /// Lobe of microfacets with the widths `αx` and `αy` (squares of the roughness), between
    /// [`super::MIN_ALPHA`] and 1. The facets reflect `reflectance` times `fresnel`.
    pub fn new(reflectance: Spectrum, alpha: Vec2, fresnel: Fresnel) -> Self {
        let facets = Ggx::new(alpha);
        let reflectance = reflectance.to_array();
        let missing = ConductorTables::new(facets.roughness()).loss().mean();
        let mean = fresnel.mean().to_array();
        Self {
            facets,
            reflectance,
            fresnel,
            several: [0, 1, 2].map(|c| reflectance[c] * energy::several_reflections(mean[c], missing) / (PI * missing)),
        }
    }

    /// Mixture of a metal of colour `base` and a dielectric with reflectance `f0` along the normal,
    /// both by Schlick's formula. `metallic` is the fraction of the metal.
    pub fn metallic(reflectance: Spectrum, alpha: Vec2, base: Spectrum, f0: f32, metallic: f32) -> Self {
        let mixed = |metal: Spectrum, rest: Spectrum| metal * metallic + rest * (1.0 - metallic);
        let of = |f0: Spectrum| Self::new(reflectance, alpha, Fresnel::Schlick { f0: f0.to_array() });
        let rest = Spectrum::splat(f0);
        // Single reflections are linear in the reflectance along the normal, so one lobe with the
        // mixed reflectance is enough. Multiple reflections are not linear, so mix the factors of
        // both lobes.
        Self {
            several: mixed(of(base).several.into(), of(rest).several.into()).to_array(),
            ..of(mixed(base, rest))
        }
    }

    /// Terms that depend on the direction `w` only.
    #[inline(always)]
    pub(super) fn terms(&self, energy: &mut EnergyLookup, w: Vec3) -> DirectionTerms {
        let energy = energy.of(self.facets.roughness());
        DirectionTerms {
            share: energy.loss,
            several_pdf: energy.loss_pdf,
            energy,
            stretched: self.facets.stretched(w),
        }
    }

    /// Returns the value of the lobe, sr⁻¹, and the density of `wi` per solid angle. The value is
    /// `D F G₂ / (4 cos θi cos θo)` plus multiple reflections. The density is a mixture of `D G₁ /
    /// (4 cos θo)` and the density of multiple reflections.
    #[inline(always)]
    pub(super) fn eval_pdf(&self, o: &DirectionTerms, i: &DirectionTerms, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        if !same_hemisphere(wo, wi) {
            return (Spectrum::ZERO, 0.0);
        }
        let (single, single_pdf) = half_vector(wo, wi).map_or((Spectrum::ZERO, 0.0), |(h, cos)| {
            let d = self.facets.density(h);
            let reflection = d * self.facets.shadowed_reflection(wo, wi, [o.stretched, i.stretched]);
            (
                self.reflectance() * self.fresnel.reflectance(cos) * reflection,
                0.25 * d * self.facets.seen(wo, o.stretched),
            )
        });
        let several = Spectrum::from(self.several) * (o.share * i.share);
        (single + several, (1.0 - o.share) * single_pdf + o.share * i.several_pdf)
    }

    /// Samples a visible facet and reflects `wo` on it, or samples a direction of multiple
    /// reflections. `u_lobe` chooses between the two. `None` if the direction lies below the
    /// horizon.
    pub(super) fn sample_direction(&self, terms: &DirectionTerms, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<Vec3> {
        let wi = if u_lobe < terms.share {
            let wi = ConductorTables::new(self.facets.roughness()).loss().sample(u);
            Vec3::new(wi.x, wi.y, wi.z.copysign(wo.z))
        } else {
            let h = self.facets.sample_visible(wo, u);
            (2.0 * wo.dot(h) * h - wo).normalize()
        };
        same_hemisphere(wo, wi).then_some(wi)
    }

    /// Estimate of the reflected fraction of the light, by channel. Schlick's term counts with its
    /// mean, other Fresnel terms count as 1.
    pub(super) fn albedo(&self) -> Spectrum {
        self.reflectance() * self.fresnel.tint()
    }

    /// Directional albedo: fraction of uniform light that is reflected to `wo`, by channel.
    pub(super) fn directional_albedo(&self, terms: &DirectionTerms) -> Spectrum {
        let missing = terms.share;
        let single = self.fresnel.mean_reflectance(1.0 - missing, terms.energy.grazing);
        let several = Spectrum::from(self.several) * (PI * terms.energy.mean_loss * missing);
        self.reflectance() * single + several
    }

    /// Directional albedo towards `wo`, by channel: exact for Schlick's term, an estimate for other
    /// terms.
    #[inline(always)]
    pub(super) fn albedo_towards(&self, terms: &DirectionTerms, wo: Vec3) -> Spectrum {
        let (missing, grazing) = (terms.share, terms.energy.grazing);
        let single = match self.fresnel {
            Fresnel::Schlick { f0 } => Spectrum::from(f0) * (1.0 - missing - grazing) + Spectrum::splat(grazing),
            _ => self.fresnel.reflectance(wo.z.abs()) * (1.0 - missing),
        };
        let several = Spectrum::from(self.several) * (PI * terms.energy.mean_loss * missing);
        self.reflectance() * single + several
    }

    fn reflectance(&self) -> Spectrum {
        self.reflectance.into()
    }
}
