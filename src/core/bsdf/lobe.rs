use super::energy::{DirectionTerms, EnergyLookup};
use super::{
    Blinn, BsdfSample, CoatedLambert, Dielectric, Lambert, Mirror, Phong, RoughConductor, RoughDielectric, Scattering,
    Sheen, ThinDielectric, TransportMode, same_hemisphere,
};
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3};

/// One way in which a surface scatters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lobe {
    /// Ideal diffuse reflection.
    Lambert(Lambert),
    /// Ideal diffuse reflection below a coat.
    CoatedLambert(CoatedLambert),
    /// Glossy reflection about the mirror direction.
    Phong(Phong),
    /// Glossy reflection by microfacets.
    Blinn(Blinn),
    /// Reflection by GGX microfacets.
    RoughConductor(RoughConductor),
    /// Boundary of a refracting medium, of GGX microfacets.
    RoughDielectric(RoughDielectric),
    /// Reflection by upright fibres.
    Sheen(Sheen),
    /// Perfect mirror.
    Mirror(Mirror),
    /// Boundary of a refracting medium.
    Dielectric(Dielectric),
    /// Sheet that lets light pass straight on.
    ThinDielectric(ThinDielectric),
}

impl Lobe {
    /// Whether it scatters into single directions only, which `eval` and `pdf` cannot see.
    pub fn is_delta(&self) -> bool {
        matches!(self, Self::Mirror(_) | Self::Dielectric(_) | Self::ThinDielectric(_))
    }

    /// How sharply it scatters.
    pub(super) fn scattering(&self) -> Scattering {
        match self {
            Self::Lambert(_) | Self::CoatedLambert(_) => Scattering::Diffuse,
            _ if self.is_delta() => Scattering::Specular,
            _ => Scattering::Glossy,
        }
    }

    /// Whether the lobe is drawn from in parts, between which a number of its own chooses.
    pub fn has_parts(&self) -> bool {
        matches!(self, Self::RoughConductor(_) | Self::RoughDielectric(_))
    }

    /// Whether it scatters widely: what it makes of light from a direction varies little from one direction to another near it, so that a mean over
    /// light from few directions is no noise. Facets count as wide from a roughness of 0.45 on (α = 0.2), the others where they are as wide as
    /// such facets (n = 2 / α² − 2 about the half vector, a quarter of that about the mirror direction: Walter et al. 2007, §5.2).
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

    /// Value for the pair of directions, for radiance and cosine excluded, sr⁻¹; 0 for delta lobes.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        self.eval_pdf(wo, wi).0
    }

    /// Density with which [`Lobe::sample`] draws `wi`, per solid angle; 0 for delta lobes.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.eval_pdf(wo, wi).1
    }

    /// [`Lobe::eval`] and [`Lobe::pdf`].
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        self.eval_pdf_with([&self.terms_of(wo), &self.terms_of(wi)], wo, wi)
    }

    /// Draws `wi` for `wo`: `u_lobe` chooses a part, where there are several, `u` a direction. `None` where nothing is
    /// scattered.
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        if self.is_delta() {
            // Of two single directions, the first by its share
            let [first, second] = self.directions(wo, mode);
            return first.filter(|s| u.x < s.pdf).or(second);
        }
        let terms = self.terms_of(wo);
        let wi = self.sample_direction(&terms, wo, u_lobe, u)?;
        let (f, pdf) = self.eval_pdf_with([&terms, &self.terms_of(wi)], wo, wi);
        // Only refraction is not the same both ways.
        let f = match (self, mode) {
            (Self::RoughDielectric(_), TransportMode::Importance) => self.eval(wi, wo),
            _ => f,
        };
        self.smooth_sample(f, wo, wi, pdf)
    }

    /// Terms that depend on the direction `w` alone; `energy` is its lookup, which lobes of one BSDF share.
    #[inline(always)]
    pub(super) fn terms(&self, energy: &mut EnergyLookup, w: Vec3) -> DirectionTerms {
        match self {
            Self::CoatedLambert(lobe) => lobe.terms(energy),
            Self::RoughConductor(lobe) => lobe.terms(energy, w),
            Self::RoughDielectric(lobe) => lobe.terms(w),
            _ => DirectionTerms::default(),
        }
    }

    /// [`Lobe::terms`] of a lobe by itself.
    fn terms_of(&self, w: Vec3) -> DirectionTerms {
        self.terms(&mut EnergyLookup::new(w), w)
    }

    /// [`Lobe::eval_pdf`] with the terms of `wo` and of `wi`. Most mixtures are coats over diffuse bases, and metals. Other lobes are kept out of line: inlined, their
    /// terms would be computed before the loop over lobes, also for BSDFs without such lobes.
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

    /// The direction of [`Lobe::sample`], of a smooth lobe.
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

    /// The direction `wi`, drawn by this lobe, with the value and the density of all that might have drawn it; `None` where it lies in the surface.
    pub(super) fn smooth_sample(&self, f: Spectrum, wo: Vec3, wi: Vec3, pdf: f32) -> Option<BsdfSample> {
        let eta = match self {
            Self::RoughDielectric(lobe) if !same_hemisphere(wo, wi) => lobe.eta(wo),
            _ => 1.0,
        };
        let sample = BsdfSample::new(f, wi, pdf, self.scattering()).with_eta(eta);
        (pdf > 0.0 && pdf.is_finite()).then_some(sample)
    }

    /// The single directions of a delta lobe, each with its share of the flux as density; none for others.
    pub fn directions(&self, wo: Vec3, mode: TransportMode) -> [Option<BsdfSample>; 2] {
        match self {
            Self::Mirror(lobe) => lobe.directions(wo),
            Self::Dielectric(lobe) => lobe.directions(wo, mode),
            Self::ThinDielectric(lobe) => lobe.directions(wo),
            _ => [None, None],
        }
    }

    /// Largest share of the flux that it may scatter, by channel.
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

    /// Share of uniform light that the lobe scatters to `wo`, by channel, with the terms of `wo`.
    /// Transmitted light counts by its flux: refraction changes radiance, but not this share.
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

    /// [`Lobe::directional_albedo`] of a lobe alone.
    pub(super) fn directional_albedo_alone(&self, wo: Vec3) -> Spectrum {
        self.directional_albedo(&self.terms_of(wo), wo)
    }

    /// Estimate of the share that is scattered for `wo`, by channel: lobes are chosen by it.
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
