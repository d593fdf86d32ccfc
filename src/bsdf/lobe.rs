use super::{
    Blinn, BsdfSample, CoatedLambert, Dielectric, Lambert, Mirror, Phong, RoughDielectric, RoughMirror, Sheen,
    ThinSheet, TransportMode,
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
    RoughMirror(RoughMirror),
    /// Boundary of a refracting medium, of GGX microfacets.
    RoughDielectric(RoughDielectric),
    /// Reflection by upright fibres.
    Sheen(Sheen),
    /// Perfect mirror.
    Mirror(Mirror),
    /// Boundary of a refracting medium.
    Dielectric(Dielectric),
    /// Sheet that lets light pass straight on.
    ThinSheet(ThinSheet),
}

impl Lobe {
    /// Whether it scatters into single directions only, which `eval` and `pdf` cannot see.
    pub fn is_delta(&self) -> bool {
        matches!(self, Self::Mirror(_) | Self::Dielectric(_) | Self::ThinSheet(_))
    }

    /// Whether it is drawn from in parts, between which a number of its own chooses.
    pub fn has_parts(&self) -> bool {
        matches!(self, Self::RoughMirror(_) | Self::RoughDielectric(_))
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
            Self::RoughMirror(lobe) => lobe.roughness() >= ROUGHNESS,
            Self::RoughDielectric(lobe) => lobe.roughness() >= ROUGHNESS,
            Self::Mirror(_) | Self::Dielectric(_) | Self::ThinSheet(_) => false,
        }
    }

    /// Value for the pair of directions, for radiance and cosine excluded, sr⁻¹; 0 for delta lobes.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        match self {
            Self::Lambert(lobe) => lobe.eval(wo, wi),
            Self::CoatedLambert(lobe) => lobe.eval(wo, wi),
            Self::Phong(lobe) => lobe.eval(wo, wi),
            Self::Blinn(lobe) => lobe.eval(wo, wi),
            Self::RoughMirror(lobe) => lobe.eval(wo, wi),
            Self::Sheen(lobe) => lobe.eval(wo, wi),
            Self::RoughDielectric(lobe) => lobe.eval(wo, wi),
            Self::Mirror(_) | Self::Dielectric(_) | Self::ThinSheet(_) => Spectrum::ZERO,
        }
    }

    /// Density with which [`Lobe::sample`] draws `wi`, per solid angle; 0 for delta lobes.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        match self {
            Self::Lambert(lobe) => lobe.pdf(wo, wi),
            Self::CoatedLambert(lobe) => lobe.pdf(wo, wi),
            Self::Phong(lobe) => lobe.pdf(wo, wi),
            Self::Blinn(lobe) => lobe.pdf(wo, wi),
            Self::RoughMirror(lobe) => lobe.pdf(wo, wi),
            Self::Sheen(lobe) => lobe.pdf(wo, wi),
            Self::RoughDielectric(lobe) => lobe.pdf(wo, wi),
            Self::Mirror(_) | Self::Dielectric(_) | Self::ThinSheet(_) => 0.0,
        }
    }

    /// Draws `wi` for `wo`: `u_lobe` chooses a part, where there are several, `u` a direction. `None` where nothing is
    /// scattered.
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        match self {
            Self::Lambert(lobe) => lobe.sample(wo, u),
            Self::CoatedLambert(lobe) => lobe.sample(wo, u),
            Self::Phong(lobe) => lobe.sample(wo, u),
            Self::Blinn(lobe) => lobe.sample(wo, u),
            Self::RoughMirror(lobe) => lobe.sample(wo, u_lobe, u),
            Self::Sheen(lobe) => lobe.sample(wo, u),
            Self::RoughDielectric(lobe) => lobe.sample(wo, u_lobe, u, mode),
            // Of two single directions, the first by its share
            Self::Mirror(_) | Self::Dielectric(_) | Self::ThinSheet(_) => {
                let [first, second] = self.directions(wo, mode);
                first.filter(|s| u.x < s.pdf).or(second)
            }
        }
    }

    /// The single directions of a delta lobe, each with its share of the flux as density; none for others.
    pub fn directions(&self, wo: Vec3, mode: TransportMode) -> [Option<BsdfSample>; 2] {
        match self {
            Self::Mirror(lobe) => lobe.directions(wo),
            Self::Dielectric(lobe) => lobe.directions(wo, mode),
            Self::ThinSheet(lobe) => lobe.directions(wo),
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
            Self::RoughMirror(lobe) => lobe.albedo(),
            Self::Sheen(lobe) => lobe.albedo(),
            Self::RoughDielectric(lobe) => lobe.albedo(),
            Self::Mirror(lobe) => lobe.reflectance * lobe.fresnel.tint(),
            Self::Dielectric(lobe) => lobe.transmittance,
            Self::ThinSheet(lobe) => lobe.transmittance,
        }
    }

    /// Estimate of the share that is scattered for `wo`, by channel.
    pub(super) fn albedo_towards(&self, wo: Vec3) -> Spectrum {
        match self {
            Self::CoatedLambert(lobe) => lobe.albedo_towards(wo),
            Self::RoughMirror(lobe) => lobe.albedo_towards(wo),
            Self::Sheen(lobe) => lobe.albedo_towards(wo),
            Self::Blinn(lobe) => lobe.reflectance * lobe.fresnel.reflectance(wo.z.abs()),
            Self::Mirror(lobe) => lobe.reflectance * lobe.fresnel.reflectance(wo.z.abs()),
            _ => self.albedo(),
        }
    }
}
