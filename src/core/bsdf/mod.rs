//! Scattering at a surface, in its local frame.
//!
//! Conventions: `wo` points to the viewer and `wi` to the light; both are unit vectors away from
//! the surface. +z is the shading normal. `f` excludes the cosine. Densities are per solid angle. A
//! delta lobe scatters into single directions. For a delta lobe, `pdf` is the probability of
//! choosing the direction, and `f` is scaled so that `f |cos θi| / pdf` is the weight of the
//! direction. The value of a refracting lobe is not the same for radiance and importance. `eval`
//! returns the value for radiance. With exchanged directions it returns the value for importance.
//! All lobes except delta lobes are called smooth.
//!
//! A [`Bsdf`] is a closed enum: a single lobe, a [`Mix`] of up to three, or a [`Layered`] BSDF of
//! up to five. The single matte lobe is the common case. Code for all other BSDFs is not inlined,
//! so that it takes no registers from the common case. Vertices hold a reference to a BSDF and do
//! not copy its 336 bytes. A [`Lobe`] stays at 64 bytes.
//!
//! A [`BsdfView`] is a BSDF of several lobes for one `wo`. Terms that depend on `wo` only are
//! computed once for all `wi` of a vertex. Value and density are computed together, because they
//! share the half vector and the energy tables.
//!
//! - A mixture chooses a lobe in proportion to its normalised albedo. Absorbed light lowers the
//!   throughput, by which Russian roulette terminates paths. Without the normalisation, the sum of
//!   the probabilities would be the albedo, and the path would end otherwise. The mean would be the
//!   same, but paths would already end at the first vertex.
//! - A rough lobe chooses between single and multiple scattering, and between reflection and
//!   refraction. The choice needs an additional random number, `u_lobe`, which a mixture rescales
//!   and passes on. Materials therefore put rough lobes into a `Mix` or a `Layered` BSDF, even if
//!   there is only one lobe.
//! - Delta lobes have a function `directions`. It returns the one or two directions of the lobe,
//!   each with the fraction of the flux that goes into this direction. Sampling chooses one
//!   direction; `whitted` follows all directions.

mod blinn;
mod coated_lambert;
mod dielectric;
mod energy;
mod event;
mod exponent_energy;
mod fresnel;
mod ggx;
mod lambert;
mod lanes;
mod layered;
mod lobe;
mod mirror;
mod mix;
mod names;
mod phong;
mod rough_conductor;
mod rough_dielectric;
mod sheen;
mod thin_dielectric;
mod view;

pub use blinn::Blinn;
pub use coated_lambert::CoatedLambert;
pub use dielectric::Dielectric;
pub use event::{EventKind, ScatteringEvent};
pub use fresnel::Fresnel;
pub use ggx::MIN_ALPHA;
pub use lambert::Lambert;
pub use lanes::{BsdfLanes, ValueLanes};
pub use layered::Layered;
pub use lobe::Lobe;
pub use mirror::Mirror;
pub use mix::Mix;
pub use phong::Phong;
pub use rough_conductor::RoughConductor;
pub use rough_dielectric::RoughDielectric;
pub use sheen::Sheen;
pub use thin_dielectric::ThinDielectric;
pub use view::{BsdfDirection, BsdfView};

use crate::color::Spectrum;
use crate::math::{Vec2, Vec3};

/// Transported quantity of a path. Refraction changes radiance, but not importance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransportMode {
    /// The path starts at the camera.
    Radiance,
    /// The path starts at a light.
    Importance,
}

/// Width of a lobe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scattering {
    /// Scatters into all directions alike.
    Diffuse,
    /// Scatters mostly into some directions.
    Glossy,
    /// Scatters into single directions: a delta distribution.
    Specular,
}

/// A direction sampled from a BSDF.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Value of the BSDF for the pair of directions, cosine excluded, sr⁻¹.
    pub f: Spectrum,
    /// Sampled direction, local frame.
    pub wi: Vec3,
    /// Density of `wi` per solid angle. For a delta lobe, the probability of choosing `wi`.
    pub pdf: f32,
    /// Factor of the throughput, `f |cos θi| / pdf`. The factor is a field, because some lobes
    /// compute it before the direction.
    pub weight: Spectrum,
    /// Width of the lobe that was sampled.
    pub scattering: Scattering,
    /// Index of refraction beyond the surface, relative to the side of `wo`, if the sample was
    /// refracted; else 1.
    pub eta: f32,
}

impl BsdfSample {
    /// Sample that is not refracted: `eta` is 1.
    pub fn new(f: Spectrum, wi: Vec3, pdf: f32, scattering: Scattering) -> Self {
        Self {
            f,
            wi,
            pdf,
            weight: f * (wi.z.abs() / pdf),
            scattering,
            eta: 1.0,
        }
    }

    /// This sample, marked as refracted with the relative index `eta`.
    pub(super) fn with_eta(self, eta: f32) -> Self {
        Self { eta, ..self }
    }

    /// Returns true if no other strategy can sample this direction, so that MIS does not apply.
    pub fn is_delta(&self) -> bool {
        self.scattering == Scattering::Specular
    }
}

/// The scattering function at one surface point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bsdf {
    /// A single lobe. If the lobe has parts ([`Lobe::has_parts`]), [`Bsdf::sample`] chooses a part
    /// with the number `u_lobe`.
    Single(Lobe),
    /// A sum of lobes.
    Mix(Mix),
    /// Lobes under layers.
    Layered(Layered),
}

impl Bsdf {
    /// Lobes of the BSDF, without the effect of layers above them.
    pub fn lobes(&self) -> impl Iterator<Item = &Lobe> {
        self.places().map(|(_, lobe)| lobe)
    }

    /// Lobes, each with its index among the lobes of a mix or of a layered BSDF.
    #[inline(always)]
    pub(crate) fn places(&self) -> impl Iterator<Item = (usize, &Lobe)> {
        let (single, several): (_, &[Option<Lobe>]) = match self {
            Self::Single(lobe) => (Some((0, lobe)), &[]),
            Self::Mix(mix) => (None, &mix.lobes),
            Self::Layered(layered) => (None, &layered.lobes),
        };
        let several = several.iter().enumerate();
        let several = several.filter_map(|(place, lobe)| lobe.as_ref().map(|lobe| (place, lobe)));
        single.into_iter().chain(several)
    }

    /// Probability of choosing each of [`Bsdf::lobes`] in [`Bsdf::sample`].
    pub fn lobe_probabilities(&self, wo: Vec3) -> Vec<f32> {
        match self {
            Self::Single(_) => vec![1.0],
            _ => BsdfView::new(self, wo).probabilities().collect(),
        }
    }

    /// Returns true if all lobes are delta lobes. Only BSDF sampling can then find light.
    #[inline(always)]
    pub fn is_delta(&self) -> bool {
        match self {
            Self::Single(lobe) => lobe.is_delta(),
            _ => self.is_delta_throughout(),
        }
    }

    /// Returns true if a lobe is a delta lobe.
    #[inline(always)]
    pub fn has_delta(&self) -> bool {
        match self {
            Self::Single(lobe) => lobe.is_delta(),
            _ => self.has_delta_lobe(),
        }
    }

    #[inline(never)]
    fn has_delta_lobe(&self) -> bool {
        self.lobes().any(Lobe::is_delta)
    }

    #[inline(never)]
    fn is_delta_throughout(&self) -> bool {
        self.lobes().all(Lobe::is_delta)
    }

    /// Returns true if a lobe is wide ([`Lobe::is_wide`]).
    pub fn is_wide(&self) -> bool {
        self.lobes().any(Lobe::is_wide)
    }

    /// Returns true if a lobe transmits light and is not a delta lobe.
    #[inline(always)]
    pub fn is_transmitting(&self) -> bool {
        self.lobes().any(|lobe| matches!(lobe, Lobe::RoughDielectric(_)))
    }

    /// Returns true if the BSDF is a single Lambert lobe.
    pub fn is_lambert(&self) -> bool {
        matches!(self, Self::Single(Lobe::Lambert(_)))
    }

    /// Index of refraction beyond the surface, relative to the side of `wo`, if a lobe transmits
    /// light and is not a delta lobe.
    pub fn glossy_eta(&self, wo: Vec3) -> Option<f32> {
        self.lobes().find_map(|lobe| match lobe {
            Lobe::RoughDielectric(lobe) => Some(lobe.eta(wo)),
            _ => None,
        })
    }

    /// Value of the BSDF for radiance, cosine excluded, sr⁻¹, without delta lobes. For importance,
    /// exchange the directions.
    #[inline(always)]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        match self {
            Self::Single(Lobe::Lambert(lobe)) => lobe.eval(wo, wi),
            _ => self.eval_any(wo, wi),
        }
    }

    /// Density of `wi` in [`Bsdf::sample`], per solid angle, without delta lobes.
    #[inline(always)]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.eval_pdf(wo, wi).1
    }

    /// [`Bsdf::eval`] and [`Bsdf::pdf`], which share most of their terms.
    #[inline(always)]
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        match self {
            Self::Single(Lobe::Lambert(lobe)) => lobe.eval_pdf(wo, wi),
            _ => self.eval_pdf_any(wo, wi),
        }
    }

    /// Samples `wi` for `wo`: `u_lobe` chooses a lobe, and `u` chooses a direction. `None` if the
    /// sample carries no light.
    #[inline(always)]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        match self {
            Self::Single(Lobe::Lambert(lobe)) => lobe.sample(wo, u),
            _ => self.sample_any(wo, u_lobe, u, mode),
        }
    }

    // Most paths hit matte surfaces. Code for other surfaces is not inlined, so that it takes no
    // registers and no cache from matte surfaces.

    /// [`Bsdf::eval`] of BSDFs that are not matte. Unlike [`Bsdf::eval_pdf`], it does not compute
    /// lobe probabilities.
    #[inline(never)]
    fn eval_any(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        self.lobe_values(wo, wi).fold(Spectrum::ZERO, |sum, (_, f)| sum + f)
    }

    /// Lobes, each with the value that it contributes to [`Bsdf::eval`].
    #[inline(always)]
    pub fn lobe_values(&self, wo: Vec3, wi: Vec3) -> impl Iterator<Item = (&Lobe, Spectrum)> {
        let [o, i] = [wo, wi].map(|w| self.passed(w));
        self.places().map(move |(place, lobe)| {
            let f = lobe.eval(wo, wi);
            let f = match (self, o, i) {
                (Self::Layered(layered), Some(o), Some(i)) => f * layered.transmittance(lobe, o[place], i[place]),
                _ => f,
            };
            (lobe, f)
        })
    }

    #[inline(never)]
    fn eval_pdf_any(&self, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        match self {
            Self::Single(lobe) => lobe.eval_pdf(wo, wi),
            _ => BsdfView::new(self, wo).eval_pdf(wi),
        }
    }

    #[inline(never)]
    fn sample_any(&self, wo: Vec3, u_lobe: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        match self {
            Self::Single(lobe) => lobe.sample(wo, u_lobe, u, mode),
            _ => BsdfView::new(self, wo).sample(u_lobe, u, mode),
        }
    }

    /// Probability that [`Bsdf::sample`] chooses a smooth lobe, which is any lobe except a delta
    /// lobe. A smooth lobe is chosen if `u_lobe` is below this value.
    pub fn smooth_probability(&self, wo: Vec3) -> f32 {
        match self {
            Self::Single(lobe) => f32::from(u8::from(!lobe.is_delta())),
            _ => BsdfView::new(self, wo).smooth_probability(),
        }
    }

    /// Samples of all directions of the delta lobes. The density of a sample is the fraction of the
    /// lobe's flux in this direction.
    pub fn delta_directions(&self, wo: Vec3, mode: TransportMode) -> impl Iterator<Item = BsdfSample> {
        self.places().flat_map(move |(place, lobe)| {
            let samples = lobe.directions(wo, mode).into_iter().flatten();
            samples.map(move |sample| self.below_layers(place, lobe, wo, sample))
        })
    }

    /// Transmittance towards `w` of the layers above each lobe, if there are layers.
    #[inline(always)]
    fn passed(&self, w: Vec3) -> Option<[f32; 5]> {
        match self {
            Self::Single(_) | Self::Mix(_) => None,
            Self::Layered(layered) => Some(layered.passed(w)),
        }
    }

    /// `sample` of the lobe with the index `place`, times the transmittance of the layers above it.
    pub(crate) fn below_layers(&self, place: usize, lobe: &Lobe, wo: Vec3, sample: BsdfSample) -> BsdfSample {
        match self {
            Self::Single(_) | Self::Mix(_) => sample,
            Self::Layered(layered) => layered.below(place, lobe, wo, sample),
        }
    }

    /// Directional albedo: fraction of uniform light that the surface scatters to `wo`, by channel.
    /// It is the radiance of the surface in a white furnace, and the albedo of auxiliary channels.
    /// Transmitted light counts by its flux, so clear glass has albedo 1.
    ///
    /// The error is below 0.012, and below 0.025 under rough layers. For anisotropic facets the
    /// error is up to 0.08. These facets lose light, and the returned albedo includes the lost
    /// light.
    #[inline(always)]
    pub fn directional_albedo(&self, wo: Vec3) -> Spectrum {
        match self {
            Self::Single(Lobe::Lambert(lobe)) => lobe.albedo,
            _ => self.directional_albedo_any(wo),
        }
    }

    #[inline(never)]
    fn directional_albedo_any(&self, wo: Vec3) -> Spectrum {
        match self {
            Self::Single(lobe) => lobe.directional_albedo_alone(wo),
            _ => BsdfView::new(self, wo).directional_albedo(),
        }
    }

    /// Estimate of the albedo without a view direction: the sum of [`Lobe::albedo`] over all lobes.
    /// Lobes below layers are multiplied by the transmittance of the layers along the normal.
    pub fn albedo(&self) -> Spectrum {
        match self {
            Self::Single(_) | Self::Mix(_) => self.lobes().fold(Spectrum::ZERO, |sum, lobe| sum + lobe.albedo()),
            Self::Layered(layered) => layered.albedo(),
        }
    }
}

/// Returns true if both directions lie on the same side of the surface.
fn same_hemisphere(wo: Vec3, wi: Vec3) -> bool {
    wo.z * wi.z > 0.0
}

/// `wi` of the upper hemisphere, moved to the side of `wo`.
fn on_side_of(wo: Vec3, wi: Vec3) -> Vec3 {
    Vec3::new(wi.x, wi.y, wi.z.copysign(wo.z))
}

/// Facet normal that reflects `wi` to `wo`, and its cosine with both directions; `None` if there is
/// no such facet.
fn half_vector(wo: Vec3, wi: Vec3) -> Option<(Vec3, f32)> {
    if !same_hemisphere(wo, wi) {
        return None;
    }
    let wh = (wo + wi).try_normalize()?;
    let cos_oh = wo.dot(wh);
    (cos_oh > 0.0).then_some((wh, cos_oh))
}

/// `wo` mirrored on the normal.
fn mirror_direction(wo: Vec3) -> Vec3 {
    Vec3::new(-wo.x, -wo.y, wo.z)
}
