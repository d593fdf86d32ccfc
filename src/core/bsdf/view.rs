//! BSDFs for one direction `wo`.
//!
//! A path vertex evaluates its BSDF for several `wi` with the same `wo`: for its light samples, for
//! the sampled direction, and for connections to paths of other pixels (path reuse). A vertex to
//! which several pixels connect evaluates its BSDF for several `wo` with the same `wi`. Terms that
//! depend on one direction only are computed once. These terms are the energy loss of single
//! scattering and the transmittances of layers, and for `wo` also the probability of each lobe.
//! Value and density are computed together, because they share the half vector and `D`.

use super::energy::{DirectionTerms, EnergyLookup};
use super::{Bsdf, BsdfSample, Lobe, TransportMode, same_hemisphere};
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3, float::ALMOST_ONE};

/// Maximum number of lobes in a BSDF.
const PLACES: usize = 5;

/// A BSDF for one direction `wo`.
///
/// Sampling chooses one lobe with a probability proportional to its albedo. Smooth lobes overlap,
/// so the value and density of a direction are sums over all smooth lobes. Each direction of a
/// delta lobe belongs to this lobe only. Absorbed light lowers the throughput, which roulette uses.
#[derive(Clone, Copy, Debug)]
pub struct BsdfView<'a> {
    bsdf: &'a Bsdf,
    wo: BsdfDirection,
    /// Probability of choosing each lobe, by the index of the lobe.
    p: [f32; PLACES],
}

/// A direction, with the terms of a BSDF that depend on this direction only.
#[derive(Clone, Copy, Debug)]
pub struct BsdfDirection {
    /// Unit direction, local frame.
    w: Vec3,
    /// Terms of the lobes, by the index of the lobe.
    lobes: [DirectionTerms; PLACES],
    /// Transmittance of the layers above each lobe, towards this direction.
    passed: [f32; PLACES],
}

impl BsdfDirection {
    /// Direction `w` for the lobes of `bsdf`.
    #[inline(always)]
    pub fn new(bsdf: &Bsdf, w: Vec3) -> Self {
        // Write the terms into the arrays of the result. Moving arrays into the result would copy
        // them, which takes a few percent of the time of a glossy sample.
        let mut direction = Self {
            w,
            lobes: [DirectionTerms::default(); PLACES],
            passed: bsdf.passed(w).unwrap_or([1.0; PLACES]),
        };
        let mut energy = EnergyLookup::new(w);
        for (place, lobe) in bsdf.places() {
            direction.lobes[place] = lobe.terms(&mut energy, w);
        }
        direction
    }
}

impl<'a> BsdfView<'a> {
    /// View of `bsdf` for `wo`.
    #[inline(always)]
    pub fn new(bsdf: &'a Bsdf, wo: Vec3) -> Self {
        let mut view = Self {
            bsdf,
            wo: BsdfDirection::new(bsdf, wo),
            p: [0.0; PLACES],
        };
        let mut total = 0.0;
        for (place, lobe) in bsdf.places() {
            let p = lobe.albedo_with(&view.wo.lobes[place], wo).mean() * view.wo.passed[place];
            view.p[place] = p;
            total += p;
        }
        let scale = if total > 0.0 { 1.0 / total } else { 0.0 };
        view.p = view.p.map(|p| p * scale);
        view
    }

    /// Lobes, each with its index in the BSDF.
    #[inline(always)]
    fn lobes(&self) -> impl Iterator<Item = (usize, &'a Lobe)> {
        self.bsdf.places()
    }

    /// Probability of choosing each lobe.
    pub fn probabilities(&self) -> impl Iterator<Item = f32> {
        self.lobes().map(|(place, _)| self.p[place])
    }

    /// [`Bsdf::directional_albedo`].
    #[inline(never)]
    pub fn directional_albedo(&self) -> Spectrum {
        let wo = self.wo.w;
        self.lobes().fold(Spectrum::ZERO, |sum, (place, lobe)| {
            sum + match self.bsdf {
                // Light from inside leaves at a flatter angle, where the layers transmit less.
                Bsdf::Layered(layered) if wo.z < 0.0 && matches!(lobe, Lobe::Dielectric(_)) => {
                    layered.delta_albedo(place, lobe, wo)
                }
                _ => lobe.directional_albedo(&self.wo.lobes[place], wo) * self.wo.passed[place],
            }
        })
    }

    /// Probability of choosing a smooth lobe.
    pub fn smooth_probability(&self) -> f32 {
        if !self.bsdf.lobes().any(Lobe::is_delta) {
            return 1.0;
        }
        let smooth = self.lobes().filter(|(_, lobe)| !lobe.is_delta());
        smooth.map(|(place, _)| self.p[place]).sum()
    }

    /// Value of the BSDF and density of `wi`, as [`Bsdf::eval`] and [`Bsdf::pdf`].
    #[inline(always)]
    pub fn eval_pdf(&self, wi: Vec3) -> (Spectrum, f32) {
        if !same_hemisphere(self.wo.w, wi) && !self.bsdf.is_transmitting() {
            return (Spectrum::ZERO, 0.0);
        }
        self.eval_pdf_of(wi)
    }

    #[inline(never)]
    fn eval_pdf_of(&self, wi: Vec3) -> (Spectrum, f32) {
        self.eval_pdf_with(&BsdfDirection::new(self.bsdf, wi))
    }

    /// [`BsdfView::eval_pdf`] of a direction with known terms: sums over the lobes, each density
    /// weighted by the probability of its lobe.
    #[inline(always)]
    pub fn eval_pdf_with(&self, wi: &BsdfDirection) -> (Spectrum, f32) {
        let (mut f, mut pdf) = (Spectrum::ZERO, 0.0);
        for (place, lobe) in self.lobes() {
            let terms = [&self.wo.lobes[place], &wi.lobes[place]];
            let (lobe_f, lobe_pdf) = lobe.eval_pdf_with(terms, self.wo.w, wi.w);
            f += match self.bsdf {
                Bsdf::Layered(layered) => lobe_f * layered.transmittance(lobe, self.wo.passed[place], wi.passed[place]),
                _ => lobe_f,
            };
            pdf += self.p[place] * lobe_pdf;
        }
        (f, pdf)
    }

    /// Samples `wi`, as [`Bsdf::sample`].
    #[inline(never)]
    pub fn sample(&self, u_lobe: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        let wo = self.wo.w;
        let ((place, lobe), u_part) = self.choose(u_lobe)?;
        if lobe.is_delta() {
            let sample = self
                .bsdf
                .below_layers(place, lobe, wo, lobe.sample(wo, u_part, u, mode)?);
            let pdf = sample.pdf * self.p[place];
            let of_all = BsdfSample::new(sample.f, sample.wi, pdf, sample.scattering);
            return (pdf > 0.0).then_some(of_all.with_eta(sample.eta));
        }
        let wi = lobe.sample_direction(&self.wo.lobes[place], wo, u_part, u)?;
        let (f, pdf) = self.eval_pdf(wi);
        let f = match mode {
            TransportMode::Radiance => f,
            TransportMode::Importance => self.bsdf.eval(wi, wo),
        };
        lobe.smooth_sample(f, wo, wi, pdf)
    }

    /// Chooses a lobe: each lobe has an interval of [0, 1), and the lobe is returned whose interval
    /// contains `u`. The length of an interval is the probability of the lobe, and smooth lobes
    /// come first. Also returns the position of `u` in the interval, from 0 to 1, as a uniform
    /// number for choices within the lobe.
    #[inline(always)]
    fn choose(&self, u: f32) -> Option<((usize, &'a Lobe), f32)> {
        let of_kind = |is_delta| self.lobes().filter(move |(_, lobe)| lobe.is_delta() == is_delta);
        let mut below = 0.0;
        let mut last = None;
        for chosen in of_kind(false).chain(of_kind(true)) {
            let p = self.p[chosen.0];
            if p > 0.0 {
                last = Some((chosen, ((u - below) / p).min(ALMOST_ONE)));
                below += p;
                if u < below {
                    break;
                }
            }
        }
        last
    }
}
