//! Fresnel reflectance of dielectrics and conductors, and refraction.

use crate::color::Spectrum;
use crate::math::{Vec3, encode_variants};

/// Reflectance of a smooth boundary for unpolarised light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Fresnel {
    /// 1 at every angle.
    #[default]
    Full,
    /// Boundary between dielectrics.
    Dielectric {
        /// Index of refraction behind the boundary, relative to the index in front of it.
        eta: f32,
    },
    /// Boundary of a conductor.
    Conductor {
        /// Index of refraction, for each channel.
        eta: [f32; 3],
        /// Extinction coefficient, for each channel.
        k: [f32; 3],
    },
    /// Schlick's formula, `f0` along the normal and white at grazing angles (Schlick 1994).
    Schlick {
        /// Reflectance along the normal, for each channel.
        f0: [f32; 3],
    },
}

encode_variants!(Fresnel {
    0 => Full,
    1 => Dielectric { eta },
    2 => Conductor { eta, k },
    3 => Schlick { f0 },
});

impl Fresnel {
    /// Reflectance at an angle of incidence with the cosine `cos_i` ≥ 0.
    pub fn reflectance(&self, cos_i: f32) -> Spectrum {
        match *self {
            Self::Full => Spectrum::ONE,
            Self::Dielectric { eta } => Spectrum::splat(dielectric(cos_i, eta).0),
            Self::Conductor { eta, k } => {
                Spectrum::from([0, 1, 2].map(|channel| conductor(cos_i, eta[channel], k[channel])))
            }
            Self::Schlick { f0 } => {
                let f0 = Spectrum::from(f0);
                f0 + (Spectrum::ONE - f0) * (1.0 - cos_i).max(0.0).powi(5)
            }
        }
    }

    /// [`Fresnel::reflectance`] for auxiliary channels. Conductors are computed in f32, with an
    /// error below 10⁻³, in a third of the time.
    pub(super) fn fast_reflectance(&self, cos_i: f32) -> Spectrum {
        match *self {
            Self::Conductor { eta, k } => Spectrum::from([0, 1, 2].map(|c| fast_conductor(cos_i, eta[c], k[c]))),
            _ => self.reflectance(cos_i),
        }
    }

    /// Directional albedo of microfacets with this Fresnel term. `all` is the albedo of perfect
    /// mirror facets, and `grazing` is the same albedo with each reflection weighted by `(1 −
    /// cos)⁵`.
    ///
    /// The result is exact for Schlick's term, which is linear in `(1 − cos)⁵`. Other terms are
    /// nearly linear in `(1 − cos)⁵`, so they are evaluated at the angle where `(1 − cos)⁵` has its
    /// mean.
    pub(super) fn mean_reflectance(&self, all: f32, grazing: f32) -> Spectrum {
        match *self {
            Self::Full => Spectrum::splat(all),
            Self::Schlick { f0 } => Spectrum::from(f0) * (all - grazing) + Spectrum::splat(grazing),
            Self::Dielectric { .. } | Self::Conductor { .. } => {
                let mean = if all > 0.0 {
                    (grazing / all).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                self.fast_reflectance(1.0 - mean.powf(0.2)) * all
            }
        }
    }

    /// Factor of the Fresnel term in [`Lobe::albedo`](super::Lobe::albedo), an estimate without a
    /// view direction. Schlick's term counts with its mean over the hemisphere. All other terms
    /// count as 1.
    pub(super) fn tint(&self) -> Spectrum {
        match self {
            Self::Schlick { .. } => self.mean(),
            _ => Spectrum::ONE,
        }
    }

    /// Cosine-weighted mean reflectance over a hemisphere, `2 ∫ F cos d cos`.
    pub(super) fn mean(&self) -> Spectrum {
        match *self {
            Self::Full => Spectrum::ONE,
            // Integral of Schlick's formula: `1 − f0` has the weight 2 ∫ (1 − x)⁵ x dx = 1/21
            Self::Schlick { f0 } => Spectrum::from(f0.map(|f0| (20.0 * f0 + 1.0) / 21.0)),
            // Use the midpoint rule in cos²
            Self::Dielectric { .. } | Self::Conductor { .. } => {
                const POINTS: u32 = 64;
                let cosines = (0..POINTS).map(|i| ((i as f32 + 0.5) / POINTS as f32).sqrt());
                let sum = cosines.fold(Spectrum::ZERO, |sum, cos| sum + self.reflectance(cos));
                sum / POINTS as f32
            }
        }
    }
}

/// Returns the reflectance, and the cosine of the refracted direction. `cos_i` ≥ 0 is the cosine of
/// incidence, and `eta` = η_t/η_i is the relative index of the medium. Under total reflection, the
/// reflectance is 1 and the cosine 0 (PBR4 eq. 9.6).
pub fn dielectric(cos_i: f32, eta: f32) -> (f32, f32) {
    // Equal indices reflect exactly 0, without rounding.
    if eta == 1.0 {
        return (0.0, cos_i);
    }
    // Cosine of the refracted direction, by Snell's law
    let cos2_t = 1.0 - (1.0 - cos_i * cos_i).max(0.0) / (eta * eta);
    if cos2_t <= 0.0 {
        return (1.0, 0.0);
    }
    let cos_t = cos2_t.sqrt();
    // Reflected amplitudes of the two polarisations
    let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    (0.5 * (parallel * parallel + perpendicular * perpendicular), cos_t)
}

/// Direction in which the facet `h` refracts `w`. `cos_i` and `cos_t` are the cosines of `w` and of
/// the refracted direction with the normal of the facet. `eta` is the index on the far side,
/// relative to the side of `w`, as in [`dielectric`] (PBR4 eq. 9.5).
pub fn refract(w: Vec3, h: Vec3, cos_i: f32, cos_t: f32, eta: f32) -> Vec3 {
    (cos_i / eta - cos_t) * h - w / eta
}

/// Reflectance of a conductor of complex index `eta + i k`, relative to the medium in front of it.
///
/// The result is the exact solution in real arithmetic, computed in f64 (Lagarde 2013, "Memo on
/// Fresnel equations"; Born and Wolf, §14.2).
pub fn conductor(cos_i: f32, eta: f32, k: f32) -> f32 {
    let (cos_i, eta, k) = (cos_i.clamp(0.0, 1.0) as f64, eta as f64, k as f64);
    let (cos2, sin2) = (cos_i * cos_i, 1.0 - cos_i * cos_i);
    let t0 = eta * eta - k * k - sin2;
    let a2_plus_b2 = (t0 * t0 + 4.0 * eta * eta * k * k).sqrt();
    let a = (0.5 * (a2_plus_b2 + t0)).max(0.0).sqrt();
    let (t1, t2) = (a2_plus_b2 + cos2, 2.0 * cos_i * a);
    let perpendicular = (t1 - t2) / (t1 + t2);
    let (t3, t4) = (cos2 * a2_plus_b2 + sin2 * sin2, t2 * sin2);
    let parallel = if t3 + t4 > 0.0 {
        perpendicular * (t3 - t4) / (t3 + t4)
    } else {
        perpendicular
    };
    (0.5 * (parallel + perpendicular)) as f32
}

/// [`conductor`] in f32.
#[inline(always)]
fn fast_conductor(cos_i: f32, eta: f32, k: f32) -> f32 {
    let cos_i = cos_i.clamp(0.0, 1.0);
    let (cos2, sin2) = (cos_i * cos_i, 1.0 - cos_i * cos_i);
    let t0 = eta * eta - k * k - sin2;
    let a2_plus_b2 = (t0 * t0 + 4.0 * eta * eta * k * k).sqrt();
    let a = (0.5 * (a2_plus_b2 + t0)).max(0.0).sqrt();
    let (t1, t2) = (a2_plus_b2 + cos2, 2.0 * cos_i * a);
    let perpendicular = (t1 - t2) / (t1 + t2);
    let (t3, t4) = (cos2 * a2_plus_b2 + sin2 * sin2, t2 * sin2);
    let ratio = if t3 + t4 > 0.0 { (t3 - t4) / (t3 + t4) } else { 1.0 };
    0.5 * perpendicular * (1.0 + ratio)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::FRAC_1_SQRT_2;

    #[test]
    fn dielectric_known_values() {
        let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-6, "{a} against {b}");
        close(dielectric(1.0, 1.5).0, 0.04);
        close(dielectric(1.0, 1.0 / 1.5).0, 0.04);
        close(dielectric(FRAC_1_SQRT_2, 1.5).0, 0.050_240);
        close(dielectric(0.0, 1.5).0, 1.0);
        // From inside, 45° is beyond the critical angle of 41.8°.
        assert_eq!(dielectric(FRAC_1_SQRT_2, 1.0 / 1.5), (1.0, 0.0));
        // At Brewster's angle, the reflectance is half of the reflectance of perpendicular
        // polarisation.
        let cos_brewster = 1.0 / (1.0f32 + 1.5 * 1.5).sqrt();
        let (r, cos_t) = dielectric(cos_brewster, 1.5);
        close(r, 0.5 * ((1.0 - 2.25f32) / (1.0 + 2.25)).powi(2));
        close(cos_t, (1.0 - cos_brewster * cos_brewster).sqrt());
        // Equal indices do not reflect.
        close(dielectric(0.3, 1.0).0, 0.0);
    }

    #[test]
    fn reflectance_is_equal_from_both_sides() {
        for cos_i in [0.05, 0.3, 0.7, 0.99] {
            let (r, cos_t) = dielectric(cos_i, 1.7);
            let (back, cos_back) = dielectric(cos_t, 1.0 / 1.7);
            assert!((r - back).abs() < 1e-5 && (cos_back - cos_i).abs() < 1e-5);
        }
    }

    #[test]
    fn refraction_obeys_snells_law() {
        let h = Vec3::new(0.3, -0.2, 0.9).normalize();
        let w = Vec3::new(-0.2, 0.1, 0.7).normalize();
        for eta in [1.5, 1.0 / 1.5, 1.0] {
            let cos_i = w.dot(h);
            let (_, cos_t) = dielectric(cos_i, eta);
            let t = refract(w, h, cos_i, cos_t, eta);
            assert!((t.length() - 1.0).abs() < 1e-6 && (t.dot(h) + cos_t).abs() < 1e-6);
            assert!((t.cross(h) * eta + w.cross(h)).length() < 1e-6, "{eta}");
        }
    }

    #[test]
    fn means_over_the_cosine() {
        assert_eq!(Fresnel::Full.mean(), Spectrum::ONE);
        // Compare the means with integrals over the angle
        let terms = [
            Fresnel::Dielectric { eta: 1.5 },
            Fresnel::Dielectric { eta: 1.0 / 1.5 },
            Fresnel::Conductor {
                eta: [0.14, 0.37, 1.44],
                k: [3.98, 2.39, 1.60],
            },
            Fresnel::Schlick { f0: [0.04, 0.5, 0.9] },
        ];
        for fresnel in terms {
            let n = 10_000;
            let angles = (0..n).map(|i| (i as f32 + 0.5) / n as f32 * std::f32::consts::FRAC_PI_2);
            let sum = angles.fold([0.0f64; 3], |sum, angle| {
                let (sin, cos) = angle.sin_cos();
                let f = fresnel.reflectance(cos).to_array();
                [0, 1, 2].map(|c| sum[c] + (f[c] * 2.0 * sin * cos) as f64)
            });
            let mean = fresnel.mean().to_array();
            for c in 0..3 {
                let expected = sum[c] * std::f64::consts::FRAC_PI_2 / n as f64;
                assert!(
                    (mean[c] as f64 - expected).abs() < 3e-3,
                    "{fresnel:?}: {mean:?} {expected}"
                );
            }
        }
    }

    #[test]
    fn fast_conductor_matches_conductor() {
        for (eta, k) in [
            (0.05, 9.0),
            (0.14, 3.98),
            (1.44, 1.6),
            (2.9, 3.1),
            (1.5, 0.0),
            (1.0, 0.0),
        ] {
            for cos_i in (1..=50).map(|i| i as f32 / 50.0) {
                let (fast, exact) = (fast_conductor(cos_i, eta, k), conductor(cos_i, eta, k));
                assert!((fast - exact).abs() < 1e-3, "{eta} {k} {cos_i}: {fast} {exact}");
            }
        }
    }

    #[test]
    fn conductor_known_values() {
        // Normal incidence: ((η − 1)² + k²) / ((η + 1)² + k²).
        let normal = |eta: f32, k: f32| ((eta - 1.0).powi(2) + k * k) / ((eta + 1.0).powi(2) + k * k);
        for (eta, k) in [(0.2, 3.9), (1.5, 0.0), (0.14, 4.1), (2.9, 3.1)] {
            assert!((conductor(1.0, eta, k) - normal(eta, k)).abs() < 1e-6);
            assert!((conductor(0.0, eta, k) - 1.0).abs() < 1e-6);
        }
        // Without absorption, a conductor is a dielectric.
        for cos_i in [0.1, 0.5, 0.9] {
            assert!((conductor(cos_i, 1.5, 0.0) - dielectric(cos_i, 1.5).0).abs() < 1e-6);
        }
        // With the index of vacuum, a conductor does not reflect.
        assert!(conductor(0.5, 1.0, 0.0).abs() < 1e-6);
    }
}
