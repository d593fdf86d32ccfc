//! Lobes and Fresnel terms in the words that `explain` and `info` print.

use super::{Fresnel, Lobe};
use crate::math::list;
use std::fmt;

impl fmt::Display for Fresnel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Full => write!(f, "no Fresnel term"),
            Self::Dielectric { eta } => write!(f, "dielectric Fresnel term, eta {eta}"),
            Self::Conductor { eta, k } => write!(f, "conductor Fresnel term, eta {}, k {}", list(eta), list(k)),
            Self::Schlick { f0 } => write!(f, "Schlick Fresnel term, f0 {}", list(f0)),
        }
    }
}

impl Lobe {
    /// The kind of lobe.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Lambert(_) => "Lambert",
            Self::CoatedLambert(_) => "coated Lambert",
            Self::Phong(_) => "Phong",
            Self::Blinn(_) => "Blinn",
            Self::RoughMirror(_) => "rough conductor",
            Self::RoughDielectric(_) => "rough dielectric",
            Self::Sheen(_) => "sheen",
            Self::Mirror(_) => "mirror",
            Self::Dielectric(_) => "dielectric",
            Self::ThinDielectric(_) => "thin dielectric",
        }
    }

    /// The numbers of the lobe with their names.
    pub fn parameters(&self) -> String {
        match self {
            Self::Lambert(lobe) => format!("albedo {}", list(&lobe.albedo.to_array())),
            Self::CoatedLambert(lobe) => {
                let (albedo, f0, roughness) = lobe.parameters();
                format!("albedo {}, f0 {f0}, roughness {roughness}", list(&albedo.to_array()))
            }
            Self::Phong(lobe) => {
                let reflectance = list(&lobe.reflectance.to_array());
                format!("reflectance {reflectance}, exponent {}", lobe.exponent)
            }
            Self::Blinn(lobe) => {
                let reflectance = list(&lobe.reflectance.to_array());
                format!(
                    "reflectance {reflectance}, exponent {}, {}",
                    lobe.exponent, lobe.fresnel
                )
            }
            Self::RoughMirror(lobe) => {
                let (reflectance, fresnel) = lobe.parameters();
                format!(
                    "reflectance {}, roughness {}, {fresnel}",
                    list(&reflectance),
                    lobe.roughness()
                )
            }
            Self::RoughDielectric(lobe) => {
                let (reflectance, transmittance, ior) = lobe.parameters();
                let factors = boundary(reflectance, transmittance, ior);
                format!("{factors}, roughness {}", lobe.roughness())
            }
            Self::Sheen(lobe) => format!("color {}", list(&lobe.color.to_array())),
            Self::Mirror(lobe) => format!("reflectance {}, {}", list(&lobe.reflectance.to_array()), lobe.fresnel),
            Self::Dielectric(lobe) => boundary(lobe.reflectance.to_array(), lobe.transmittance.to_array(), lobe.ior),
            Self::ThinDielectric(lobe) => {
                boundary(lobe.reflectance.to_array(), lobe.transmittance.to_array(), lobe.ior)
            }
        }
    }
}

fn boundary(reflectance: [f32; 3], transmittance: [f32; 3], ior: f32) -> String {
    let (reflectance, transmittance) = (list(&reflectance), list(&transmittance));
    format!("reflectance {reflectance}, transmittance {transmittance}, ior {ior}")
}
