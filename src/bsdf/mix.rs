use super::{BsdfSample, Lobe, TransportMode};
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3, float::ALMOST_ONE};

/// The sum of up to three lobes: diffuse, glossy or mirror-like, and transmitting.
///
/// To sample it, one lobe is chosen with a probability proportional to its albedo. Smooth lobes cover each other, so the
/// value and density of a direction are those of all of them; a delta lobe's directions are its own. What no lobe scatters
/// is absorbed: the throughput carries it, and roulette acts on that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mix {
    /// Smooth ones first.
    lobes: [Option<Lobe>; 3],
}

impl Mix {
    /// Of a diffuse, a glossy or mirror-like and a transmitting lobe, in this order.
    pub fn new(mut lobes: [Option<Lobe>; 3]) -> Self {
        lobes.sort_by_key(|lobe| lobe.as_ref().is_some_and(Lobe::is_delta));
        Self { lobes }
    }

    /// The lobes.
    pub fn lobes(&self) -> impl Iterator<Item = &Lobe> {
        self.lobes.iter().flatten()
    }

    /// Probability of choosing each lobe.
    fn choice(&self, wo: Vec3) -> [f32; 3] {
        let weight = |lobe: &Lobe| lobe.albedo_towards(wo).mean();
        let weights = self.lobes.each_ref().map(|lobe| lobe.as_ref().map_or(0.0, weight));
        let total: f32 = weights.iter().sum();
        weights.map(|w| if total > 0.0 { w / total } else { 0.0 })
    }

    /// Probability of choosing each of the lobes that there are.
    pub(super) fn probabilities(&self, wo: Vec3) -> Vec<f32> {
        let choice = self.lobes.iter().zip(self.choice(wo));
        choice.filter(|(lobe, _)| lobe.is_some()).map(|(_, p)| p).collect()
    }

    /// Sum over lobes.
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        self.lobes().fold(Spectrum::ZERO, |f, lobe| f + lobe.eval(wo, wi))
    }

    /// Sum over lobes, each with its probability.
    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.pdf_for(&self.choice(wo), wo, wi)
    }

    fn pdf_for(&self, choice: &[f32; 3], wo: Vec3, wi: Vec3) -> f32 {
        let lobes = self.lobes.iter().zip(choice);
        lobes.fold(0.0, |pdf, (lobe, p)| {
            pdf + lobe.as_ref().map_or(0.0, |l| p * l.pdf(wo, wi))
        })
    }

    /// Probability that a smooth lobe is chosen.
    pub(super) fn smooth_probability(&self, wo: Vec3) -> f32 {
        if !self.lobes().any(Lobe::is_delta) {
            return 1.0;
        }
        let lobes = self.lobes.iter().zip(self.choice(wo));
        let smooth = |(lobe, p): (&Option<Lobe>, f32)| lobe.as_ref().is_some_and(|l| !l.is_delta()).then_some(p);
        lobes.filter_map(smooth).sum()
    }

    pub(super) fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        let choice = self.choice(wo);
        let lobes = self.lobes.iter().zip(choice);
        let lobes = lobes.filter_map(|(lobe, p)| lobe.as_ref().map(|lobe| (lobe, p)));
        let (lobe, p, u_part) = chosen(lobes, u_lobe)?;
        let sample = lobe.sample(wo, u_part, u, mode)?;
        if lobe.is_delta() {
            return of_all(sample, sample.f, sample.pdf * p);
        }
        let f = match mode {
            TransportMode::Radiance => self.eval(wo, sample.wi),
            TransportMode::Importance => self.eval(sample.wi, wo),
        };
        of_all(sample, f, self.pdf_for(&choice, wo, sample.wi))
    }
}

/// The direction that one lobe has drawn, with value and density of all; `None` where it lies in the surface.
pub(super) fn of_all(sample: BsdfSample, f: Spectrum, pdf: f32) -> Option<BsdfSample> {
    (pdf > 0.0).then(|| BsdfSample {
        eta: sample.eta,
        ..BsdfSample::new(f, sample.wi, pdf, sample.scattering)
    })
}

/// The lobe whose share of [0, 1) holds `u`, its probability, and where in its share `u` lies: a number for its own choices.
pub(super) fn chosen<T>(lobes: impl Iterator<Item = (T, f32)>, u: f32) -> Option<(T, f32, f32)> {
    let mut below = 0.0;
    let mut last = None;
    for (lobe, p) in lobes {
        if p > 0.0 {
            last = Some((lobe, p, ((u - below) / p).min(ALMOST_ONE)));
            below += p;
            if u < below {
                break;
            }
        }
    }
    last
}
