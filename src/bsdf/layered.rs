//! A base under a sheen, under a clear coat: transmittances of the layers multiply what each lobe of the base scatters.
//!
//! The lobes of the base need to know nothing of the layers. The factor must be the same both ways, and must not let out more in any direction than
//! the layer leaves. `T(wi) T(wo)` over the mean is exact for diffuse lobes, and the lesser of `T(wi)` and `T(wo)` for mirrors. Wide glossy lobes
//! between the two lose light (docs/benchmarks.md, "Energy of lobes").
//!
//! A real coat also darkens and saturates its base, by reflecting inwards what the base scatters. This one does not. Only surfaces that have layers
//! pay for them.

use super::mix::{chosen, of_all};
use super::{BsdfSample, Lobe, Sheen, TransportMode};
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3};

/// The sum of up to three lobes of a base, under a sheen, under a clear coat.
///
/// What lies above takes the light that it scatters, of albedo `E`, from what is below: that gets `T = 1 − E` on the way in and on the way out. For
/// diffuse lobes that makes `T(wo) T(wi)` over the mean of `T`, since what does not get out is scattered again (Kelemen and Szirmay-Kalos 2001, "A
/// Microfacet Based Coupled Specular-Matte BRDF Model with Importance Sampling"). Other lobes scatter about the mirror direction, where
/// both are alike: they get the lesser of both (as the sheen of glTF's `KHR_materials_sheen`), which loses light only where they are wide. Both
/// forms are reciprocal and give no more than there is.
///
/// The layers have no thickness: they neither bend nor blur what passes, and the base's index of refraction is that against air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layered {
    /// The base's, the sheen and the coat.
    lobes: [Option<Lobe>; 5],
    /// Mean of what passes the layers, weighed by what the diffuse lobe scatters.
    diffuse_passed: f32,
}

const SHEEN: usize = 3;
const COAT: usize = 4;

impl Layered {
    /// A base of a diffuse, a glossy or mirror-like and a transmitting lobe, in this order, under a `sheen`, under a `coat` that reflects.
    pub fn new([diffuse, glossy, transmitting]: [Option<Lobe>; 3], sheen: Option<Sheen>, coat: Option<Lobe>) -> Self {
        let layered = Self {
            lobes: [diffuse, glossy, transmitting, sheen.map(Lobe::Sheen), coat],
            diffuse_passed: 1.0,
        };
        // Midpoints in cos²
        const POINTS: u32 = 16;
        let (mut passed, mut scattered) = (0.0, 0.0);
        for cos2 in (0..POINTS).map(|i| (i as f32 + 0.5) / POINTS as f32) {
            let w = Vec3::new((1.0 - cos2).sqrt(), 0.0, cos2.sqrt());
            let albedo = diffuse.map_or(0.0, |lobe| lobe.albedo_towards(w).mean());
            scattered += albedo;
            passed += albedo * layered.passed(w)[0];
        }
        let diffuse_passed = if passed > 0.0 { passed / scattered } else { 1.0 };
        Self {
            diffuse_passed,
            ..layered
        }
    }

    /// The lobes, each as it is without what lies above it, and its place.
    pub(super) fn lobes(&self) -> impl Iterator<Item = (usize, &Lobe)> {
        let lobes = self.lobes.iter().enumerate();
        lobes.filter_map(|(place, lobe)| lobe.as_ref().map(|lobe| (place, lobe)))
    }

    /// Share of the light towards `w` that passes what lies above each lobe.
    fn passed(&self, w: Vec3) -> [f32; 5] {
        let past = |lobe: &Option<Lobe>| {
            let taken = lobe.as_ref().map_or(0.0, |l| l.albedo_towards(w).max_component());
            (1.0 - taken).max(0.0)
        };
        let coat = past(&self.lobes[COAT]);
        let base = coat * past(&self.lobes[SHEEN]);
        [base, base, base, coat, 1.0]
    }

    /// What light counts that a lobe scatters, where the shares `o` and `i` pass on its way out and in.
    fn through(&self, lobe: &Lobe, o: f32, i: f32) -> f32 {
        match lobe {
            Lobe::Lambert(_) | Lobe::CoatedLambert(_) => o * i / self.diffuse_passed,
            _ => o.min(i),
        }
    }

    /// `sample` of the lobe in `place`, less what the layers take.
    pub(super) fn below(&self, place: usize, lobe: &Lobe, wo: Vec3, sample: BsdfSample) -> BsdfSample {
        let share = self.through(lobe, self.passed(wo)[place], self.passed(sample.wi)[place]);
        BsdfSample {
            f: sample.f * share,
            weight: sample.weight * share,
            ..sample
        }
    }

    /// Share that is scattered of light along the normal: an estimate for uniform light.
    pub(super) fn albedo(&self) -> Spectrum {
        let passed = self.passed(Vec3::Z);
        let lobes = self.lobes();
        lobes.fold(Spectrum::ZERO, |sum, (place, lobe)| sum + lobe.albedo() * passed[place])
    }

    /// Probability of choosing each lobe.
    fn choice(&self, wo: Vec3) -> [f32; 5] {
        let passed = self.passed(wo);
        let mut weights = [0.0; 5];
        for (place, lobe) in self.lobes() {
            weights[place] = lobe.albedo_towards(wo).mean() * passed[place];
        }
        let total: f32 = weights.iter().sum();
        weights.map(|w| if total > 0.0 { w / total } else { 0.0 })
    }

    /// The same of the lobes that there are.
    pub(super) fn probabilities(&self, wo: Vec3) -> Vec<f32> {
        let choice = self.choice(wo);
        self.lobes().map(|(place, _)| choice[place]).collect()
    }

    /// Sum over lobes.
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        let (o, i) = (self.passed(wo), self.passed(wi));
        self.lobes().fold(Spectrum::ZERO, |f, (place, lobe)| {
            f + lobe.eval(wo, wi) * self.through(lobe, o[place], i[place])
        })
    }

    /// Sum over lobes, each with its probability.
    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.pdf_for(&self.choice(wo), wo, wi)
    }

    fn pdf_for(&self, choice: &[f32; 5], wo: Vec3, wi: Vec3) -> f32 {
        self.lobes()
            .fold(0.0, |pdf, (place, lobe)| pdf + choice[place] * lobe.pdf(wo, wi))
    }

    /// Probability that a smooth lobe is chosen.
    pub(super) fn smooth_probability(&self, wo: Vec3) -> f32 {
        let choice = self.choice(wo);
        let delta = self.lobes().filter(|(_, lobe)| lobe.is_delta());
        (1.0 - delta.map(|(place, _)| choice[place]).sum::<f32>()).max(0.0)
    }

    pub(super) fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        let choice = self.choice(wo);
        // Smooth ones first, as in a mixture
        let lobes = |is_delta| self.lobes().filter(move |(_, lobe)| lobe.is_delta() == is_delta);
        let lobes = lobes(false).chain(lobes(true));
        let ((place, lobe), p, u_part) = chosen(lobes.map(|found| (found, choice[found.0])), u_lobe)?;
        let sample = lobe.sample(wo, u_part, u, mode)?;
        if lobe.is_delta() {
            return of_all(sample, self.below(place, lobe, wo, sample).f, sample.pdf * p);
        }
        let f = match mode {
            TransportMode::Radiance => self.eval(wo, sample.wi),
            TransportMode::Importance => self.eval(sample.wi, wo),
        };
        of_all(sample, f, self.pdf_for(&choice, wo, sample.wi))
    }
}
