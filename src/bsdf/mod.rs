//! Scattering at a surface, in its local frame.
//!
//! Conventions: `wo` points to the viewer and `wi` to the light, both unit and away from the surface; +z is the shading
//! normal; `f` excludes the cosine; densities are per solid angle.

mod lambert;

pub use lambert::Lambert;

use crate::color::Spectrum;
use crate::math::{Vec2, Vec3};

/// A direction drawn from a BSDF.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Value of the BSDF for the pair of directions, cosine excluded, sr⁻¹.
    pub f: Spectrum,
    /// Direction drawn, local frame.
    pub wi: Vec3,
    /// Density of `wi` per solid angle.
    pub pdf: f32,
}

/// The scattering function at one surface point.
#[derive(Clone, Copy, Debug)]
pub enum Bsdf {
    /// Ideal diffuse reflection, on both sides of the surface.
    Lambert(Lambert),
}

impl Bsdf {
    /// Value of the BSDF, cosine excluded, sr⁻¹.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        match self {
            Self::Lambert(lobe) => lobe.eval(wo, wi),
        }
    }

    /// Density with which [`Bsdf::sample`] draws `wi`, per solid angle.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        match self {
            Self::Lambert(lobe) => lobe.pdf(wo, wi),
        }
    }

    /// Draws `wi` for `wo`; `None` where nothing is scattered.
    pub fn sample(&self, wo: Vec3, u: Vec2) -> Option<BsdfSample> {
        match self {
            Self::Lambert(lobe) => lobe.sample(wo, u),
        }
    }

    /// Share of the light that is scattered, for uniform illumination; what denoisers call albedo.
    pub fn albedo(&self) -> Spectrum {
        match self {
            Self::Lambert(lobe) => lobe.albedo,
        }
    }
}

/// Whether both directions lie on the same side of the surface.
fn same_hemisphere(wo: Vec3, wi: Vec3) -> bool {
    wo.z * wi.z > 0.0
}
