//! BSDFs as one direction `wo` sees them.
//!
//! A vertex of a path evaluates its BSDF for several `wi`, each time with the same `wo`: for its light samples, for the direction it draws, and for the
//! ends that other pixels share with it. Terms that depend on `wo` alone are computed once: the probability of each lobe, the energy that single
//! scattering loses, the shares that pass layers. Value and density are computed together, because they share the half vector, `D` and the energy tables.

use super::energy::WoTerms;
use super::{Bsdf, BsdfSample, Lobe, TransportMode};
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3, float::ALMOST_ONE};

/// A BSDF as one direction `wo` sees it.
///
/// To sample it, one lobe is chosen with a probability proportional to its albedo. Smooth lobes cover each other, so the value and density of a direction
/// are those of all of them; a delta lobe's directions are its own. Absorbed light lowers the throughput, on which roulette acts.
#[derive(Clone, Copy, Debug)]
pub struct BsdfView<'a> {
    bsdf: &'a Bsdf,
    wo: Vec3,
    /// Views of the lobes, each in its lobe's place.
    lobes: [LobeView; 5],
}

/// A lobe of a BSDF as one direction `wo` sees it.
#[derive(Clone, Copy, Debug, Default)]
struct LobeView {
    terms: WoTerms,
    /// Probability of choosing the lobe.
    p: f32,
    /// Share of the light towards `wo` that passes the layers above the lobe.
    passed: f32,
}

impl<'a> BsdfView<'a> {
    /// `bsdf` as `wo` sees it.
    #[inline(always)]
    pub fn new(bsdf: &'a Bsdf, wo: Vec3) -> Self {
        let passed = bsdf.passed(wo);
        let mut lobes = [LobeView::default(); 5];
        let mut total = 0.0;
        for (place, lobe) in bsdf.places() {
            let terms = lobe.wo_terms(wo);
            let passed = passed.map_or(1.0, |passed| passed[place]);
            let p = lobe.albedo_with(&terms, wo).mean() * passed;
            lobes[place] = LobeView { terms, p, passed };
            total += p;
        }
        for view in &mut lobes {
            view.p = if total > 0.0 { view.p / total } else { 0.0 };
        }
        Self { bsdf, wo, lobes }
    }

    /// The lobes, each with its place.
    #[inline(always)]
    fn lobes(&self) -> impl Iterator<Item = (usize, &'a Lobe, &LobeView)> {
        let places = self.bsdf.places();
        places.map(|(place, lobe)| (place, lobe, &self.lobes[place]))
    }

    /// Probability of choosing each of the lobes.
    pub fn probabilities(&self) -> impl Iterator<Item = f32> {
        self.lobes().map(|(_, _, view)| view.p)
    }

    /// Probability that a smooth lobe is chosen.
    pub fn smooth_probability(&self) -> f32 {
        if !self.bsdf.lobes().any(Lobe::is_delta) {
            return 1.0;
        }
        let smooth = self.lobes().filter(|(_, lobe, _)| !lobe.is_delta());
        smooth.map(|(_, _, view)| view.p).sum()
    }

    /// Value of the BSDF and density of `wi`, as [`Bsdf::eval`] and [`Bsdf::pdf`]: sums over the lobes, the density of each with its probability.
    #[inline(never)]
    pub fn eval_pdf(&self, wi: Vec3) -> (Spectrum, f32) {
        let passed = self.bsdf.passed(wi);
        let (mut f, mut pdf) = (Spectrum::ZERO, 0.0);
        for (place, lobe, view) in self.lobes() {
            let (lobe_f, lobe_pdf) = lobe.eval_pdf_with(&view.terms, self.wo, wi);
            f += match (self.bsdf, &passed) {
                (Bsdf::Layered(layered), Some(i)) => lobe_f * layered.through(lobe, view.passed, i[place]),
                _ => lobe_f,
            };
            pdf += view.p * lobe_pdf;
        }
        (f, pdf)
    }

    /// Draws `wi`, as [`Bsdf::sample`].
    #[inline(never)]
    pub fn sample(&self, u_lobe: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        let wo = self.wo;
        let ((place, lobe, view), u_part) = self.choose(u_lobe)?;
        if lobe.is_delta() {
            let sample = self
                .bsdf
                .below_layers(place, lobe, wo, lobe.sample(wo, u_part, u, mode)?);
            let pdf = sample.pdf * view.p;
            let of_all = BsdfSample::new(sample.f, sample.wi, pdf, sample.scattering);
            return (pdf > 0.0).then_some(of_all.with_eta(sample.eta));
        }
        let wi = lobe.sample_direction(&view.terms, wo, u_part, u)?;
        let (f, pdf) = self.eval_pdf(wi);
        let f = match mode {
            TransportMode::Radiance => f,
            TransportMode::Importance => self.bsdf.eval(wi, wo),
        };
        lobe.smooth_sample(f, wo, wi, pdf)
    }

    /// The lobe whose share of [0, 1) contains `u`, and the position of `u` in that share, a uniform number for the lobe's own choices. Smooth lobes come
    /// first.
    #[inline(always)]
    fn choose(&self, u: f32) -> Option<((usize, &'a Lobe, &LobeView), f32)> {
        let of_kind = |is_delta| self.lobes().filter(move |(_, lobe, _)| lobe.is_delta() == is_delta);
        let mut below = 0.0;
        let mut last = None;
        for chosen in of_kind(false).chain(of_kind(true)) {
            let p = chosen.2.p;
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
