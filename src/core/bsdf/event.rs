//! Kinds of scattering events, which light path expressions (`light_paths`) distinguish.
//!
//! Smooth lobes (all lobes except delta lobes) overlap, so a direction does not belong to a single
//! lobe. The light of an event is therefore split among the lobes, in proportion to their values.

use super::{Bsdf, Lobe, Scattering, same_hemisphere};
use crate::color::Spectrum;
use crate::math::Vec3;

/// Kinds of scattering: reflection or transmission, by a diffuse, a glossy or a delta lobe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// Reflection by a diffuse lobe.
    DiffuseReflection,
    /// Reflection by a glossy lobe.
    GlossyReflection,
    /// Reflection by a mirror or smooth glass.
    SpecularReflection,
    /// Transmission by a diffuse lobe.
    DiffuseTransmission,
    /// Transmission by rough glass.
    GlossyTransmission,
    /// Transmission by smooth glass.
    SpecularTransmission,
}

/// Light that a surface scatters from one direction into another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScatteringEvent {
    /// Scattering by a delta lobe.
    Specular {
        /// True if the surface transmits the light.
        is_transmitted: bool,
    },
    /// Scattering by smooth lobes.
    Smooth {
        /// True if the surface transmits the light.
        is_transmitted: bool,
        /// Fraction of the light that diffuse lobes scatter, by channel, 0 to 1. Glossy lobes
        /// scatter the rest.
        diffuse: Spectrum,
    },
}

impl ScatteringEvent {
    /// Kinds of scattering in the event, each with its fraction of the light by channel. The
    /// fractions sum to 1.
    pub fn shares(self) -> [(EventKind, Spectrum); 2] {
        use EventKind::*;
        match self {
            Self::Specular { is_transmitted: false } => {
                [(SpecularReflection, Spectrum::ONE), (GlossyReflection, Spectrum::ZERO)]
            }
            Self::Specular { is_transmitted: true } => [
                (SpecularTransmission, Spectrum::ONE),
                (GlossyTransmission, Spectrum::ZERO),
            ],
            Self::Smooth {
                is_transmitted,
                diffuse,
            } => {
                let [first, second] = if is_transmitted {
                    [DiffuseTransmission, GlossyTransmission]
                } else {
                    [DiffuseReflection, GlossyReflection]
                };
                [(first, diffuse), (second, Spectrum::ONE - diffuse)]
            }
        }
    }
}

impl Bsdf {
    /// Scattering event of light from `wi` to `wo`: by a delta lobe if `is_delta` is true, else by
    /// the smooth lobes.
    pub fn event(&self, wo: Vec3, wi: Vec3, is_delta: bool) -> ScatteringEvent {
        let is_transmitted = !same_hemisphere(wo, wi);
        if is_delta {
            ScatteringEvent::Specular { is_transmitted }
        } else {
            ScatteringEvent::Smooth {
                is_transmitted,
                diffuse: self.diffuse_share(wo, wi),
            }
        }
    }

    /// Fraction of [`Bsdf::eval`] that diffuse lobes contribute, by channel.
    fn diffuse_share(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        let is_diffuse = |lobe: &Lobe| lobe.scattering() == Scattering::Diffuse;
        let mut smooth = self.lobes().filter(|lobe| !lobe.is_delta()).map(is_diffuse);
        // Most BSDFs have only diffuse or only glossy smooth lobes. The values of the lobes are
        // then not needed.
        let Some(first) = smooth.next() else {
            return Spectrum::ZERO;
        };
        if smooth.all(|other| other == first) {
            return if first { Spectrum::ONE } else { Spectrum::ZERO };
        }
        let (mut diffuse, mut all) = (Spectrum::ZERO, Spectrum::ZERO);
        for (lobe, f) in self.lobe_values(wo, wi) {
            all += f;
            if is_diffuse(lobe) {
                diffuse += f;
            }
        }
        let (diffuse, all) = (diffuse.to_array(), all.to_array());
        Spectrum::from([0, 1, 2].map(|c| {
            if all[c] > 0.0 {
                (diffuse[c] / all[c]).min(1.0)
            } else {
                0.0
            }
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::{Fresnel, Lambert, Mirror, Mix, Phong};

    #[test]
    fn events_are_split_by_the_shares_of_the_value() {
        let lambert = Lobe::Lambert(Lambert {
            albedo: Spectrum::rgb(0.5, 0.2, 0.0),
        });
        let phong = Lobe::Phong(Phong {
            reflectance: Spectrum::splat(0.3),
            exponent: 20.0,
        });
        let mirror = Lobe::Mirror(Mirror {
            reflectance: Spectrum::splat(0.2),
            fresnel: Fresnel::Full,
        });
        let bsdf = Bsdf::Mix(Mix::new([Some(lambert), Some(phong), Some(mirror)]));
        let (wo, wi) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.48, 0.36, 0.8));
        let ScatteringEvent::Smooth {
            is_transmitted: false,
            diffuse,
        } = bsdf.event(wo, wi, false)
        else {
            panic!("smooth lobes reflect");
        };
        let (part, all) = (lambert.eval(wo, wi).to_array(), bsdf.eval(wo, wi).to_array());
        for c in 0..3 {
            assert!((diffuse.to_array()[c] - part[c] / all[c]).abs() < 1e-6);
        }
        assert!(diffuse.to_array()[0] > 0.05 && diffuse.to_array()[2] == 0.0);
        let sum = bsdf
            .event(wo, wi, false)
            .shares()
            .iter()
            .fold(Spectrum::ZERO, |sum, (_, s)| sum + *s);
        assert_eq!(sum, Spectrum::ONE);
        // A single lobe scatters all the light.
        let alone = |lobe| Bsdf::Single(lobe).event(wo, wi, false).shares()[0];
        assert_eq!(alone(lambert), (EventKind::DiffuseReflection, Spectrum::ONE));
        assert_eq!(alone(phong), (EventKind::DiffuseReflection, Spectrum::ZERO));
        let below = Vec3::new(-0.6, 0.0, -0.8);
        assert_eq!(
            bsdf.event(wo, below, true),
            ScatteringEvent::Specular { is_transmitted: true }
        );
    }
}
