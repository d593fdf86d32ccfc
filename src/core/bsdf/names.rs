//! Text of lobes and Fresnel terms for `explain` and `info`.

use super::{Bsdf, Dielectric, Fresnel, Lobe, ThinDielectric, TransportMode};
use crate::color::Spectrum;
use crate::math::{Vec3, rounded, rounded_list};
use std::fmt;

/// Name of a parameter, and its number, or the three numbers of a colour.
type LobeValue = (&'static str, Vec<f32>);

impl fmt::Display for Fresnel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Full => write!(f, "no Fresnel term"),
            Self::Dielectric { eta } => write!(f, "dielectric Fresnel term, eta {}", rounded((*eta).into())),
            Self::Conductor { eta, k } => write!(
                f,
                "conductor Fresnel term, eta {}, k {}",
                rounded_list(eta),
                rounded_list(k)
            ),
            Self::Schlick { f0 } => write!(f, "Schlick Fresnel term, f0 {}", rounded_list(f0)),
        }
    }
}

impl Bsdf {
    /// Name of the lobe that scatters the largest fraction of the light from `wi` to `wo`. Only
    /// delta lobes count if `is_delta` is true, else only smooth lobes.
    pub fn lobe_name(&self, wo: Vec3, wi: Vec3, is_delta: bool) -> &'static str {
        /// Squared distance up to which two directions count as equal, because of rounding.
        const NEAR: f32 = 1e-6;
        let share = |(lobe, f): (&Lobe, Spectrum)| {
            if is_delta {
                let directions = lobe.directions(wo, TransportMode::Radiance).into_iter().flatten();
                let met = directions.filter(|sample| sample.wi.distance_squared(wi) < NEAR);
                met.map(|sample| sample.pdf).fold(0.0, f32::max)
            } else {
                f.luminance()
            }
        };
        let lobes = self.lobe_values(wo, wi).filter(|(lobe, _)| lobe.is_delta() == is_delta);
        let best = lobes
            .map(|(lobe, f)| (lobe, share((lobe, f))))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        best.map_or("", |(lobe, _)| lobe.name())
    }
}

impl Lobe {
    /// Name of the kind of lobe.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Lambert(_) => "Lambert",
            Self::CoatedLambert(_) => "coated Lambert",
            Self::Phong(_) => "Phong",
            Self::Blinn(_) => "Blinn",
            Self::RoughConductor(_) => "rough conductor",
            Self::RoughDielectric(_) => "rough dielectric",
            Self::Sheen(_) => "sheen",
            Self::Mirror(_) => "mirror",
            Self::Dielectric(_) => "dielectric",
            Self::ThinDielectric(_) => "thin dielectric",
        }
    }

    /// Parameters of the lobe as text, with their names.
    pub fn parameters(&self) -> String {
        let text = |(name, value): (&str, Vec<f32>)| match value.as_slice() {
            [number] => format!("{name} {}", rounded((*number).into())),
            color => format!("{name} {}", rounded_list(color)),
        };
        let (values, fresnel) = self.values_and_fresnel();
        let mut texts: Vec<String> = values.into_iter().map(text).collect();
        texts.extend(fresnel.map(|fresnel| fresnel.to_string()));
        texts.join(", ")
    }

    /// Returns true if the lobe has a roughness.
    pub fn has_roughness(&self) -> bool {
        self.values().iter().any(|(name, _)| *name == "roughness")
    }

    /// Parameters of the lobe by name: one number, or three for colours.
    pub fn values(&self) -> Vec<LobeValue> {
        let (mut values, fresnel) = self.values_and_fresnel();
        values.extend(fresnel.iter().flat_map(Fresnel::values));
        values
    }

    /// Parameters of the lobe without those of its Fresnel term, and the Fresnel term. `None` if
    /// the lobe has no choice of a Fresnel term.
    fn values_and_fresnel(&self) -> (Vec<LobeValue>, Option<Fresnel>) {
        let color = |name, value: [f32; 3]| (name, value.to_vec());
        let number = |name, value| (name, vec![value]);
        let boundary = |reflectance, transmittance, ior| {
            vec![
                color("reflectance", reflectance),
                color("transmittance", transmittance),
                number("ior", ior),
            ]
        };
        match self {
            Self::Lambert(lobe) => (vec![color("albedo", lobe.albedo.to_array())], None),
            Self::CoatedLambert(lobe) => {
                let (albedo, f0, roughness) = lobe.parameters();
                let albedo = color("albedo", albedo.to_array());
                (vec![albedo, number("f0", f0), number("roughness", roughness)], None)
            }
            Self::Phong(lobe) => {
                let reflectance = color("reflectance", lobe.reflectance.to_array());
                (vec![reflectance, number("exponent", lobe.exponent)], None)
            }
            Self::Blinn(lobe) => {
                let reflectance = color("reflectance", lobe.reflectance.to_array());
                (vec![reflectance, number("exponent", lobe.exponent)], Some(lobe.fresnel))
            }
            Self::RoughConductor(lobe) => {
                let (reflectance, fresnel) = lobe.parameters();
                let reflectance = color("reflectance", reflectance);
                (vec![reflectance, number("roughness", lobe.roughness())], Some(fresnel))
            }
            Self::RoughDielectric(lobe) => {
                let (reflectance, transmittance, ior) = lobe.parameters();
                let mut values = boundary(reflectance, transmittance, ior);
                values.push(number("roughness", lobe.roughness()));
                (values, None)
            }
            Self::Sheen(lobe) => (vec![color("color", lobe.color.to_array())], None),
            Self::Mirror(lobe) => {
                let reflectance = color("reflectance", lobe.reflectance.to_array());
                (vec![reflectance], Some(lobe.fresnel))
            }
            Self::Dielectric(Dielectric {
                reflectance,
                transmittance,
                ior,
            })
            | Self::ThinDielectric(ThinDielectric {
                reflectance,
                transmittance,
                ior,
            }) => (boundary(reflectance.to_array(), transmittance.to_array(), *ior), None),
        }
    }
}

impl Fresnel {
    /// Parameters of the Fresnel term by name.
    fn values(&self) -> Vec<LobeValue> {
        match self {
            Self::Full => Vec::new(),
            Self::Dielectric { eta } => vec![("eta", vec![*eta])],
            Self::Conductor { eta, k } => vec![("eta", eta.to_vec()), ("k", k.to_vec())],
            Self::Schlick { f0 } => vec![("f0", f0.to_vec())],
        }
    }
}
