use super::energy::{DirectionTerms, EnergyTable, dielectric_loss, dielectric_reflected};
use super::ggx::Ggx;
use super::{Fresnel, fresnel, half_vector, same_hemisphere};
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3};
use std::f32::consts::PI;

/// A dielectric boundary whose GGX microfacets reflect by Fresnel's equations and refract the rest
/// by Snell's law (Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces").
///
/// +z is the outside. Radiance that crosses the boundary changes with the square of the index. The
/// energy loss of single scattering is distributed to both sides (Kulla and Conty 2017), so that
/// without absorption all light leaves the boundary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughDielectric {
    facets: Ggx,
    /// Factor of the reflected light.
    reflectance: [f32; 3],
    /// Factor of the refracted light.
    transmittance: [f32; 3],
    /// Index of refraction inside, relative to the outside.
    ior: f32,
    /// Energy loss for light from the outside, and for light from the inside.
    sides: [EnergySide; 2],
}

/// Energy loss of single scattering, for light from one side.
#[derive(Clone, Copy, Debug, PartialEq)]
struct EnergySide {
    /// Mean fraction of the light that is lost.
    missing: f32,
    /// Fraction of the loss that returns to the side from which the light came.
    reflected: f32,
}

impl RoughDielectric {
    /// Reflectance, transmittance, index of refraction.
    pub(super) fn parameters(&self) -> ([f32; 3], [f32; 3], f32) {
        (self.reflectance, self.transmittance, self.ior)
    }

    /// Roughness `√α` of the facets. For anisotropic facets, `α` is the geometric mean of `αx` and
    /// `αy`.
    pub fn roughness(&self) -> f32 {
        self.facets.roughness()
    }

    /// Lobe of microfacets with the widths `αx` and `αy`, between [`super::MIN_ALPHA`] and 1. `ior`
    /// is the index of refraction inside, relative to the outside. The index must not be 1, because
    /// without refraction there is no half vector.
    pub fn new(reflectance: Spectrum, transmittance: Spectrum, alpha: Vec2, ior: f32) -> Self {
        let facets = Ggx::new(alpha);
        let missing = [ior, 1.0 / ior].map(|eta| dielectric_loss(facets.roughness(), eta).mean());
        // Smooth boundaries transmit 1 − F into the denser medium, and (1 − F) / η² out of it,
        // which is reciprocal. A part of the lost light is transmitted to the other side. It is
        // reciprocal if the fraction of this part is proportional to the mean transmittance and to
        // the loss on the other side.
        let denser = ior.max(1.0 / ior);
        let entered = 1.0 - Fresnel::Dielectric { eta: denser }.mean().max_component();
        let left = entered / (denser * denser);
        let passed = if ior >= 1.0 { [entered, left] } else { [left, entered] };
        let largest = missing[0].max(missing[1]);
        let side = |here: usize, beyond: usize| EnergySide {
            missing: missing[here],
            reflected: 1.0 - passed[here] * missing[beyond] / largest,
        };
        Self {
            facets,
            reflectance: reflectance.to_array(),
            transmittance: transmittance.to_array(),
            ior,
            sides: [side(0, 1), side(1, 0)],
        }
    }

    /// Terms that depend on the direction `w` only: the energy loss of single scattering, and the
    /// density of multiple scattering.
    #[inline(never)]
    pub(super) fn terms(&self, w: Vec3) -> DirectionTerms {
        let loss = self.missing(w);
        DirectionTerms {
            share: loss.towards(w.z.abs()),
            several_pdf: loss.pdf(w.z.abs()),
            ..DirectionTerms::default()
        }
    }

    /// Returns the value of the lobe for radiance, sr⁻¹, and the density of `wi` per solid angle.
    ///
    /// The value is the sum of single scattering (Walter et al. 2007, eq. 20 and 21) and multiple
    /// scattering. For importance, exchange the directions. The density is the density of visible
    /// facets times the Jacobian of the half vector (eq. 14 and 17), mixed with the density of
    /// multiple scattering on both sides.
    #[inline(never)]
    pub(super) fn eval_pdf(&self, o: &DirectionTerms, i: &DirectionTerms, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        if wo.z == 0.0 || wi.z == 0.0 {
            return (Spectrum::ZERO, 0.0);
        }
        let eta = self.eta(wo);
        let [here, beyond] = self.sides(wo);
        let (missing_o, missing_i) = (o.share, i.share);
        let (f, single_pdf, share) = if same_hemisphere(wo, wi) {
            let (single, pdf) = half_vector(wo, wi).map_or((0.0, 0.0), |(h, cos)| {
                let r = fresnel::dielectric(cos, eta).0;
                (
                    r * self.facets.reflection(wo, wi, h),
                    0.25 * r * self.facets.visible_density(wo, h),
                )
            });
            let several = here.reflected * (missing_o * missing_i) / (PI * here.missing);
            (
                Spectrum::from(self.reflectance) * (single + several),
                pdf,
                here.reflected,
            )
        } else {
            let (single, pdf) = Refraction::new(wo, wi, eta).map_or((0.0, 0.0), |r| {
                let seen = r.share * self.facets.visible_density(wo, r.h) * r.cos_o * r.cos_i;
                (
                    seen / r.squared * (self.facets.visible(wi) / wi.z.abs()),
                    seen * eta * eta / r.squared,
                )
            });
            let passed = 1.0 - here.reflected;
            let several = passed * (missing_o * missing_i) / (PI * beyond.missing * eta * eta);
            (Spectrum::from(self.transmittance) * (single + several), pdf, passed)
        };
        let several_pdf = missing_o * share * i.several_pdf;
        (f, (1.0 - missing_o) * single_pdf + several_pdf)
    }

    /// Samples a visible facet, which reflects or refracts, or samples a direction of multiple
    /// scattering. `u_lobe` chooses between the two, and between reflection and refraction.
    pub(super) fn sample_direction(&self, terms: &DirectionTerms, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<Vec3> {
        if wo.z == 0.0 {
            return None;
        }
        let eta = self.eta(wo);
        let several = terms.share;
        if u_lobe < several {
            let [here, _] = self.sides(wo);
            let side = if u_lobe < several * here.reflected { wo } else { -wo };
            let wi = self.missing(side).sample(u);
            return Some(Vec3::new(wi.x, wi.y, wi.z.copysign(side.z)));
        }
        let u_lobe = (u_lobe - several) / (1.0 - several);
        let h = self.facets.sample_visible(wo, u);
        let cos_o = wo.dot(h).max(0.0);
        let (r, cos_t) = fresnel::dielectric(cos_o, eta);
        let reflects = u_lobe < r;
        let wi = if reflects {
            2.0 * cos_o * h - wo
        } else {
            fresnel::refract(wo, h, cos_o, cos_t, eta)
        };
        // Reject reflected directions that leave on the other side of the surface, and refracted
        // directions that leave on the same side.
        (reflects == same_hemisphere(wo, wi)).then(|| wi.normalize())
    }

    /// Factor of the transmitted light, as for a smooth boundary.
    pub(super) fn albedo(&self) -> Spectrum {
        self.transmittance.into()
    }

    /// Directional albedo: fraction of the flux of uniform light that is reflected or refracted to
    /// `wo`, by channel.
    pub(super) fn directional_albedo(&self, terms: &DirectionTerms, wo: Vec3) -> Spectrum {
        let [here, _] = self.sides(wo);
        let missing = terms.share;
        let single = dielectric_reflected(self.facets.roughness(), self.eta(wo)).towards(wo.z.abs());
        let reflected = single + here.reflected * missing;
        let passed = (1.0 - reflected).max(0.0);
        Spectrum::from(self.reflectance) * reflected + Spectrum::from(self.transmittance) * passed
    }

    /// Index of refraction beyond the surface, relative to the side of `w`.
    pub(super) fn eta(&self, w: Vec3) -> f32 {
        if w.z > 0.0 { self.ior } else { 1.0 / self.ior }
    }

    /// Energy loss for light from the side of `w`, and for light from the other side.
    fn sides(&self, w: Vec3) -> [EnergySide; 2] {
        let [outside, inside] = self.sides;
        if w.z > 0.0 {
            [outside, inside]
        } else {
            [inside, outside]
        }
    }

    /// Table of the energy loss of single scattering, for light from the side of `w`.
    fn missing(&self, w: Vec3) -> EnergyTable<4> {
        dielectric_loss(self.facets.roughness(), self.eta(w))
    }
}

/// A facet that refracts one direction to another.
struct Refraction {
    /// Normal of the facet, on the side of `wo`.
    h: Vec3,
    /// Cosines, ≥ 0, of `wo` and `wi` with the normal on their side.
    cos_o: f32,
    cos_i: f32,
    /// Transmittance of the facet, 1 minus its Fresnel reflectance.
    share: f32,
    /// `(wo·h + η wi·h)²`, the squared length of the half vector.
    squared: f32,
}

impl Refraction {
    /// Facet that refracts `wo` to `wi`. `eta` is the index on the side of `wi`, relative to the
    /// side of `wo`. `None` if there is no such facet.
    fn new(wo: Vec3, wi: Vec3, eta: f32) -> Option<Self> {
        let sum = wo + eta * wi;
        let h = sum.try_normalize()?;
        let h = h * 1f32.copysign(h.z * wo.z);
        let (cos_o, cos_i) = (wo.dot(h), -wi.dot(h));
        (cos_o > 0.0 && cos_i > 0.0).then(|| Self {
            h,
            cos_o,
            cos_i,
            share: 1.0 - fresnel::dielectric(cos_o, eta).0,
            squared: sum.length_squared(),
        })
    }
}
