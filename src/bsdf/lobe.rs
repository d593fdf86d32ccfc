use super::{Blinn, BsdfSample, Dielectric, Lambert, Mirror, Phong, ThinSheet, TransportMode};
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3};

/// One way in which a surface scatters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lobe {
    /// Ideal diffuse reflection.
    Lambert(Lambert),
    /// Glossy reflection about the mirror direction.
    Phong(Phong),
    /// Glossy reflection by microfacets.
    Blinn(Blinn),
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

    /// Value for the pair of directions, cosine excluded, sr⁻¹; 0 for delta lobes.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        match self {
            Self::Lambert(lobe) => lobe.eval(wo, wi),
            Self::Phong(lobe) => lobe.eval(wo, wi),
            Self::Blinn(lobe) => lobe.eval(wo, wi),
            Self::Mirror(_) | Self::Dielectric(_) | Self::ThinSheet(_) => Spectrum::ZERO,
        }
    }

    /// Density with which [`Lobe::sample`] draws `wi`, per solid angle; 0 for delta lobes.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        match self {
            Self::Lambert(lobe) => lobe.pdf(wo, wi),
            Self::Phong(lobe) => lobe.pdf(wo, wi),
            Self::Blinn(lobe) => lobe.pdf(wo, wi),
            Self::Mirror(_) | Self::Dielectric(_) | Self::ThinSheet(_) => 0.0,
        }
    }

    /// Draws `wi` for `wo`; `None` where nothing is scattered.
    pub fn sample(&self, wo: Vec3, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        match self {
            Self::Lambert(lobe) => lobe.sample(wo, u),
            Self::Phong(lobe) => lobe.sample(wo, u),
            Self::Blinn(lobe) => lobe.sample(wo, u),
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
            Self::Lambert(_) | Self::Phong(_) | Self::Blinn(_) => [None, None],
        }
    }

    /// Largest share of the flux that it may scatter, by channel.
    pub fn albedo(&self) -> Spectrum {
        match self {
            Self::Lambert(lobe) => lobe.albedo,
            Self::Phong(lobe) => lobe.reflectance,
            Self::Blinn(lobe) => lobe.reflectance,
            Self::Mirror(lobe) => lobe.reflectance,
            Self::Dielectric(lobe) => lobe.transmittance,
            Self::ThinSheet(lobe) => lobe.transmittance,
        }
    }

    /// Estimate of the share that is scattered for `wo`, by channel.
    pub(super) fn albedo_towards(&self, wo: Vec3) -> Spectrum {
        match self {
            Self::Blinn(lobe) => lobe.reflectance * lobe.fresnel.reflectance(wo.z.abs()),
            Self::Mirror(lobe) => lobe.reflectance * lobe.fresnel.reflectance(wo.z.abs()),
            _ => self.albedo(),
        }
    }
}
