//! A base under a sheen, under a clear coat: transmittances of the layers multiply what each lobe of the base scatters.
//!
//! The lobes of the base need to know nothing of the layers. The factor must be the same both ways, and must not let out more in any direction than
//! the layer leaves. `T(wi) T(wo)` over the mean is exact for diffuse lobes, and the lesser of `T(wi)` and `T(wo)` for mirrors. Wide glossy lobes
//! between the two lose light (docs/benchmarks.md, "Energy of lobes").
//!
//! A real coat also darkens and saturates its base, by reflecting inwards what the base scatters. This one does not. Only surfaces that have layers
//! pay for them.

use super::{BsdfSample, Lobe, Sheen, TransportMode};
use crate::color::Spectrum;
use crate::math::Vec3;

/// The sum of up to three lobes of a base, under a sheen, under a clear coat.
///
/// What lies above takes the light that it scatters, of albedo `E`, from what is below: that gets `T = 1 − E` on the way in and on the way out. For
/// diffuse lobes that makes `T(wo) T(wi)` over the mean of `T`, since what does not get out is scattered again (Kelemen and Szirmay-Kalos 2001, "A
/// Microfacet Based Coupled Specular-Matte BRDF Model with Importance Sampling"). Other lobes scatter about the mirror direction, where
/// both are alike: they get the lesser of both (as the sheen of glTF's `KHR_materials_sheen`), which loses light only where they are wide. Both
/// forms are reciprocal and add no energy.
///
/// The layers have no thickness: they neither bend nor blur what passes, and the base's index of refraction is that against air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layered {
    /// The base's, the sheen and the coat.
    pub(super) lobes: [Option<Lobe>; 5],
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

    /// Share of the light towards `w` that passes what lies above each lobe.
    #[inline(never)]
    pub(super) fn passed(&self, w: Vec3) -> [f32; 5] {
        let past = |lobe: &Option<Lobe>| {
            let taken = lobe.as_ref().map_or(0.0, |l| l.albedo_towards(w).max_component());
            (1.0 - taken).max(0.0)
        };
        let coat = past(&self.lobes[COAT]);
        let base = coat * past(&self.lobes[SHEEN]);
        [base, base, base, coat, 1.0]
    }

    /// What light counts that a lobe scatters, where the shares `o` and `i` pass on its way out and in.
    pub(super) fn transmittance(&self, lobe: &Lobe, o: f32, i: f32) -> f32 {
        match lobe {
            Lobe::Lambert(_) | Lobe::CoatedLambert(_) => o * i / self.diffuse_passed,
            _ => o.min(i),
        }
    }

    /// `sample` of the lobe in `place`, less what the layers take.
    pub(super) fn below(&self, place: usize, lobe: &Lobe, wo: Vec3, sample: BsdfSample) -> BsdfSample {
        let share = self.transmittance(lobe, self.passed(wo)[place], self.passed(sample.wi)[place]);
        BsdfSample {
            f: sample.f * share,
            weight: sample.weight * share,
            ..sample
        }
    }

    /// Share of uniform light that the delta lobe in `place` scatters to `wo` through the layers.
    pub(super) fn delta_albedo(&self, place: usize, lobe: &Lobe, wo: Vec3) -> Spectrum {
        let directions = lobe.directions(wo, TransportMode::Importance);
        let below = directions.into_iter().flatten().map(|s| self.below(place, lobe, wo, s));
        below.fold(Spectrum::ZERO, |sum, s| sum + s.weight * s.pdf)
    }

    /// Share that is scattered of light along the normal: an estimate for uniform light.
    pub(super) fn albedo(&self) -> Spectrum {
        let passed = self.passed(Vec3::Z);
        let lobes = self.lobes.iter().zip(passed);
        lobes.fold(Spectrum::ZERO, |sum, (lobe, passed)| {
            sum + lobe.as_ref().map_or(Spectrum::ZERO, |lobe| lobe.albedo() * passed)
        })
    }
}
