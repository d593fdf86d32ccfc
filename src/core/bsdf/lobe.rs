use super::energy::{DirectionTerms, EnergyLookup};
use super::{
    Blinn, BsdfSample, CoatedLambert, Dielectric, Lambert, Mirror, Phong, RoughConductor, RoughDielectric, Scattering,
    Sheen, ThinDielectric, TransportMode, same_hemisphere,
};
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3};

/// Lobe of a BSDF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lobe {
    /// Ideal diffuse reflection.
    Lambert(Lambert),
    /// Ideal diffuse reflection below a coat.
    CoatedLambert(CoatedLambert),
    /// Glossy reflection around the mirror direction.
    Phong(Phong),
    /// Glossy reflection by microfacets.
    Blinn(Blinn),
    /// Reflection by GGX microfacets.
    RoughConductor(RoughConductor),
    /// Rough boundary of a refracting medium, with GGX microfacets.
    RoughDielectric(RoughDielectric),
    /// Reflection by upright fibres.
    Sheen(Sheen),
    /// Perfect mirror.
    Mirror(Mirror),
    /// Smooth boundary of a refracting medium.
    Dielectric(Dielectric),
    /// Thin dielectric that transmits light without refraction.
    ThinDielectric(ThinDielectric),
}

impl Lobe {
    /// Returns true if the lobe scatters into single directions only. `eval` and `pdf` are then 0.
    pub fn is_delta(&self) -> bool {
        matches!(self, Self::Mirror(_) | Self::Dielectric(_) | Self::ThinDielectric(_))
    }

    /// Width of the lobe.
    pub(super) fn scattering(&self) -> Scattering {
        match self {
            Self::Lambert(_) | Self::CoatedLambert(_) => Scattering::Diffuse,
            _ if self.is_delta() => Scattering::Specular,
            _ => Scattering::Glossy,
        }
    }

    /// Returns true if sampling chooses between parts of the lobe, which takes an additional random
    /// number.
    pub fn has_parts(&self) -> bool {
        matches!(self, Self::RoughConductor(_) | Self::RoughDielectric(_))
    }

    /// Returns true if the lobe is wide. The value of a wide lobe varies little between
    /// neighbouring directions, so a mean over light from few directions has little noise.
    ///
    /// GGX facets are wide if their roughness is at least 0.45 (α = 0.2). Blinn's and Phong's lobes
    /// are wide if they are at least as wide as such facets. The limit of Blinn's exponent is n = 2
    /// / α² − 2. The limit of Phong's exponent is a quarter of n, because Phong's lobe depends on
    /// the angle with the mirror direction, which is about twice the angle of the half vector
    /// (Walter et al. 2007, §5.2).
    pub fn is_wide(&self) -> bool {
        const ROUGHNESS: f32 = 0.45;
        const EXPONENT: f32 = 48.0;
        match self {
            Self::Lambert(_) | Self::CoatedLambert(_) | Self::Sheen(_) => true,
            Self::Phong(lobe) => lobe.exponent <= 0.25 * EXPONENT,
            Self::Blinn(lobe) => lobe.exponent <= EXPONENT,
            Self::RoughConductor(lobe) => lobe.roughness() >= ROUGHNESS,
            Self::RoughDielectric(lobe) => lobe.roughness() >= ROUGHNESS,
            Self::Mirror(_) | Self::Dielectric(_) | Self::ThinDielectric(_) => false,
        }
    }

    /// Value for radiance, cosine excluded, sr⁻¹; 0 for delta lobes.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        self.eval_pdf(wo, wi).0
    }

    /// Density of `wi` in [`Lobe::sample`], per solid angle; 0 for delta lobes.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.eval_pdf(wo, wi).1
    }

    /// [`Lobe::eval`] and [`Lobe::pdf`].
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        self.eval_pdf_with([&self.terms_of(wo), &self.terms_of(wi)], wo, wi)
    }

    /// Samples `wi` for `wo`: `u_lobe` chooses a part of the lobe, if the lobe has parts, and `u`
    /// chooses a direction. `None` if the sample carries no light.
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        if self.is_delta() {
            // Choose one of the two directions. The probability of the first is its fraction of the
            // flux
            let [first, second] = self.directions(wo, mode);
            return first.filter(|s| u.x < s.pdf).or(second);
        }
        let terms = self.terms_of(wo);
        let wi = self.sample_direction(&terms, wo, u_lobe, u)?;
        let (f, pdf) = self.eval_pdf_with([&terms, &self.terms_of(wi)], wo, wi);
        // For importance, exchange the directions of the rough dielectric. No other lobe is
        // asymmetric.
        let f = match (self, mode) {
            (Self::RoughDielectric(_), TransportMode::Importance) => self.eval(wi, wo),
            _ => f,
        };
        self.smooth_sample(f, wo, wi, pdf)
    }

    /// Terms that depend on the direction `w` only. All lobes of a BSDF use the same lookup
    /// `energy`.
    #[inline(always)]
    pub(super) fn terms(&self, energy: &mut EnergyLookup, w: Vec3) -> DirectionTerms {
        match self {
            Self::CoatedLambert(lobe) => lobe.terms(energy),
            Self::RoughConductor(lobe) => lobe.terms(energy, w),
            Self::RoughDielectric(lobe) => lobe.terms(w),
            _ => DirectionTerms::default(),
        }
    }

    /// [`Lobe::terms`] with a separate energy lookup.
    fn terms_of(&self, w: Vec3) -> DirectionTerms {
        self.terms(&mut EnergyLookup::new(w), w)
    }

    /// [`Lobe::eval_pdf`] with the terms of `wo` and of `wi`. The lobes of most mixtures are coats,
    /// diffuse bases and metals. The code of other lobes is not inlined. If it were, the terms of
    /// these lobes would be computed before the loop over lobes, even for BSDFs without these
    /// lobes.
    #[inline(always)]
    pub(super) fn eval_pdf_with(&self, [o, i]: [&DirectionTerms; 2], wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        match self {
            Self::Lambert(lobe) => lobe.eval_pdf(wo, wi),
            Self::CoatedLambert(lobe) => lobe.eval_pdf(o, i, wo, wi),
            Self::Phong(lobe) => lobe.eval_pdf(wo, wi),
            Self::Blinn(lobe) => lobe.eval_pdf(wo, wi),
            Self::RoughConductor(lobe) => lobe.eval_pdf(o, i, wo, wi),
            Self::Sheen(lobe) => lobe.eval_pdf(wo, wi),
            Self::RoughDielectric(lobe) => lobe.eval_pdf(o, i, wo, wi),
            Self::Mirror(_) | Self::Dielectric(_) | Self::ThinDielectric(_) => (Spectrum::ZERO, 0.0),
        }
    }

    /// Direction of [`Lobe::sample`], for a smooth lobe.
    pub(super) fn sample_direction(&self, terms: &DirectionTerms, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<Vec3> {
        match self {
            Self::Lambert(_) | Self::CoatedLambert(_) => Some(Lambert::sample_direction(wo, u)),
            Self::Phong(lobe) => lobe.sample_direction(wo, u),
            Self::Blinn(lobe) => lobe.sample_direction(wo, u),
            Self::RoughConductor(lobe) => lobe.sample_direction(terms, wo, u_lobe, u),
            Self::Sheen(_) => Some(Sheen::sample_direction(wo, u)),
            Self::RoughDielectric(lobe) => lobe.sample_direction(terms, wo, u_lobe, u),
            Self::Mirror(_) | Self::Dielectric(_) | Self::ThinDielectric(_) => None,
        }
    }

    /// Sample with the direction `wi`, which this lobe has sampled. `f` and `pdf` are the value and
    /// density of all smooth lobes. `None` if `pdf` is 0 or not finite, as for a direction in the
    /// surface.
    pub(super) fn smooth_sample(&self, f: Spectrum, wo: Vec3, wi: Vec3, pdf: f32) -> Option<BsdfSample> {
        let eta = match self {
            Self::RoughDielectric(lobe) if !same_hemisphere(wo, wi) => lobe.eta(wo),
            _ => 1.0,
        };
        let sample = BsdfSample::new(f, wi, pdf, self.scattering()).with_eta(eta);
        (pdf > 0.0 && pdf.is_finite()).then_some(sample)
    }

    /// One sample for each direction of a delta lobe. The density of a sample is the fraction of
    /// the flux that the lobe scatters into this direction. `None` for other lobes.
    pub fn directions(&self, wo: Vec3, mode: TransportMode) -> [Option<BsdfSample>; 2] {
        match self {
            Self::Mirror(lobe) => lobe.directions(wo),
            Self::Dielectric(lobe) => lobe.directions(wo, mode),
            Self::ThinDielectric(lobe) => lobe.directions(wo),
            _ => [None, None],
        }
    }

    /// Estimate of the fraction of the flux that the lobe scatters, by channel, without a view
    /// direction. Fresnel terms count as 1, except Schlick's term of GGX facets and mirrors, which
    /// counts with its mean. Dielectrics return their transmittance. The coated base and the sheen
    /// return their mean albedo.
    pub fn albedo(&self) -> Spectrum {
        match self {
            Self::Lambert(lobe) => lobe.albedo,
            Self::CoatedLambert(lobe) => lobe.albedo(),
            Self::Phong(lobe) => lobe.reflectance,
            Self::Blinn(lobe) => lobe.reflectance,
            Self::RoughConductor(lobe) => lobe.albedo(),
            Self::Sheen(lobe) => lobe.albedo(),
            Self::RoughDielectric(lobe) => lobe.albedo(),
            Self::Mirror(lobe) => lobe.reflectance * lobe.fresnel.tint(),
            Self::Dielectric(lobe) => lobe.transmittance,
            Self::ThinDielectric(lobe) => lobe.transmittance,
        }
    }

    /// Directional albedo: fraction of uniform light that the lobe scatters to `wo`, by channel.
    /// `terms` are the terms of `wo`. Transmitted light counts by its flux: refraction changes
    /// radiance, but not flux.
    pub(super) fn directional_albedo(&self, terms: &DirectionTerms, wo: Vec3) -> Spectrum {
        match self {
            Self::Lambert(lobe) => lobe.albedo,
            Self::CoatedLambert(lobe) => lobe.albedo_towards(terms),
            Self::Phong(lobe) => lobe.directional_albedo(wo),
            Self::Blinn(lobe) => lobe.directional_albedo(wo),
            Self::RoughConductor(lobe) => lobe.directional_albedo(terms),
            Self::Sheen(lobe) => lobe.albedo_towards(wo),
            Self::RoughDielectric(lobe) => lobe.directional_albedo(terms, wo),
            Self::Mirror(lobe) => lobe.reflectance * lobe.fresnel.fast_reflectance(wo.z.abs()),
            Self::Dielectric(lobe) => lobe.directional_albedo(wo),
            Self::ThinDielectric(lobe) => lobe.directional_albedo(wo),
        }
    }

    /// [`Lobe::directional_albedo`], which also computes the terms of `wo`.
    pub(super) fn directional_albedo_alone(&self, wo: Vec3) -> Spectrum {
        self.directional_albedo(&self.terms_of(wo), wo)
    }

    /// Estimate of the directional albedo towards `wo`, by channel. Sampling chooses lobes in
    /// proportion to this estimate.
    pub(super) fn albedo_towards(&self, wo: Vec3) -> Spectrum {
        self.albedo_with(&self.terms_of(wo), wo)
    }

    /// [`Lobe::albedo_towards`] with the terms of `wo`.
    #[inline(always)]
    pub(super) fn albedo_with(&self, terms: &DirectionTerms, wo: Vec3) -> Spectrum {
        match self {
            Self::CoatedLambert(lobe) => lobe.albedo_towards(terms),
            Self::RoughConductor(lobe) => lobe.albedo_towards(terms, wo),
            Self::Sheen(lobe) => lobe.albedo_towards(wo),
            Self::Blinn(lobe) => lobe.reflectance * lobe.fresnel.reflectance(wo.z.abs()),
            Self::Mirror(lobe) => lobe.reflectance * lobe.fresnel.reflectance(wo.z.abs()),
            _ => self.albedo(),
        }
    }
}
