use super::energy::{self, Missing};
use super::ggx::Ggx;
use super::{BsdfSample, Fresnel, Scattering, half_vector, same_hemisphere};
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3};
use std::f32::consts::PI;

/// Reflection by GGX microfacets, alike on both sides of the surface (Walter et al. 2007; Heitz 2014): a rough metal,
/// or the rough coat of something else.
///
/// Light that is reflected several times between facets is added as a lobe of its own (Kulla and Conty 2017): a surface
/// of reflectance 1 reflects all light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughMirror {
    facets: Ggx,
    /// Factor of all that is reflected.
    reflectance: [f32; 3],
    fresnel: Fresnel,
    /// What several reflections give, over the shares that single ones leave behind towards both directions.
    several: [f32; 3],
}

impl RoughMirror {
    /// Reflectance and Fresnel term.
    pub(super) fn parameters(&self) -> ([f32; 3], Fresnel) {
        (self.reflectance, self.fresnel)
    }

    /// `√α` of its facets, the roughness of those that are alike along all tangents.
    pub fn roughness(&self) -> f32 {
        self.facets.roughness()
    }

    /// Facets of slopes `αx` and `αy` (squares of what is called roughness), between [`super::MIN_ALPHA`] and 1, that
    /// reflect `reflectance` times the share `fresnel`.
    pub fn new(reflectance: Spectrum, alpha: Vec2, fresnel: Fresnel) -> Self {
        let facets = Ggx::new(alpha);
        let reflectance = reflectance.to_array();
        let missing = Missing::of_mirrors(facets.roughness()).mean();
        let mean = fresnel.mean().to_array();
        Self {
            facets,
            reflectance,
            fresnel,
            several: [0, 1, 2].map(|c| reflectance[c] * energy::several_reflections(mean[c], missing) / (PI * missing)),
        }
    }

    /// A mixture of a metal of colour `base` and a dielectric that reflects `f0` along the normal, both by Schlick's
    /// formula, in the shares `metallic` and the rest.
    pub fn metallic(reflectance: Spectrum, alpha: Vec2, base: Spectrum, f0: f32, metallic: f32) -> Self {
        let mixed = |metal: Spectrum, rest: Spectrum| metal * metallic + rest * (1.0 - metallic);
        let of = |f0: Spectrum| Self::new(reflectance, alpha, Fresnel::Schlick { f0: f0.to_array() });
        let rest = Spectrum::splat(f0);
        // One reflection is linear in the colour along the normal, several are not.
        Self {
            several: mixed(of(base).several.into(), of(rest).several.into()).to_array(),
            ..of(mixed(base, rest))
        }
    }

    /// Value of the lobe, sr⁻¹: `D F G₂ / (4 cos θi cos θo)` and what several reflections add.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        if !same_hemisphere(wo, wi) {
            return Spectrum::ZERO;
        }
        let single = half_vector(wo, wi).map_or(Spectrum::ZERO, |(h, cos)| {
            self.reflectance() * self.fresnel.reflectance(cos) * self.facets.reflection(wo, wi, h)
        });
        let missing = self.missing();
        single + Spectrum::from(self.several) * (missing.towards(wo.z.abs()) * missing.towards(wi.z.abs()))
    }

    /// Density of [`RoughMirror::sample`]: that of reflections by visible facets, `D G₁ / (4 cos θo)`, and of what
    /// several reflections add.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if !same_hemisphere(wo, wi) {
            return 0.0;
        }
        let single = half_vector(wo, wi).map_or(0.0, |(h, _)| 0.25 * self.facets.visible_density(wo, h));
        let missing = self.missing();
        let several = missing.towards(wo.z.abs());
        (1.0 - several) * single + several * missing.pdf(wi.z.abs())
    }

    /// Draws a visible facet and reflects `wo` by it, or takes a direction of several reflections, which `u_lobe`
    /// chooses; what falls below the horizon carries nothing.
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let missing = self.missing();
        let wi = if u_lobe < missing.towards(wo.z.abs()) {
            let wi = missing.sample(u);
            Vec3::new(wi.x, wi.y, wi.z.copysign(wo.z))
        } else {
            let h = self.facets.sample_visible(wo, u);
            (2.0 * wo.dot(h) * h - wo).normalize()
        };
        let pdf = self.pdf(wo, wi);
        (pdf > 0.0 && pdf.is_finite()).then(|| BsdfSample::new(self.eval(wo, wi), wi, pdf, Scattering::Glossy))
    }

    /// Share that may be reflected, by channel.
    pub(super) fn albedo(&self) -> Spectrum {
        self.reflectance() * self.fresnel.tint()
    }

    /// Share that is reflected for `wo`, by channel: exact for Schlick's term, an estimate for others.
    pub(super) fn albedo_towards(&self, wo: Vec3) -> Spectrum {
        let cos = wo.z.abs();
        let mean = self.missing().mean();
        let missing = self.missing().towards(cos);
        let single = match self.fresnel {
            Fresnel::Schlick { f0 } => {
                let grazing = energy::grazing(cos, self.facets.roughness());
                Spectrum::from(f0) * (1.0 - missing - grazing) + Spectrum::splat(grazing)
            }
            _ => self.fresnel.reflectance(cos) * (1.0 - missing),
        };
        let several = Spectrum::from(self.several) * (PI * mean * missing);
        self.reflectance() * single + several
    }

    fn reflectance(&self) -> Spectrum {
        self.reflectance.into()
    }

    /// What one reflection leaves behind.
    fn missing(&self) -> Missing {
        Missing::of_mirrors(self.facets.roughness())
    }
}
