//! Scattering in the plane of incidence: values and densities of a BSDF and its lobes, for polar
//! plots.

use crate::bsdf::{Bsdf, BsdfSample, TransportMode};
use crate::color::Spectrum;
use crate::math::Vec3;

/// Scattering of a BSDF in the plane of the normal and the viewer.
#[derive(Clone, Debug)]
pub struct Profile {
    /// Angle in degrees between the viewer and the normal.
    pub incidence: f32,
    /// Angles in degrees between `wi` and the normal. 0 is the normal. Positive angles are on the
    /// viewer's side, negative angles on the side of the mirror direction. Angles beyond ±90 are on
    /// the other side of the surface.
    pub angles: Vec<f32>,
    /// Scattering of each lobe, attenuated by the layers above it.
    pub lobes: Vec<LobeProfile>,
    /// Scattering of all lobes together.
    pub total: LobeProfile,
}

/// Scattering of one lobe or of all lobes.
#[derive(Clone, Debug, Default)]
pub struct LobeProfile {
    /// Name of the lobe.
    pub name: &'static str,
    /// `f |cos θi|` at each angle, sr⁻¹. 0 for delta lobes.
    pub value: Vec<Spectrum>,
    /// Density per solid angle with which the lobe samples the direction, times the probability of
    /// the lobe.
    pub pdf: Vec<f32>,
    /// Directions of delta lobes.
    pub deltas: Vec<DeltaDirection>,
}

/// A direction from which a delta lobe scatters light to the viewer.
#[derive(Clone, Copy, Debug)]
pub struct DeltaDirection {
    /// Angle in degrees from the normal.
    pub angle: f32,
    /// Fraction of the flux from this direction that is scattered to the viewer.
    pub share: Spectrum,
}

/// Unit direction at `angle` degrees from the normal in the plane of incidence, local frame.
pub fn direction_at(angle: f32) -> Vec3 {
    let (sin, cos) = angle.to_radians().sin_cos();
    Vec3::new(sin, 0.0, cos)
}

impl Profile {
    /// Profile of `bsdf` for a viewer at `incidence` degrees from the normal, with
    /// `angles_per_degree` angles per degree.
    pub fn new(bsdf: &Bsdf, incidence: f32, angles_per_degree: u32) -> Self {
        let wo = direction_at(incidence);
        let last = 180 * angles_per_degree as i32;
        let angles: Vec<f32> = (-last..=last).map(|i| i as f32 / angles_per_degree as f32).collect();
        let probabilities = bsdf.lobe_probabilities(wo);
        let profile = |(lobe, probability): (_, &f32)| {
            let lobe: &crate::bsdf::Lobe = lobe;
            LobeProfile {
                name: lobe.name(),
                pdf: angles
                    .iter()
                    .map(|angle| probability * lobe.pdf(wo, direction_at(*angle)))
                    .collect(),
                ..LobeProfile::default()
            }
        };
        let mut lobes: Vec<LobeProfile> = bsdf.lobes().zip(&probabilities).map(profile).collect();
        let mut total = LobeProfile {
            name: "all lobes",
            deltas: bsdf
                .delta_directions(wo, TransportMode::Importance)
                .map(delta)
                .collect(),
            ..LobeProfile::default()
        };
        for angle in &angles {
            let wi = direction_at(*angle);
            for (profile, (_, f)) in lobes.iter_mut().zip(bsdf.lobe_values(wo, wi)) {
                profile.value.push(f * wi.z.abs());
            }
            let (f, pdf) = bsdf.eval_pdf(wo, wi);
            total.value.push(f * wi.z.abs());
            total.pdf.push(pdf);
        }
        Self {
            incidence,
            angles,
            lobes,
            total,
        }
    }
}

/// Converts a `sample` of a delta lobe to its angle in the plane of incidence.
fn delta(sample: BsdfSample) -> DeltaDirection {
    DeltaDirection {
        angle: sample.wi.x.atan2(sample.wi.z).to_degrees(),
        share: sample.weight * sample.pdf,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lint::directional_albedo;
    use crate::material::Material;
    use crate::math::Vec2;
    use crate::sampling::warp::uniform_sphere;

    fn materials() -> Vec<Material> {
        let coated = Material {
            clearcoat: 1.0,
            clearcoat_roughness: 0.4,
            ..Material::metallic_roughness(Spectrum::rgb(0.6, 0.3, 0.2), 0.0, 0.5)
        };
        let phong = Material {
            diffuse: Spectrum::splat(0.4),
            specular: Spectrum::splat(0.3),
            ..Material::default()
        };
        vec![
            Material::default(),
            phong,
            Material::metallic_roughness(Spectrum::rgb(0.9, 0.6, 0.3), 1.0, 0.4),
            coated,
        ]
    }

    /// The values of all lobes add up to the value of the BSDF. The same holds for densities.
    #[test]
    fn lobes_add_up() {
        for material in materials() {
            for incidence in [0.0, 30.0, 60.0, 80.0] {
                let profile = Profile::new(&material.bsdf(), incidence, 1);
                assert_eq!((profile.angles.len(), profile.angles[180]), (361, 0.0));
                for i in 0..profile.angles.len() {
                    let value = profile
                        .lobes
                        .iter()
                        .fold(Spectrum::ZERO, |sum, lobe| sum + lobe.value[i]);
                    let pdf: f32 = profile.lobes.iter().map(|lobe| lobe.pdf[i]).sum();
                    let expected = (profile.total.value[i].luminance(), profile.total.pdf[i]);
                    assert!((value.luminance() - expected.0).abs() <= 1e-4 * expected.0.max(1e-3));
                    assert!(
                        (pdf - expected.1).abs() <= 1e-4 * expected.1.max(1e-3),
                        "{pdf} {expected:?}"
                    );
                }
            }
        }
    }

    /// Albedos from samples equal the integrals of the values over all directions, and are at most
    /// 1.
    #[test]
    fn albedos_are_integrals_of_values() {
        const SIDE: u32 = 1000;
        for material in materials() {
            let bsdf = material.bsdf();
            for angle in [0.0, 45.0, 75.0] {
                let wo = direction_at(angle);
                let value = |i: u32| {
                    let u = (Vec2::new((i % SIDE) as f32, (i / SIDE) as f32) + 0.5) / SIDE as f32;
                    let wi = uniform_sphere(u);
                    f64::from(bsdf.eval(wo, wi).luminance() * wi.z.abs())
                };
                let sum: f64 = (0..SIDE * SIDE).map(value).sum();
                let expected = sum * 4.0 * std::f64::consts::PI / f64::from(SIDE * SIDE);
                let albedo = directional_albedo(&bsdf, wo);
                let found = f64::from(albedo.luminance());
                assert!((found - expected).abs() < 4e-3, "{found} for {expected} at {angle}°");
                assert!(albedo.max_component() < 1.004, "{found} at {angle}°");
            }
        }
    }

    /// A mirror scatters into the mirror direction, and glass is lossless.
    #[test]
    fn delta_directions_lie_in_the_plane() {
        let glass = Material {
            transmission: Spectrum::ONE,
            diffuse: Spectrum::ZERO,
            ior: 1.5,
            ..Material::default()
        };
        let profile = Profile::new(&glass.bsdf(), 30.0, 1);
        let deltas = &profile.total.deltas;
        let angles: Vec<f32> = deltas.iter().map(|delta| delta.angle).collect();
        // Snell: sin θ = 0.5 / 1.5
        let refracted = -180.0 + (0.5f32 / 1.5).asin().to_degrees();
        assert!(angles.iter().any(|angle| (angle + 30.0).abs() < 1e-3), "{angles:?}");
        assert!(
            angles.iter().any(|angle| (angle - refracted).abs() < 1e-3),
            "{angles:?} {refracted}"
        );
        let sum: f32 = deltas.iter().map(|delta| delta.share.luminance()).sum();
        assert!((sum - 1.0).abs() < 1e-5, "{sum}");
        assert!(profile.total.value.iter().all(|value| value.is_black()));
    }
}
