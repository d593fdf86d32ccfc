//! Indices of refraction and reflectances of dielectrics along their normal.

use crate::bsdf::Fresnel;

/// Maximum reflectance along the normal, which keeps the index of refraction finite.
pub(super) const MAX_F0: f32 = 0.9;

/// Reflectance of a dielectric along the normal, from its index of refraction.
pub(super) fn f0_of_ior(ior: f32) -> f32 {
    ((ior - 1.0) / (ior + 1.0)).powi(2)
}

/// Index of refraction for the metallic-roughness model, which reflects by Schlick's formula. With
/// this index, the model reflects as much light as a dielectric whose reflectance along the normal
/// is `f0`.
///
/// At middle angles, Fresnel's equations reflect more light than the formula. The difference is a
/// tenth of the total for index 1.5. The `f0` of the formula is therefore raised until both have
/// the same mean over the hemisphere. It is raised less for rough facets, which hide each other at
/// grazing angles. The factor 1.15 − 0.85 roughness² is fitted to spheres that Cycles rendered
/// (Blender 5.0.1, indices 1.5 to 2.2, within 2 % of the reflection).
pub(super) fn ior_of_dielectric(f0: f32, roughness: f32) -> f32 {
    let eta = ior_of_f0(f0);
    if f0 == 0.0 {
        return eta;
    }
    // Midpoint rule for 2 ∫ F cos d cos, where F is Fresnel's reflectance. For Schlick's formula,
    // the integral is (20 f0 + 1)/21.
    const POINTS: u32 = 64;
    let fresnel = Fresnel::Dielectric { eta };
    let cosines = (0..POINTS).map(|i| (i as f32 + 0.5) / POINTS as f32);
    let sum: f32 = cosines
        .map(|cos| 2.0 * cos * fresnel.reflectance(cos).max_component())
        .sum();
    let missing = (sum / POINTS as f32 * 21.0 - 1.0) / 20.0 - f0;
    let raised = missing.max(0.0) * (1.15 - 0.85 * roughness * roughness);
    ior_of_f0((f0 + raised).min(MAX_F0))
}

/// Index of refraction of a dielectric, from its reflectance `f0` along the normal.
fn ior_of_f0(f0: f32) -> f32 {
    (1.0 + f0.sqrt()) / (1.0 - f0.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn index_and_reflectance_are_inverse() {
        for ior in [1.0, 1.33, 1.45, 1.5, 2.4] {
            assert!((ior_of_f0(f0_of_ior(ior)) - ior).abs() < 1e-4, "{ior}");
        }
        assert!(ior_of_f0(MAX_F0).is_finite() && ior_of_dielectric(MAX_F0, 0.5).is_finite());
    }

    #[test]
    fn mean_reflectance_equals_fresnel_equations() {
        assert_eq!(ior_of_dielectric(0.0, 0.5), 1.0);
        let f0 = |roughness| f0_of_ior(ior_of_dielectric(0.04, roughness));
        // Values fitted to Cycles' spheres of index 1.5
        for (roughness, expected) in [(0.0, 0.0471), (0.5, 0.0466), (0.7, 0.0447), (1.0, 0.0421)] {
            assert!(
                (f0(roughness) - expected).abs() < 1e-3,
                "{roughness}: {}",
                f0(roughness)
            );
        }
    }
}
