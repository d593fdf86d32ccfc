//! Glass with an index of refraction that depends on the wavelength.
//!
//! The index is Cauchy's `A + B / λ²`. A and B follow from the material's index at 587.56 nm (d)
//! and from the Abbe number `(n_d − 1) / (n_F − n_C)`, with F at 486.13 nm and C at 656.27 nm.

use super::Material;
use crate::bsdf::{Bsdf, Dielectric, Lobe};

/// Wavelengths of the Fraunhofer lines F, d and C in nanometres.
const F: f32 = 486.13;
const D: f32 = 587.56;
const C: f32 = 656.27;

impl Material {
    /// Returns true if the index of refraction depends on the wavelength. The material must have an
    /// Abbe number and be uniform smooth glass without other lobes.
    pub fn is_dispersive(&self) -> bool {
        self.abbe.is_some() && !self.maps.varies_bsdf() && matches!(self.bsdf(), Bsdf::Single(Lobe::Dielectric(_)))
    }

    /// Index of refraction at a vacuum wavelength in nanometres.
    pub fn ior_at(&self, nanometers: f32) -> f32 {
        let Some(abbe) = self.abbe else {
            return self.ior;
        };
        let inverse_square = |nanometers: f32| 1.0 / (nanometers * nanometers);
        let b = (self.ior - 1.0) / (abbe * (inverse_square(F) - inverse_square(C)));
        self.ior + b * (inverse_square(nanometers) - inverse_square(D))
    }

    /// The material's `bsdf` at a vacuum wavelength in nanometres; `None` if the BSDF does not
    /// depend on the wavelength.
    pub fn dispersed(&self, bsdf: &Bsdf, nanometers: f32) -> Option<Bsdf> {
        match bsdf {
            Bsdf::Single(Lobe::Dielectric(glass)) if self.abbe.is_some() && !self.maps.varies_bsdf() => {
                let ior = self.ior_at(nanometers);
                Some(Bsdf::Single(Lobe::Dielectric(Dielectric { ior, ..*glass })))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Spectrum;

    /// Indices of Schott's N-BK7 and N-SF11, from their data sheets.
    #[test]
    fn indices_equal_data_sheets() {
        for (ior, abbe, lines) in [
            (
                1.51680,
                64.17,
                [(F, 1.52238), (C, 1.51432), (435.83, 1.52668), (706.52, 1.51289)],
            ),
            (
                1.78472,
                25.68,
                [(F, 1.80651), (C, 1.77596), (435.83, 1.82518), (706.52, 1.77147)],
            ),
        ] {
            let glass = Material {
                transmission: Spectrum::ONE,
                ior,
                abbe: Some(abbe),
                ..Material::default()
            };
            assert!(glass.is_dispersive());
            assert!((glass.ior_at(D) - ior).abs() < 1e-6);
            assert!((glass.ior_at(F) - glass.ior_at(C) - (ior - 1.0) / abbe).abs() < 1e-6);
            for (nanometers, expected) in lines {
                // Cauchy's formula with two terms has an error below 0.005 at the violet end of
                // dense flint, and far less elsewhere.
                let index = glass.ior_at(nanometers);
                assert!(
                    (index - expected).abs() < 0.005,
                    "{abbe} at {nanometers}: {index}, not {expected}"
                );
            }
        }
    }

    #[test]
    fn only_uniform_smooth_glass_is_dispersive() {
        let glass = Material {
            transmission: Spectrum::ONE,
            abbe: Some(30.0),
            ..Material::default()
        };
        let changes: [fn(&mut Material); 5] = [
            |m| m.abbe = None,
            |m| m.thin = true,
            |m| m.roughness = 0.5,
            |m| m.diffuse = Spectrum::splat(0.2),
            |m| m.clearcoat = 1.0,
        ];
        for (i, change) in changes.iter().enumerate() {
            let mut other = glass.clone();
            change(&mut other);
            assert!(
                !other.is_dispersive() && other.dispersed(&other.bsdf(), 500.0).is_none(),
                "change {i}"
            );
        }
    }
}
