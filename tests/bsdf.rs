//! Lobes and mixtures: samples against densities, energy, reciprocity.

#[path = "support/chi_square.rs"]
mod chi_square;
mod support;

use chi_square::{chi_square, sidak};
use embrasure::bsdf::*;
use embrasure::color::Spectrum;
use embrasure::material::{Gloss, Material};
use embrasure::math::{Vec2, Vec3};
use embrasure::sampler::{Bounce, Dimension, Independent, PerturbedQmc, SampleKey, Sampler, SamplerKind};
use embrasure::sampling::warp::{cosine_hemisphere_of_sphere, cosine_hemisphere_pdf};

const SAMPLES: u32 = 1_000_000;
const INCIDENCES: [f32; 4] = [0.0, 30.0, 60.0, 80.0];
const EXPONENTS: [f32; 4] = [1.0, 10.0, 100.0, 1000.0];
const GOLD: Fresnel = Fresnel::Conductor {
    eta: [0.14, 0.37, 1.44],
    k: [3.98, 2.39, 1.60],
};

/// The `index`-th number for the lobe and pair for the direction.
fn numbers(seed: u64, index: u32) -> (f32, Vec2) {
    let mut sampler = Independent::new(seed);
    sampler.start(SampleKey::new(0, 0, index));
    let dimension = |what| Dimension::bounce(0, what);
    (
        sampler.get_1d(dimension(Bounce::Lobe)),
        sampler.get_2d(dimension(Bounce::Direction)),
    )
}

/// A direction at `degrees` from the normal, at some azimuth.
fn incident(degrees: f32) -> Vec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    Vec3::new(0.8 * sin, -0.6 * sin, cos)
}

fn grey(value: f32) -> Spectrum {
    Spectrum::splat(value)
}

/// Every smooth lobe, and mixtures of all kinds.
fn bsdfs() -> Vec<(String, Bsdf)> {
    let single = |name: String, lobe| (name, Bsdf::Single(lobe));
    let mut all = vec![single("lambert".into(), Lobe::Lambert(Lambert { albedo: grey(0.8) }))];
    for exponent in EXPONENTS {
        let reflectance = grey(1.0);
        all.push(single(
            format!("phong {exponent}"),
            Lobe::Phong(Phong { reflectance, exponent }),
        ));
        for (name, fresnel) in [
            ("full", Fresnel::Full),
            ("dielectric", Fresnel::Dielectric { eta: 1.5 }),
            ("gold", GOLD),
        ] {
            let lobe = Blinn {
                reflectance,
                exponent,
                fresnel,
            };
            all.push(single(format!("blinn {name} {exponent}"), Lobe::Blinn(lobe)));
        }
    }
    let base = Material {
        diffuse: Spectrum::rgb(0.4, 0.2, 0.3),
        specular: grey(0.3),
        gloss: Gloss::Phong(50.0),
        ..Material::default()
    };
    let mixtures = [
        ("diffuse + phong", base.clone()),
        (
            "diffuse + blinn",
            Material {
                gloss: Gloss::Blinn(30.0, GOLD),
                ..base.clone()
            },
        ),
        (
            "diffuse + mirror",
            Material {
                gloss: Gloss::Mirror(GOLD),
                ..base.clone()
            },
        ),
        (
            "diffuse + phong + glass",
            Material {
                transmission: grey(0.3),
                ..base.clone()
            },
        ),
        (
            "diffuse + veil",
            Material {
                specular: grey(0.0),
                transmission: grey(0.4),
                thin: true,
                ..base.clone()
            },
        ),
    ];
    all.extend(mixtures.map(|(name, material)| (name.to_string(), material.bsdf())));
    all
}

#[test]
fn samples_follow_their_densities() {
    let bsdfs = bsdfs();
    let level = sidak(0.01, bsdfs.len() * INCIDENCES.len());
    for (seed, (name, bsdf)) in bsdfs.iter().enumerate() {
        for degrees in INCIDENCES {
            // From behind, too: lobes are alike on both sides.
            let side = if seed % 3 == 2 { -1.0 } else { 1.0 };
            let wo = incident(degrees) * Vec3::new(1.0, 1.0, side);
            let sample = |i| {
                let (u_lobe, u) = numbers(seed as u64, i);
                let s = bsdf.sample(wo, u_lobe, u, TransportMode::Radiance)?;
                assert!(
                    s.f.is_valid() && s.pdf > 0.0 && s.pdf.is_finite(),
                    "{name} {degrees}°: {s:?}"
                );
                if s.is_delta() {
                    return None;
                }
                assert_eq!(
                    (s.f, s.pdf),
                    (bsdf.eval(wo, s.wi), bsdf.pdf(wo, s.wi)),
                    "{name} {degrees}°"
                );
                Some(s.wi)
            };
            let outcome = chi_square(SAMPLES, sample, |wi| bsdf.pdf(wo, wi) as f64, false);
            let error = (outcome.integral - outcome.share).abs();
            assert!(
                error < 3e-3,
                "{name} {degrees}°: ∫pdf {} but {} of the samples",
                outcome.integral,
                outcome.share
            );
            assert!(outcome.p_value > level, "{name} {degrees}°: {outcome:?}, level {level}");
        }
    }
}

/// Directions through the sphere have the cosine's density, each by itself: every one here is of another set, at any place in it.
#[test]
fn perturbed_points_follow_the_cosine() {
    for (seed, count) in [(1, 16), (2, 64), (3, 1024)] {
        let mut sampler = PerturbedQmc::new(seed, count, SamplerKind::Sobol.with_seed(seed, count));
        let direction = |i| {
            sampler.start(SampleKey::new(i, i / 1000, i % 100));
            Some(cosine_hemisphere_of_sphere(
                sampler.get_2d(Dimension::bounce(1, Bounce::Direction)),
            ))
        };
        let outcome = chi_square(SAMPLES, direction, |wi| cosine_hemisphere_pdf(wi.z) as f64, false);
        assert!(outcome.p_value > sidak(0.01, 3), "{count}: {outcome:?}");
    }
}

/// The tests above must be able to fail: wrong scale, wrong shape, a lobe that is a little too wide, lost samples.
#[test]
fn wrong_densities_are_found() {
    let wo = incident(60.0);
    let phong = |exponent| Phong {
        reflectance: Spectrum::ONE,
        exponent,
    };
    let lambert = Lambert { albedo: Spectrum::ONE };
    let p = |sample: &dyn Fn(Vec2) -> Option<BsdfSample>, pdf: &dyn Fn(Vec3) -> f32| {
        chi_square(
            SAMPLES,
            |i| sample(numbers(5, i).1).map(|s| s.wi),
            |wi| pdf(wi) as f64,
            false,
        )
        .p_value
    };
    let cosine = |u| lambert.sample(wo, u);
    assert!(p(&cosine, &|wi| lambert.pdf(wo, wi)) > 1e-3);
    assert!(p(&cosine, &|wi| 1.05 * lambert.pdf(wo, wi)) < 1e-6);
    assert!(p(&cosine, &|wi| if wi.z > 0.0 { 0.5 / std::f32::consts::PI } else { 0.0 }) < 1e-6);
    assert!(p(&|u| phong(100.0).sample(wo, u), &|wi| phong(102.0).pdf(wo, wi)) < 1e-6);
    let lossy = |u: Vec2| cosine(u).filter(|s| s.wi.x < 0.99);
    assert!(p(&|u| lossy(u).filter(|_| u.x > 0.01), &|wi| lambert.pdf(wo, wi)) < 1e-6);
}

#[test]
fn reflection_is_reciprocal_and_keeps_energy() {
    for (name, bsdf) in bsdfs() {
        for degrees in INCIDENCES {
            let wo = incident(degrees);
            let mut albedo = Spectrum::ZERO;
            const N: u32 = 100_000;
            for i in 0..N {
                let (u_lobe, u) = numbers(7, i);
                let Some(s) = bsdf.sample(wo, u_lobe, u, TransportMode::Importance) else {
                    continue;
                };
                albedo += s.weight * (1.0 / N as f32);
                if !s.is_delta() {
                    let (f, back) = (bsdf.eval(wo, s.wi).to_array(), bsdf.eval(s.wi, wo).to_array());
                    for c in 0..3 {
                        assert!(
                            (f[c] - back[c]).abs() <= 2e-3 * f[c].max(back[c]),
                            "{name}: {f:?} {back:?}"
                        );
                    }
                }
            }
            assert!(albedo.max_component() <= 1.005, "{name} {degrees}°: albedo {albedo:?}");
        }
    }
}

/// ∫ f cos θ dω by the midpoint rule in f64, of an independent statement of the formula.
fn phong_albedo(n: f64, degrees: f64) -> f64 {
    const STEPS: usize = 1000;
    let (sin_o, cos_o) = degrees.to_radians().sin_cos();
    let mut sum = 0.0;
    for i in 0..STEPS {
        // Uniform in cos θ
        let z = (i as f64 + 0.5) / STEPS as f64;
        let r = (1.0 - z * z).sqrt();
        for j in 0..STEPS {
            let phi = (j as f64 + 0.5) / STEPS as f64 * std::f64::consts::TAU;
            let cos_alpha = -sin_o * r * phi.cos() + cos_o * z;
            sum += cos_alpha.max(0.0).powf(n) * z;
        }
    }
    (n + 2.0) * sum / (STEPS * STEPS) as f64
}

#[test]
fn phong_reflects_what_quadrature_says() {
    for (degrees, expected) in [(0.0, 1.0), (45.0, 0.7074), (75.0, 0.2919)] {
        let quadrature = phong_albedo(10.0, degrees);
        assert!((quadrature - expected).abs() < 5e-4, "{degrees}°: {quadrature}");
        let lobe = Phong {
            reflectance: Spectrum::ONE,
            exponent: 10.0,
        };
        let n = SAMPLES;
        let weights = (0..n).filter_map(|i| lobe.sample(incident(degrees as f32), numbers(3, i).1));
        let albedo = weights.map(|s| s.weight.max_component() as f64).sum::<f64>() / n as f64;
        assert!((albedo / expected - 1.0).abs() < 5e-3, "{degrees}°: {albedo}");
    }
}

#[test]
fn dielectrics_share_out_all_the_light() {
    let glass = Dielectric {
        reflectance: Spectrum::ONE,
        transmittance: Spectrum::ONE,
        ior: 1.5,
    };
    for degrees in [0.0, 30.0, 45.0, 60.0, 80.0f32] {
        for side in [1.0, -1.0] {
            let wo = incident(degrees) * Vec3::new(1.0, 1.0, side);
            let flux = |mode| {
                let samples = glass.directions(wo, mode).into_iter().flatten();
                samples
                    .map(|s| (s, (s.f * s.wi.z.abs()).max_component()))
                    .collect::<Vec<_>>()
            };
            let total: f32 = flux(TransportMode::Importance).iter().map(|(_, f)| f).sum();
            assert!((total - 1.0).abs() < 1e-5, "{degrees}° {side}: {total}");
            // Snell's law, and radiance that scales by 1/η² on its way to the camera
            let importance = flux(TransportMode::Importance);
            for ((s, f), (_, plain)) in flux(TransportMode::Radiance).into_iter().zip(importance) {
                assert!((s.wi.length() - 1.0).abs() < 1e-5);
                let eta = if s.wi.z * wo.z > 0.0 {
                    1.0
                } else if side > 0.0 {
                    1.5
                } else {
                    1.0 / 1.5
                };
                assert!((s.eta - eta).abs() < 1e-6 && (f * eta * eta - plain).abs() < 1e-5);
                let sine = |w: Vec3| w.x.hypot(w.y);
                assert!((sine(wo) - eta * sine(s.wi)).abs() < 1e-5);
            }
        }
    }
    // Total reflection from inside at 45°
    let inside = glass.directions(incident(45.0) * Vec3::new(1.0, 1.0, -1.0), TransportMode::Radiance);
    assert!(inside[1].is_none() && inside[0].is_some_and(|s| s.pdf == 1.0));
}

#[test]
fn thin_sheets_add_up_their_reflections() {
    for degrees in INCIDENCES {
        let wo = incident(degrees);
        let sheet = |ior| ThinSheet {
            reflectance: Spectrum::ONE,
            transmittance: Spectrum::ONE,
            ior,
        };
        // The series R + T R T + T R³ T + …, summed by hand
        let glass = Dielectric {
            reflectance: Spectrum::ONE,
            transmittance: Spectrum::ONE,
            ior: 1.5,
        };
        let r = glass.directions(wo, TransportMode::Importance)[0].unwrap().pdf as f64;
        let series = r + (0..50).map(|k| (1.0 - r).powi(2) * r.powi(2 * k + 1)).sum::<f64>();
        let [reflected, passed] = sheet(1.5).directions(wo);
        let (reflected, passed) = (reflected.unwrap(), passed.unwrap());
        assert!((reflected.pdf as f64 - series).abs() < 1e-6, "{degrees}°");
        assert!((reflected.pdf + passed.pdf - 1.0).abs() < 1e-6 && passed.wi == -wo);
        // A veil
        assert!(sheet(1.0).directions(wo)[0].is_none());
    }
}
