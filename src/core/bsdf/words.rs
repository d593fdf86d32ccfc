//! Text of lobes and Fresnel terms for `explain` and `info`.

use super::{Bsdf, Fresnel, Lobe, TransportMode};
use crate::color::Spectrum;
use crate::math::{Vec3, rounded, rounded_list};
use std::fmt;

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
        match self {
            Self::Lambert(lobe) => format!("albedo {}", rounded_list(&lobe.albedo.to_array())),
            Self::CoatedLambert(lobe) => {
                let (albedo, f0, roughness) = lobe.parameters();
                let (f0, roughness) = (rounded(f0.into()), rounded(roughness.into()));
                format!(
                    "albedo {}, f0 {f0}, roughness {roughness}",
                    rounded_list(&albedo.to_array())
                )
            }
            Self::Phong(lobe) => {
                let reflectance = rounded_list(&lobe.reflectance.to_array());
                format!("reflectance {reflectance}, exponent {}", rounded(lobe.exponent.into()))
            }
            Self::Blinn(lobe) => {
                let reflectance = rounded_list(&lobe.reflectance.to_array());
                format!(
                    "reflectance {reflectance}, exponent {}, {}",
                    rounded(lobe.exponent.into()),
                    lobe.fresnel
                )
            }
            Self::RoughConductor(lobe) => {
                let (reflectance, fresnel) = lobe.parameters();
                format!(
                    "reflectance {}, roughness {}, {fresnel}",
                    rounded_list(&reflectance),
                    rounded(lobe.roughness().into())
                )
            }
            Self::RoughDielectric(lobe) => {
                let (reflectance, transmittance, ior) = lobe.parameters();
                let factors = boundary(reflectance, transmittance, ior);
                format!("{factors}, roughness {}", rounded(lobe.roughness().into()))
            }
            Self::Sheen(lobe) => format!("color {}", rounded_list(&lobe.color.to_array())),
            Self::Mirror(lobe) => format!(
                "reflectance {}, {}",
                rounded_list(&lobe.reflectance.to_array()),
                lobe.fresnel
            ),
            Self::Dielectric(lobe) => boundary(lobe.reflectance.to_array(), lobe.transmittance.to_array(), lobe.ior),
            Self::ThinDielectric(lobe) => {
                boundary(lobe.reflectance.to_array(), lobe.transmittance.to_array(), lobe.ior)
            }
        }
    }
}

impl Lobe {
    /// Returns true if the lobe has a roughness.
    pub fn has_roughness(&self) -> bool {
        self.values().iter().any(|(name, _)| *name == "roughness")
    }

    /// Parameters of the lobe by name: one number, or three for colours.
    pub fn values(&self) -> Vec<(&'static str, Vec<f32>)> {
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
            Self::Lambert(lobe) => vec![color("albedo", lobe.albedo.to_array())],
            Self::CoatedLambert(lobe) => {
                let (albedo, f0, roughness) = lobe.parameters();
                vec![
                    color("albedo", albedo.to_array()),
                    number("f0", f0),
                    number("roughness", roughness),
                ]
            }
            Self::Phong(lobe) => vec![
                color("reflectance", lobe.reflectance.to_array()),
                number("exponent", lobe.exponent),
            ],
            Self::Blinn(lobe) => {
                let values = vec![
                    color("reflectance", lobe.reflectance.to_array()),
                    number("exponent", lobe.exponent),
                ];
                [values, lobe.fresnel.values()].concat()
            }
            Self::RoughConductor(lobe) => {
                let (reflectance, fresnel) = lobe.parameters();
                let values = vec![color("reflectance", reflectance), number("roughness", lobe.roughness())];
                [values, fresnel.values()].concat()
            }
            Self::RoughDielectric(lobe) => {
                let (reflectance, transmittance, ior) = lobe.parameters();
                let values = boundary(reflectance, transmittance, ior);
                [values, vec![number("roughness", lobe.roughness())]].concat()
            }
            Self::Sheen(lobe) => vec![color("color", lobe.color.to_array())],
            Self::Mirror(lobe) => [
                vec![color("reflectance", lobe.reflectance.to_array())],
                lobe.fresnel.values(),
            ]
            .concat(),
            Self::Dielectric(lobe) => boundary(lobe.reflectance.to_array(), lobe.transmittance.to_array(), lobe.ior),
            Self::ThinDielectric(lobe) => {
                boundary(lobe.reflectance.to_array(), lobe.transmittance.to_array(), lobe.ior)
            }
        }
    }
}

impl Fresnel {
    /// Parameters of the Fresnel term by name.
    fn values(&self) -> Vec<(&'static str, Vec<f32>)> {
        match self {
            Self::Full => Vec::new(),
            Self::Dielectric { eta } => vec![("eta", vec![*eta])],
            Self::Conductor { eta, k } => vec![("eta", eta.to_vec()), ("k", k.to_vec())],
            Self::Schlick { f0 } => vec![("f0", f0.to_vec())],
        }
    }
}

fn boundary(reflectance: [f32; 3], transmittance: [f32; 3], ior: f32) -> String {
    let (reflectance, transmittance) = (rounded_list(&reflectance), rounded_list(&transmittance));
    let ior = rounded(ior.into());
    format!("reflectance {reflectance}, transmittance {transmittance}, ior {ior}")
}
