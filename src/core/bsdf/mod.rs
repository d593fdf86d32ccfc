//! Scattering at a surface, in its local frame.
//!
//! Conventions: `wo` points to the viewer and `wi` to the light, both unit and away from the surface; +z is the shading normal; `f` excludes the
//! cosine; densities are per solid angle. A delta lobe scatters into single directions: there `f` is what makes `f |cos θi| / pdf` the weight of the
//! direction, with the probability of choosing it as `pdf`. The value of a refracting lobe depends on what is transported: `eval` is that of
//! radiance, and importance exchanges the directions, which is equivalent.
//!
//! A [`Bsdf`] is a closed enum: a single lobe, a [`Mix`] of up to three, or a [`Layered`] BSDF of up to five. All but the single matte lobe is kept
//! out of line, so that it takes no registers from the common case. Vertices hold a reference to a BSDF and do not copy it, so its 336 bytes cost
//! nothing. A [`Lobe`] stays at 64 bytes.
//!
//! A [`BsdfView`] is a BSDF of several lobes for one `wo`. Terms that depend on `wo` alone are computed once for all `wi` of a vertex. Value and density
//! are computed together, because they share the half vector and the energy tables.
//!
//! - A mixture chooses a lobe in proportion to its albedo, normalised; absorption is in the throughput, on which roulette acts. Choosing by the
//!   albedo itself, and ending the path with the remainder, has the same mean but ends paths at the first vertex.
//! - A rough lobe chooses between single and multiple scattering, and between reflection and refraction. That takes a random number of its own,
//!   `u_lobe`, which a mixture has and hands on. Rough lobes are therefore always in a `Mix`, also a single one.
//! - Delta lobes have one function, `directions`, that gives their one or two directions with shares of the flux. Sampling picks one of them, and
//!   `whitted` follows all.

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
mod phong;
mod rough_conductor;
mod rough_dielectric;
mod sheen;
mod thin_dielectric;
mod view;
mod words;

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

/// Transported quantity of a path: refraction changes radiance, but not importance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransportMode {
    /// The path starts at the camera.
    Radiance,
    /// The path starts at a light.
    Importance,
}

/// How sharply a lobe scatters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scattering {
    /// Into all directions alike.
    Diffuse,
    /// Mostly into some.
    Glossy,
    /// Into a single one: a delta distribution.
    Specular,
}

/// A direction drawn from a BSDF.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Value of the BSDF for the pair of directions, cosine excluded, sr⁻¹.
    pub f: Spectrum,
    /// Direction drawn, local frame.
    pub wi: Vec3,
    /// Density of `wi` per solid angle; its probability for a delta lobe.
    pub pdf: f32,
    /// Factor of the throughput, `f |cos θi| / pdf`: a field, because some lobes know it before they know the direction.
    pub weight: Spectrum,
    /// Scattering of the lobe that was sampled.
    pub scattering: Scattering,
    /// Index of refraction beyond the surface over the one on the side of `wo` if the sample was refracted, else 1.
    pub eta: f32,
}

impl BsdfSample {
    /// A sample that stays in its medium.
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

    /// The sample, refracted by the relative index `eta`.
    pub(super) fn with_eta(self, eta: f32) -> Self {
        Self { eta, ..self }
    }

    /// Whether no other strategy can draw this direction, so that MIS has nothing to weigh.
    pub fn is_delta(&self) -> bool {
        self.scattering == Scattering::Specular
    }
}

/// The scattering function at one surface point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bsdf {
    /// One lobe. If it has parts ([`Lobe::has_parts`]), [`Bsdf::sample`] needs its number `u_lobe` for them.
    Single(Lobe),
    /// A sum of lobes.
    Mix(Mix),
    /// One with layers over it.
    Layered(Layered),
}

impl Bsdf {
    /// The lobes it is made of, each as it is without what lies above it.
    pub fn lobes(&self) -> impl Iterator<Item = &Lobe> {
        self.places().map(|(_, lobe)| lobe)
    }

    /// The lobes, each with its place among layers, if there are any.
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

    /// Probability with which [`Bsdf::sample`] chooses each of [`Bsdf::lobes`].
    pub fn lobe_probabilities(&self, wo: Vec3) -> Vec<f32> {
        match self {
            Self::Single(_) => vec![1.0],
            _ => BsdfView::new(self, wo).probabilities().collect(),
        }
    }

    /// Whether all its lobes are delta lobes: then light can be found by following them only.
    #[inline(always)]
    pub fn is_delta(&self) -> bool {
        match self {
            Self::Single(lobe) => lobe.is_delta(),
            _ => self.is_delta_throughout(),
        }
    }

    #[inline(never)]
    fn is_delta_throughout(&self) -> bool {
        self.lobes().all(Lobe::is_delta)
    }

    /// Whether one of its lobes scatters widely ([`Lobe::is_wide`]).
    pub fn is_wide(&self) -> bool {
        self.lobes().any(Lobe::is_wide)
    }

    /// Whether light may pass the surface other than by delta lobes.
    #[inline(always)]
    pub fn is_transmitting(&self) -> bool {
        self.lobes().any(|lobe| matches!(lobe, Lobe::RoughDielectric(_)))
    }

    /// Whether it scatters to all directions of a side alike.
    pub fn is_lambert(&self) -> bool {
        matches!(self, Self::Single(Lobe::Lambert(_)))
    }

    /// Index of refraction beyond the surface over the one on the side of `wo`, where light passes it other than by delta
    /// lobes.
    pub fn glossy_eta(&self, wo: Vec3) -> Option<f32> {
        self.lobes().find_map(|lobe| match lobe {
            Lobe::RoughDielectric(lobe) => Some(lobe.eta(wo)),
            _ => None,
        })
    }

    /// Value of the BSDF for radiance, cosine excluded, sr⁻¹; delta lobes count nothing. For importance the directions
    /// are exchanged.
    #[inline(always)]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        match self {
            Self::Single(Lobe::Lambert(lobe)) => lobe.eval(wo, wi),
            _ => self.eval_any(wo, wi),
        }
    }

    /// Density with which [`Bsdf::sample`] draws `wi`, per solid angle; delta lobes count nothing.
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

    /// Draws `wi` for `wo`: `u_lobe` chooses a lobe, `u` a direction. `None` where nothing is scattered.
    #[inline(always)]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        match self {
            Self::Single(Lobe::Lambert(lobe)) => lobe.sample(wo, u),
            _ => self.sample_any(wo, u_lobe, u, mode),
        }
    }

    // Matte surfaces are what most paths meet. What others need is kept out of line, so that it does not take registers and
    // cache from them.

    /// [`Bsdf::eval`] of BSDFs that are not matte. The value alone needs no lobe probabilities.
    #[inline(never)]
    fn eval_any(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        self.lobe_values(wo, wi).fold(Spectrum::ZERO, |sum, (_, f)| sum + f)
    }

    /// The lobes, each with its share of [`Bsdf::eval`].
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

    /// Probability that [`Bsdf::sample`] chooses a lobe that is no delta lobe: it does for `u_lobe` below this.
    pub fn smooth_probability(&self, wo: Vec3) -> f32 {
        match self {
            Self::Single(lobe) => f32::from(u8::from(!lobe.is_delta())),
            _ => BsdfView::new(self, wo).smooth_probability(),
        }
    }

    /// Every single direction of the delta lobes, each with its share of the lobe's flux as density.
    pub fn delta_directions(&self, wo: Vec3, mode: TransportMode) -> impl Iterator<Item = BsdfSample> {
        self.places().flat_map(move |(place, lobe)| {
            let samples = lobe.directions(wo, mode).into_iter().flatten();
            samples.map(move |sample| self.below_layers(place, lobe, wo, sample))
        })
    }

    /// Share of the light towards `w` that passes the layers above each lobe, if there are any.
    #[inline(always)]
    fn passed(&self, w: Vec3) -> Option<[f32; 5]> {
        match self {
            Self::Single(_) | Self::Mix(_) => None,
            Self::Layered(layered) => Some(layered.passed(w)),
        }
    }

    /// `sample` of the lobe in `place`, less what the layers above it take.
    pub(crate) fn below_layers(&self, place: usize, lobe: &Lobe, wo: Vec3, sample: BsdfSample) -> BsdfSample {
        match self {
            Self::Single(_) | Self::Mix(_) => sample,
            Self::Layered(layered) => layered.below(place, lobe, wo, sample),
        }
    }

    /// Share of uniform light that the surface scatters to `wo`, by channel: the radiance of the
    /// surface in a white furnace, and the albedo of auxiliary channels. Transmitted light counts
    /// by its flux, so clear glass has 1.
    ///
    /// The error is below 0.012, and below 0.025 under rough layers. Anisotropic facets lose up to
    /// 0.08 of the light, which counts here.
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

    /// Bound of the share of the light that is scattered, whatever the viewer's direction: metals
    /// and dielectrics count without their Fresnel term.
    pub fn albedo(&self) -> Spectrum {
        match self {
            Self::Single(_) | Self::Mix(_) => self.lobes().fold(Spectrum::ZERO, |sum, lobe| sum + lobe.albedo()),
            Self::Layered(layered) => layered.albedo(),
        }
    }
}

/// Whether both directions lie on the same side of the surface.
fn same_hemisphere(wo: Vec3, wi: Vec3) -> bool {
    wo.z * wi.z > 0.0
}

/// `wi` of the upper hemisphere, moved to the side of the surface on which `wo` lies.
fn on_side_of(wo: Vec3, wi: Vec3) -> Vec3 {
    Vec3::new(wi.x, wi.y, wi.z.copysign(wo.z))
}

/// The facet normal that reflects `wi` to `wo`, and its cosine with both; `None` where no facet does.
fn half_vector(wo: Vec3, wi: Vec3) -> Option<(Vec3, f32)> {
    if !same_hemisphere(wo, wi) {
        return None;
    }
    let wh = (wo + wi).try_normalize()?;
    let cos_oh = wo.dot(wh);
    (cos_oh > 0.0).then_some((wh, cos_oh))
}

/// `wo` mirrored by the normal.
fn mirror_direction(wo: Vec3) -> Vec3 {
    Vec3::new(-wo.x, -wo.y, wo.z)
}
