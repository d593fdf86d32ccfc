//! A base under two layers: a sheen, and a clear coat above the sheen. The lobes of the base are
//! multiplied by the transmittances of the layers.
//!
//! The lobes of the base do not depend on the layers. The layer multiplies a lobe by a factor. This
//! factor must be symmetric in `wo` and `wi`. It must not exceed the transmittance of the layer in
//! any direction. `T(wi) T(wo)` divided by the mean of `T` is exact for diffuse lobes, and the
//! minimum of `T(wi)` and `T(wo)` is exact for mirrors. Wide glossy lobes, which are neither
//! diffuse nor mirrors, lose light (docs/notebook/2026-11.md, "Energy of lobes").
//!
//! A real coat also darkens and saturates its base, because the coat reflects light of the base
//! inwards. This effect is left out. Layers add no cost to surfaces without layers.

use super::{BsdfSample, Lobe, Sheen, TransportMode};
use crate::color::Spectrum;
use crate::math::Vec3;

/// Sum of up to three base lobes under two layers: a sheen, and a clear coat above the sheen.
///
/// A layer with albedo `E` has the transmittance `T = 1 − E`, on the way in and on the way out. For
/// diffuse lobes the factor is `T(wo) T(wi)` divided by the mean of `T`, because light that does
/// not leave is scattered again (Kelemen and Szirmay-Kalos 2001, "A Microfacet Based Coupled
/// Specular-Matte BRDF Model with Importance Sampling"). Other lobes scatter around the mirror
/// direction, where `T(wo)` and `T(wi)` are equal. The factor of these lobes is the minimum of
/// `T(wo)` and `T(wi)` (as for the sheen of glTF's `KHR_materials_sheen`). It loses light only if
/// the lobe is wide. Both forms are reciprocal and add no energy.
///
/// The layers have no thickness, so they neither refract nor blur the light. The base's index of
/// refraction is relative to air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layered {
    /// Lobes of the base, then the sheen and the coat.
    pub(super) lobes: [Option<Lobe>; 5],
    /// Mean transmittance of the layers, weighted by the albedo of the diffuse lobe.
    diffuse_passed: f32,
}

const SHEEN: usize = 3;
const COAT: usize = 4;

impl Layered {
    /// BSDF of a base with three lobes (diffuse, glossy or mirror-like, transmitting) under a
    /// `sheen`, with a reflecting `coat` above the sheen.
    pub fn new([diffuse, glossy, transmitting]: [Option<Lobe>; 3], sheen: Option<Sheen>, coat: Option<Lobe>) -> Self {
        let layered = Self {
            lobes: [diffuse, glossy, transmitting, sheen.map(Lobe::Sheen), coat],
            diffuse_passed: 1.0,
        };
        // Use the midpoint rule in cos²
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

    /// Transmittance towards `w` of the layers above each lobe.
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

    /// Factor by which the layers multiply the value of a lobe. `o` and `i` are the transmittances
    /// of the layers towards `wo` and `wi`.
    pub(super) fn transmittance(&self, lobe: &Lobe, o: f32, i: f32) -> f32 {
        match lobe {
            Lobe::Lambert(_) | Lobe::CoatedLambert(_) => o * i / self.diffuse_passed,
            _ => o.min(i),
        }
    }

    /// `sample` of the lobe with the index `place`, times the transmittance of the layers.
    pub(super) fn below(&self, place: usize, lobe: &Lobe, wo: Vec3, sample: BsdfSample) -> BsdfSample {
        let share = self.transmittance(lobe, self.passed(wo)[place], self.passed(sample.wi)[place]);
        BsdfSample {
            f: sample.f * share,
            weight: sample.weight * share,
            ..sample
        }
    }

    /// Directional albedo towards `wo` of the delta lobe with the index `place`, through the
    /// layers.
    pub(super) fn delta_albedo(&self, place: usize, lobe: &Lobe, wo: Vec3) -> Spectrum {
        let directions = lobe.directions(wo, TransportMode::Importance);
        let below = directions.into_iter().flatten().map(|s| self.below(place, lobe, wo, s));
        below.fold(Spectrum::ZERO, |sum, s| sum + s.weight * s.pdf)
    }

    /// Albedo along the normal, as an estimate of the albedo under uniform light.
    pub(super) fn albedo(&self) -> Spectrum {
        let passed = self.passed(Vec3::Z);
        let lobes = self.lobes.iter().zip(passed);
        lobes.fold(Spectrum::ZERO, |sum, (lobe, passed)| {
            sum + lobe.as_ref().map_or(Spectrum::ZERO, |lobe| lobe.albedo() * passed)
        })
    }
}
