//! Lobes and mixtures: samples against densities, energy, reciprocity.

use crate::chi_square::{chi_square, sidak};
#[cfg(any(feature = "embree", feature = "obvhs"))]
use crate::support::statistics::{Mean, assert_means_within, assert_same_mean};
use embrasure::bsdf::*;
use embrasure::color::Spectrum;
use embrasure::material::{Gloss, Material};
use embrasure::math::{Vec2, Vec3};
use embrasure::sampler::{
    Bounce, CubePoints, Dimension, Fibonacci, Independent, Perturbation, PerturbedQmc, SampleKey, Sampler, SamplerKind,
};
use embrasure::sampling::warp::{
    UNIFORM_HEMISPHERE_PDF, cosine_hemisphere_of_sphere, cosine_hemisphere_pdf, uniform_hemisphere_of_sphere,
};

/// Number of samples for each lobe and angle of incidence. [`wrong_densities_fail_the_test`] has
/// the wrong densities that this number reveals. A wrong scale of a density changes its integral,
/// which is checked to 0.4 %.
const SAMPLES: u32 = 300_000;
const INCIDENCES: [f32; 4] = [0.0, 30.0, 60.0, 80.0];
const EXPONENTS: [f32; 4] = [1.0, 10.0, 100.0, 1000.0];
const GOLD: Fresnel = Fresnel::Conductor {
    eta: [0.14, 0.37, 1.44],
    k: [3.98, 2.39, 1.60],
};

/// Random numbers `index`: one for the lobe, a pair for the direction.
fn numbers(seed: u64, index: u32) -> (f32, Vec2) {
    let mut sampler = Independent::new(seed);
    sampler.start(SampleKey::new(0, 0, index));
    let dimension = |what| Dimension::bounce(0, what);
    (
        sampler.get_1d(dimension(Bounce::Lobe)),
        sampler.get_2d(dimension(Bounce::Direction)),
    )
}

/// Direction at `degrees` from the normal.
fn incident(degrees: f32) -> Vec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    Vec3::new(0.8 * sin, -0.6 * sin, cos)
}

fn grey(value: f32) -> Spectrum {
    Spectrum::splat(value)
}

/// All lobes except GGX, and all kinds of mixtures.
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

/// All GGX lobes, and mixtures of them.
fn rough_bsdfs() -> Vec<(String, Bsdf)> {
    let brown = Spectrum::rgb(0.5, 0.3, 0.1);
    let models = [
        ("plastic", Material::metallic_roughness(brown, 0.0, 0.3)),
        ("half a metal", Material::metallic_roughness(brown, 0.5, 0.6)),
        (
            "diffuse + ggx + rough glass",
            Material {
                diffuse: brown,
                specular: grey(0.2),
                gloss: Gloss::Ggx(GOLD),
                roughness: 0.3,
                transmission: grey(0.3),
                ..Material::default()
            },
        ),
    ];
    let models = models.map(|(name, material)| (name.to_string(), material.bsdf()));
    let lobes = rough_lobes().map(|(name, lobe)| (name, Bsdf::Single(lobe)));
    lobes.chain(models).collect()
}

/// A sheen, and coats and sheens over all kinds of bases.
fn layered_bsdfs() -> Vec<(String, Bsdf)> {
    let brown = Spectrum::rgb(0.5, 0.3, 0.1);
    let lacquer = Material {
        diffuse: grey(0.8),
        clearcoat: 1.0,
        clearcoat_roughness: 0.5,
        ..Material::default()
    };
    let smooth = Material {
        clearcoat: 0.5,
        ..Material::metallic_roughness(brown, 0.5, 0.6)
    };
    let velvet = Material {
        anisotropy: 0.8,
        anisotropy_rotation: 40.0,
        sheen: Spectrum::rgb(0.9, 0.5, 0.2),
        ..Material::metallic_roughness(brown, 1.0, 0.5)
    };
    let all = Material {
        diffuse: brown,
        specular: grey(0.2),
        gloss: Gloss::Phong(20.0),
        roughness: 0.3,
        transmission: grey(0.3),
        clearcoat: 0.7,
        clearcoat_roughness: 0.4,
        sheen: grey(0.5),
        ..Material::default()
    };
    let models = [
        ("coat over lambert", lacquer),
        ("smooth coat over half a metal", smooth),
        ("sheen over a brushed metal", velvet),
        ("coat over sheen over phong and rough glass", all),
    ];
    let models = models.map(|(name, material)| (name.to_string(), material.bsdf()));
    let sheen = Sheen { color: grey(1.0) };
    let sheen = ("sheen".to_string(), Bsdf::Single(Lobe::Sheen(sheen)));
    models.into_iter().chain([sheen]).collect()
}

/// All GGX lobes.
fn rough_lobes() -> impl Iterator<Item = (String, Lobe)> {
    let schlick = Fresnel::Schlick { f0: [0.04, 0.5, 0.9] };
    let mirrors = [
        ([0.01, 0.01], GOLD),
        ([0.2, 0.2], schlick),
        ([1.0, 1.0], Fresnel::Full),
        ([0.1, 0.4], Fresnel::Full),
    ];
    let mirrors = mirrors.map(|(alpha, fresnel)| {
        let lobe = RoughConductor::new(grey(1.0), alpha.into(), fresnel);
        (
            format!("rough conductor {alpha:?} {fresnel:?}"),
            Lobe::RoughConductor(lobe),
        )
    });
    let glasses = [([0.04, 0.04], 0.7), ([1.0, 1.0], 2.0), ([0.5, 0.2], 1.5)];
    let glasses = glasses.map(|(alpha, ior)| {
        let lobe = RoughDielectric::new(grey(1.0), grey(1.0), alpha.into(), ior);
        (format!("rough glass {alpha:?} {ior}"), Lobe::RoughDielectric(lobe))
    });
    let coated = CoatedLambert::new(grey(1.0), 0.3, 0.04);
    let coated = ("coated lambert".to_string(), Lobe::CoatedLambert(coated));
    mirrors.into_iter().chain(glasses).chain([coated])
}

#[test]
fn samples_follow_their_densities() {
    compare_samples_with_densities(&bsdfs(), &INCIDENCES);
}

#[test]
fn rough_samples_follow_their_densities() {
    let bsdfs: Vec<_> = rough_bsdfs().into_iter().filter(|bsdf| !has_edges(bsdf)).collect();
    compare_samples_with_densities(&bsdfs, &[30.0, 80.0]);
}

#[test]
fn rough_glass_samples_follow_their_densities() {
    let bsdfs: Vec<_> = rough_bsdfs().into_iter().filter(has_edges).collect();
    // Quadrature over edges takes long.
    let incidences = if cfg!(long) { &[30.0, 80.0][..] } else { &[30.0] };
    compare_samples_with_densities(&bsdfs, incidences);
}

/// Returns true if the density is discontinuous within a hemisphere: refraction ends at directions
/// that need microfacets at 90° to the normal. The mixtures of these tests select rough glass with
/// a low probability.
fn has_edges((name, _): &(String, Bsdf)) -> bool {
    name.starts_with("rough glass")
}

#[test]
fn layered_samples_follow_their_densities() {
    compare_samples_with_densities(&layered_bsdfs(), &[30.0, 80.0]);
}

fn compare_samples_with_densities(bsdfs: &[(String, Bsdf)], incidences: &[f32]) {
    let level = sidak(0.01, bsdfs.len() * incidences.len());
    for (seed, named) in bsdfs.iter().enumerate() {
        let (name, bsdf) = named;
        for &degrees in incidences {
            // Some samples come from behind, because lobes scatter in the same way on both sides.
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
            let outcome = chi_square(
                crate::support::budget(SAMPLES),
                sample,
                |wi| bsdf.pdf(wo, wi) as f64,
                has_edges(named),
            );
            // The error of the fraction from all samples is at most 0.0009.
            let error = (outcome.integral - outcome.share).abs();
            assert!(
                error < 4e-3 * crate::support::slack(),
                "{name} {degrees}°: ∫pdf {} but {} of the samples",
                outcome.integral,
                outcome.share
            );
            assert!(outcome.p_value > level, "{name} {degrees}°: {outcome:?}, level {level}");
        }
    }
}

/// Points of one spherical set depend on each other. But each single point, mapped to a hemisphere,
/// has the density of the mapping. This test therefore takes its directions from different sets, at
/// any index of a set.
#[test]
fn sphere_points_follow_the_density_of_their_warp() {
    fn check(what: &str, mut sampler: impl Sampler) {
        let mut directions = |warp: fn(Vec2) -> Vec3, pdf: &dyn Fn(Vec3) -> f32| {
            let direction = |i| {
                sampler.start(SampleKey::new(i, i / 1000, i % 100));
                Some(warp(sampler.get_2d(Dimension::bounce(1, Bounce::Direction))))
            };
            let outcome = chi_square(crate::support::budget(SAMPLES), direction, |wi| pdf(wi) as f64, false);
            assert!(outcome.p_value > sidak(0.01, 2 * 12), "{what}: {outcome:?}");
        };
        directions(cosine_hemisphere_of_sphere, &|wi| cosine_hemisphere_pdf(wi.z));
        let upper = |wi: Vec3| if wi.z > 0.0 { UNIFORM_HEMISPHERE_PDF } else { 0.0 };
        directions(uniform_hemisphere_of_sphere, &upper);
    }
    for (seed, count) in [(1, 16), (2, 64), (3, 1024)] {
        let others = SamplerKind::Sobol.with_seed(seed, count);
        check("fibonacci", Fibonacci::new(seed, count, others));
        for points in [CubePoints::Halton, CubePoints::Hammersley, CubePoints::Sobol] {
            let options = Perturbation {
                points,
                size: 1.0,
                is_scrambled: true,
            };
            let what = format!("{points:?}, {count}");
            check(&what, PerturbedQmc::new(seed, count, options, others));
        }
    }
}

/// Negative control of the tests above: wrong scale, wrong shape, a slightly too wide lobe, lost
/// samples.
#[test]
fn wrong_densities_fail_the_test() {
    let wo = incident(60.0);
    let phong = |exponent| {
        Lobe::Phong(Phong {
            reflectance: Spectrum::ONE,
            exponent,
        })
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
    assert!(p(&cosine, &|wi| 1.07 * lambert.pdf(wo, wi)) < 1e-6);
    assert!(p(&cosine, &|wi| if wi.z > 0.0 { 0.5 / std::f32::consts::PI } else { 0.0 }) < 1e-6);
    assert!(
        p(&|u| phong(100.0).sample(wo, 0.0, u, TransportMode::Radiance), &|wi| {
            phong(103.0).pdf(wo, wi)
        }) < 1e-6
    );
    let lossy = |u: Vec2| cosine(u).filter(|s| s.wi.x < 0.99);
    assert!(p(&|u| lossy(u).filter(|_| u.x > 0.01), &|wi| lambert.pdf(wo, wi)) < 1e-6);
}

/// Radiance divided by the squared index is the same in both directions (Veach 1997, eq. 5.14).
#[test]
fn lobes_are_reciprocal() {
    for (name, bsdf) in bsdfs().into_iter().chain(rough_bsdfs()).chain(layered_bsdfs()) {
        for degrees in INCIDENCES {
            let wo = incident(degrees);
            for i in 0..2000 {
                let (u_lobe, u) = numbers(7, i);
                let Some(s) = bsdf.sample(wo, u_lobe, u, TransportMode::Importance) else {
                    continue;
                };
                if s.is_delta() {
                    continue;
                }
                let f = (bsdf.eval(wo, s.wi) * (s.eta * s.eta)).to_array();
                let back = bsdf.eval(s.wi, wo).to_array();
                let drawn = s.f.to_array();
                for c in 0..3 {
                    let min = f[c].min(back[c]).min(drawn[c]);
                    let max = f[c].max(back[c]).max(drawn[c]);
                    assert!(max - min <= 2e-3 * max, "{name}: {f:?} {back:?} {drawn:?}");
                }
            }
        }
    }
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn lobes_reflect_at_most_all_light() {
    for (name, bsdf) in bsdfs().into_iter().chain(rough_bsdfs()).chain(layered_bsdfs()) {
        for degrees in INCIDENCES {
            let wo = incident(degrees);
            const N: u32 = 100_000;
            let weights = (0..N).filter_map(|i| {
                let (u_lobe, u) = numbers(7, i);
                Some(bsdf.sample(wo, u_lobe, u, TransportMode::Importance)?.weight)
            });
            let albedo = weights.fold(Spectrum::ZERO, |sum, weight| sum + weight * (1.0 / N as f32));
            assert!(albedo.max_component() <= 1.005, "{name} {degrees}°: albedo {albedo:?}");
        }
    }
}

/// Metals, dielectrics, glass and coats, smooth and rough.
fn fresnel_bsdfs() -> Vec<(String, Bsdf)> {
    let copper = Fresnel::Conductor {
        eta: [0.21, 1.1, 1.2],
        k: [3.6, 2.6, 2.3],
    };
    let terms = [
        ("gold", GOLD),
        ("copper", copper),
        ("dielectric", Fresnel::Dielectric { eta: 1.5 }),
    ];
    let white = Material {
        specular: grey(1.0),
        ..Material::default()
    };
    let mut all = Vec::new();
    for (name, fresnel) in terms {
        let mirror = Material {
            gloss: Gloss::Mirror(fresnel),
            ..white.clone()
        };
        all.push((format!("mirror {name}"), mirror));
        for roughness in [0.1, 0.3, 0.6, 1.0] {
            let facets = Material {
                gloss: Gloss::Ggx(fresnel),
                roughness,
                ..white.clone()
            };
            all.push((format!("ggx {name} {roughness}"), facets));
        }
    }
    let green = Spectrum::rgb(0.2, 0.9, 0.4);
    for (roughness, thin) in [(0.0, false), (0.0, true), (0.3, false), (0.7, false)] {
        let glass = Material {
            transmission: green,
            roughness,
            thin,
            ..Material::default()
        };
        all.push((format!("glass {roughness} {thin}"), glass));
    }
    for clearcoat_roughness in [0.0, 0.3] {
        let coated = Material {
            diffuse: Spectrum::rgb(0.2, 0.5, 0.9),
            clearcoat: 1.0,
            clearcoat_roughness,
            ..Material::default()
        };
        all.push((format!("coat {clearcoat_roughness} over lambert"), coated));
        let glass = Material {
            transmission: green,
            clearcoat: 1.0,
            clearcoat_roughness,
            ..Material::default()
        };
        all.push((format!("coat {clearcoat_roughness} over glass"), glass));
    }
    all.into_iter().map(|(name, m)| (name, m.bsdf())).collect()
}

/// The directional albedo equals the radiance in a white furnace, which is the mean weight of
/// samples. The standard error of this mean is below 0.002.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn directional_albedo_equals_white_furnace() {
    let all = bsdfs().into_iter().chain(rough_bsdfs()).chain(layered_bsdfs());
    for (name, bsdf) in all.chain(fresnel_bsdfs()) {
        for (side, degrees) in [1.0, -1.0].into_iter().flat_map(|s| INCIDENCES.map(|d| (s, d))) {
            let wo = incident(degrees) * Vec3::new(1.0, 1.0, side);
            let n = crate::support::budget(SAMPLES);
            let weights = (0..n).filter_map(|i| {
                let (u_lobe, u) = numbers(11, i);
                bsdf.sample(wo, u_lobe, u, TransportMode::Importance)
            });
            let furnace = weights.fold(Spectrum::ZERO, |sum, s| sum + s.weight) / n as f32;
            let albedo = bsdf.directional_albedo(wo);
            // Anisotropic microfacets lose light. The tables are for isotropic microfacets, so they
            // do not correct this loss. Lobes below a rough layer also lose light.
            let is_anisotropic = ["[0.1, 0.4]", "[0.5, 0.2]", "brushed"]
                .iter()
                .any(|part| name.contains(part));
            let tolerance = match (is_anisotropic, &bsdf) {
                (true, _) => 0.08,
                (false, Bsdf::Layered(_)) => 0.025,
                _ => 0.012,
            };
            let error = (albedo - furnace)
                .to_array()
                .map(f32::abs)
                .into_iter()
                .fold(0.0, f32::max);
            assert!(error < tolerance, "{name} {degrees}°: {albedo:?}, furnace {furnace:?}");
        }
    }
}

/// ∫ f cos θ dω by the midpoint rule in f64, with an independent form of the formula.
fn phong_albedo(n: f64, degrees: f64) -> f64 {
    const STEPS: usize = 1000;
    let (sin_o, cos_o) = degrees.to_radians().sin_cos();
    let mut sum = 0.0;
    for i in 0..STEPS {
        // Directions are uniform in cos θ
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
fn phong_albedo_matches_quadrature() {
    for (degrees, expected) in [(0.0, 1.0), (45.0, 0.7074), (75.0, 0.2919)] {
        let quadrature = phong_albedo(10.0, degrees);
        assert!((quadrature - expected).abs() < 5e-4, "{degrees}°: {quadrature}");
        let lobe = Lobe::Phong(Phong {
            reflectance: Spectrum::ONE,
            exponent: 10.0,
        });
        let (n, wo, mode) = (1_000_000, incident(degrees as f32), TransportMode::Radiance);
        let weights = (0..n).filter_map(|i| lobe.sample(wo, 0.0, numbers(3, i).1, mode));
        let albedo = weights.map(|s| s.weight.max_component() as f64).sum::<f64>() / n as f64;
        assert!((albedo / expected - 1.0).abs() < 5e-3, "{degrees}°: {albedo}");
    }
}

#[test]
fn dielectrics_conserve_energy() {
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
            // Snell's law, and radiance that scales by 1/η² towards the camera
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
    // From inside, at 45°, all light is reflected
    let inside = glass.directions(incident(45.0) * Vec3::new(1.0, 1.0, -1.0), TransportMode::Radiance);
    assert!(inside[1].is_none() && inside[0].is_some_and(|s| s.pdf == 1.0));
}

#[test]
fn thin_dielectric_sums_internal_reflections() {
    for degrees in INCIDENCES {
        let wo = incident(degrees);
        let sheet = |ior| ThinDielectric {
            reflectance: Spectrum::ONE,
            transmittance: Spectrum::ONE,
            ior,
        };
        // Sum the series R + T R T + T R³ T + … directly
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
        // With index 1, no light is reflected
        assert!(sheet(1.0).directions(wo)[0].is_none());
    }
}

/// Point `i` of the Kronecker sequence in the unit cube. The steps are powers of 1/x, where x⁴ = x
/// + 1.
fn even_numbers(i: u32) -> (f32, Vec2) {
    let step = |power: i32| ((i as f64 + 0.5) * 1.220_744_084_605_759_5f64.powi(-power)).fract() as f32;
    (step(1).min(0.999_999_9), Vec2::new(step(2), step(3)))
}

/// Albedo for `wo`, for each channel.
fn scattered(lobes: &[Lobe], wo: Vec3) -> [f64; 3] {
    const N: u32 = 1 << 14;
    let mut sum = [0.0; 3];
    for lobe in lobes {
        for i in 0..N {
            let (u_lobe, u) = even_numbers(i);
            if let Some(s) = lobe.sample(wo, u_lobe, u, TransportMode::Importance) {
                let weight = s.weight.to_array();
                sum = [0, 1, 2].map(|c| sum[c] + weight[c] as f64 / N as f64);
            }
        }
    }
    sum
}

const ROUGHNESSES: [f32; 7] = [0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0];
const ANGLES: [f32; 7] = [0.0, 20.0, 40.0, 60.0, 70.0, 80.0, 85.0];

#[test]
fn rough_conductors_reflect_all_light() {
    let mut worst = 0f64;
    for roughness in ROUGHNESSES {
        for degrees in ANGLES {
            let alpha = Vec2::splat(roughness * roughness);
            let lobe = Lobe::RoughConductor(RoughConductor::new(grey(1.0), alpha, Fresnel::Full));
            let [share, ..] = scattered(&[lobe], incident(degrees));
            worst = worst.max((share - 1.0).abs());
            assert!((share - 1.0).abs() < 5e-3, "{roughness} {degrees}°: {share}");
        }
    }
    eprintln!("rough conductors: off by {worst:.4} at most");
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn rough_dielectrics_conserve_energy() {
    let mut worst = 0f64;
    for ior in [0.6, 1.3, 1.5, 1.77, 2.0] {
        for roughness in ROUGHNESSES {
            for degrees in ANGLES {
                for side in [1.0, -1.0] {
                    let alpha = Vec2::splat(roughness * roughness);
                    let lobe = Lobe::RoughDielectric(RoughDielectric::new(grey(1.0), grey(1.0), alpha, ior));
                    let [share, ..] = scattered(&[lobe], incident(degrees) * Vec3::new(1.0, 1.0, side));
                    worst = worst.max((share - 1.0).abs());
                    assert!(
                        (share - 1.0).abs() < 1e-2,
                        "{ior} {roughness} {degrees}° {side}: {share}"
                    );
                }
            }
        }
    }
    eprintln!("rough dielectrics: off by {worst:.4} at most");
}

/// A white base scatters all light that its coat transmits, for any roughness, and a white metal
/// reflects all light.
#[test]
fn metallic_roughness_keeps_energy() {
    let mut worst = 0f64;
    for roughness in ROUGHNESSES.into_iter().chain([0.0]) {
        for degrees in ANGLES {
            for metallic in [0.0, 0.5, 1.0] {
                let bsdf = Material::metallic_roughness(grey(1.0), metallic, roughness).bsdf();
                let lobes: Vec<Lobe> = bsdf.lobes().copied().collect();
                let [share, ..] = scattered(&lobes, incident(degrees));
                worst = worst.max((share - 1.0).abs());
                assert!((share - 1.0).abs() < 5e-3, "{metallic} {roughness} {degrees}°: {share}");
            }
        }
    }
    eprintln!("metallic-roughness: off by {worst:.4} at most");
}

/// Albedo for `wo`, in the brightest channel.
fn scattered_by(bsdf: &Bsdf, wo: Vec3) -> f64 {
    const N: u32 = 1 << 14;
    let samples = (0..N).map(even_numbers);
    let weights = samples.filter_map(|(u_lobe, u)| bsdf.sample(wo, u_lobe, u, TransportMode::Importance));
    let sum = weights.fold(Spectrum::ZERO, |sum, s| sum + s.weight * (1.0 / N as f32));
    sum.max_component() as f64
}

/// Minimum and maximum albedo of a white base under layers, for all roughnesses of the coat and all
/// angles.
fn under_layers(base: &Material, layers: &[(f32, f32)]) -> (f64, f64) {
    let (mut min, mut max) = (2f64, 0f64);
    for &(clearcoat, sheen) in layers {
        for clearcoat_roughness in [0.0, 0.3, 1.0] {
            for degrees in ANGLES {
                let layered = Material {
                    clearcoat,
                    clearcoat_roughness,
                    sheen: grey(sheen),
                    ..base.clone()
                };
                let share = scattered_by(&layered.bsdf(), incident(degrees));
                assert!(share.is_finite(), "{clearcoat_roughness} {degrees}°: {share}");
                (min, max) = (min.min(share), max.max(share));
            }
        }
    }
    (min, max)
}

/// Light that a coat or a sheen reflects does not reach the base. White therefore stays white,
/// exactly if the base is matte. A glossy lobe loses light if it scatters from directions of high
/// transmittance to directions of low transmittance. Wide lobes lose more light.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn layers_over_a_white_base_conserve_energy() {
    let matte = Material {
        diffuse: grey(1.0),
        ..Material::default()
    };
    let metal = |roughness| Material::metallic_roughness(grey(1.0), 1.0, roughness);
    let plastic = Material::metallic_roughness(grey(1.0), 0.0, 0.4);
    let mut wrong = Vec::new();
    for (name, base, losses) in [
        ("matte", matte, [0.01, 0.01, 0.03]),
        ("plastic", plastic, [0.02, 0.02, 0.04]),
        ("mirror", metal(0.0), [0.01, 0.01, 0.03]),
        ("metal of roughness 0.3", metal(0.3), [0.06, 0.05, 0.09]),
        ("metal of roughness 0.6", metal(0.6), [0.06, 0.11, 0.13]),
        ("metal of roughness 1", metal(1.0), [0.05, 0.14, 0.16]),
    ] {
        let layers = [
            ("a coat", &[(1.0, 0.0), (0.5, 0.0)][..]),
            ("a sheen", &[(0.0, 1.0)]),
            ("both", &[(1.0, 1.0)]),
        ];
        for ((what, layers), loss) in layers.into_iter().zip(losses) {
            let (min, max) = under_layers(&base, layers);
            eprintln!("{name} under {what}: {min:.4} to {max:.4}");
            // The tolerance allows for errors of the tables and of 2¹⁴ samples.
            if max > 1.01 || min < 1.0 - loss {
                wrong.push((name, what, min, max));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// The tangent of a material with a rotation of 30°. The rotation starts from ∂p/∂u, if ∂p/∂u
/// exists.
#[test]
fn anisotropy_follows_texture_coordinates() {
    use embrasure::geometry::{GeomId, Hit, InstanceId, Mesh, PrimId};
    let quad = crate::support::polygon(&[
        Vec3::ZERO,
        Vec3::X,
        Vec3::new(1.0, 0.0, -2.0),
        Vec3::new(0.0, 0.0, -2.0),
    ]);
    let uvs = vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let brushed = Material {
        anisotropy: 0.5,
        anisotropy_rotation: 30.0,
        ..Material::metallic_roughness(grey(0.9), 1.0, 0.5)
    };
    let tangent = |uvs: Vec<Vec2>, material: &Material| {
        let mut b = embrasure::scene::SceneBuilder::new();
        crate::support::add(&mut b, Mesh { uvs, ..quad.clone() }, material.clone());
        let scene = b.build().unwrap().0;
        let hit = Hit {
            t: 1.0,
            b1: 0.2,
            b2: 0.3,
            prim: PrimId(1),
            geom: GeomId(0),
            inst: InstanceId::NONE,
        };
        let point = scene.surface_point(&hit, 0.0);
        scene.frame(&hit, &point).to_world(Vec3::X)
    };
    // Rotated about +y, x moves towards −z.
    let (sin, cos) = 30f32.to_radians().sin_cos();
    assert!(tangent(uvs.clone(), &brushed).distance(Vec3::new(cos, 0.0, -sin)) < 1e-6);
    let turned = uvs.iter().map(|uv| Vec2::new(uv.y, -uv.x)).collect();
    assert!(tangent(turned, &brushed).distance(Vec3::new(-sin, 0.0, -cos)) < 1e-6);
    // Any tangent is valid without texture coordinates, or without anisotropy.
    let any = embrasure::math::Frame::from_z(Vec3::Y).to_world(Vec3::X);
    assert_eq!(tangent(Vec::new(), &brushed), any);
    let round = Material {
        anisotropy: 0.0,
        ..brushed
    };
    assert_eq!(tangent(uvs, &round), any);
}

/// A highlight is longer along the tangent, in the direction of the larger slopes.
#[test]
fn highlights_are_longer_along_the_tangent() {
    let brushed = Material {
        anisotropy: 0.9,
        ..Material::metallic_roughness(grey(1.0), 1.0, 0.3)
    };
    let bsdf = brushed.bsdf();
    let mut squares = Vec3::ZERO;
    const N: u32 = 1 << 14;
    for (u_lobe, u) in (0..N).map(even_numbers) {
        if let Some(s) = bsdf.sample(Vec3::Z, u_lobe, u, TransportMode::Radiance) {
            squares += s.wi * s.wi;
        }
    }
    let ratio = (squares.x / squares.y).sqrt();
    // The ratio of slopes is 1 / (1 − 0.9²) = 5.3. In a wide lobe, the sine of the angle grows less
    // than the slope.
    assert!((2.0..5.3).contains(&ratio), "{ratio}");
}

/// A patch with a tilted shading normal scatters flux from all directions to all others. Paths from
/// the camera and paths from the light find the same flux.
#[test]
fn adjoint_factor_makes_both_directions_agree() {
    use embrasure::geometry::SurfacePoint;
    use embrasure::math::Frame;
    let ns = Vec3::new(0.4, -0.3, 0.8).normalize();
    let point = SurfacePoint {
        p: Vec3::ZERO,
        ray_offset: 0.0,
        curvature_offset: [0.0; 2],
        ng: Vec3::Z,
        ns,
        time: 0.0,
    };
    let frame = Frame::from_z(ns);
    // Sensitivity and emission: two different functions of the direction
    let seen = |w: Vec3| f64::from(1.5 + w.x + w.x * w.y);
    let lit = |w: Vec3| f64::from((1.0 - w.x + 2.0 * w.y).powi(2));
    let is_above = |w: Vec3| w.z > 1e-3 && w.dot(ns) > 1e-3;
    let bsdfs = [
        Bsdf::Single(Lobe::Lambert(Lambert { albedo: grey(0.8) })),
        Material::metallic_roughness(grey(0.8), 0.5, 0.5).bsdf(),
    ];
    for bsdf in bsdfs {
        // The first direction is sampled by the geometric cosine, which the flux of the patch
        // contains. The second direction is sampled from the BSDF about the shading normal.
        let mean = |from_light: bool, is_corrected: bool| {
            let mut sum = 0.0;
            for i in 0..SAMPLES {
                let first = embrasure::sampling::warp::cosine_hemisphere(numbers(21, i).1);
                let (u_lobe, u) = numbers(22, i);
                let mode = match from_light {
                    true => TransportMode::Importance,
                    false => TransportMode::Radiance,
                };
                let Some(s) = bsdf.sample(frame.to_local(first), u_lobe, u, mode) else {
                    continue;
                };
                let second = frame.to_world(s.wi);
                if !is_above(first) || !is_above(second) {
                    continue;
                }
                let factor = if is_corrected {
                    point.adjoint_factor(first, second)
                } else {
                    1.0
                };
                let (wo, wi) = if from_light { (second, first) } else { (first, second) };
                sum += seen(wo) * lit(wi) * (s.weight.max_component() * factor) as f64;
            }
            sum / SAMPLES as f64
        };
        let (camera, light, wrong) = (mean(false, false), mean(true, true), mean(true, false));
        eprintln!("{camera:.4} from the camera, {light:.4} from the light, {wrong:.4} without the factor");
        assert!((light / camera - 1.0).abs() < 0.01, "{camera} {light}");
        assert!((wrong / camera - 1.0).abs() > 0.05, "{camera} {wrong}");
    }
    // If the shading normal equals the geometric normal, the factor is 1.
    let flat = SurfacePoint { ns: Vec3::Z, ..point };
    let (wo, wi) = (incident(30.0), incident(70.0));
    assert!((flat.adjoint_factor(wo, wi) - 1.0).abs() < 1e-6);
    assert_eq!(point.adjoint_factor(Vec3::X, wi), 0.0);
}

/// Mirrors with anisotropic microfacets lose some energy, and gain a little at grazing angles.
#[test]
fn brushed_mirrors_keep_most_energy() {
    let (mut max, mut min) = (0f64, 2f64);
    for alpha in [[0.05, 0.2], [0.1, 0.4], [0.5, 0.05], [1.0, 0.3]] {
        for degrees in ANGLES {
            for turn in [0.0, 30.0, 60.0, 90.0f32] {
                let (sin, cos) = degrees.to_radians().sin_cos();
                let (y, x) = turn.to_radians().sin_cos();
                let lobe = Lobe::RoughConductor(RoughConductor::new(grey(1.0), alpha.into(), Fresnel::Full));
                let [share, ..] = scattered(&[lobe], Vec3::new(sin * x, sin * y, cos));
                assert!(share.is_finite(), "{alpha:?} {degrees}° {turn}°: {share}");
                (max, min) = (max.max(share), min.min(share));
            }
        }
    }
    eprintln!("brushed mirrors: {min:.4} to {max:.4}");
    assert!(max < 1.035 && min > 0.75, "{min} {max}");
}

/// Compares the lobe with f64 values from another form of the formulas. Sums over the hemisphere
/// give the multiple reflections.
#[test]
fn rough_conductor_matches_quadrature() {
    const STEPS: usize = 400;
    let f = |cos: f64| 0.2 + 0.8 * (1.0 - cos).powi(5);
    let mean_f = (20.0 * 0.2 + 1.0) / 21.0;
    for alpha in [0.25, 0.64, 1.0] {
        let lambda = |cos: f64| 0.5 * ((1.0 + alpha * alpha * (1.0 / (cos * cos) - 1.0)).sqrt() - 1.0);
        let single = |wo: [f64; 3], wi: [f64; 3], fresnel: &dyn Fn(f64) -> f64| {
            let h = [0, 1, 2].map(|k| wo[k] + wi[k]);
            let length = h.iter().map(|x| x * x).sum::<f64>().sqrt();
            let cos_h = h[2] / length;
            let d = alpha * alpha / (std::f64::consts::PI * (cos_h * cos_h * (alpha * alpha - 1.0) + 1.0).powi(2));
            let g = 1.0 / (1.0 + lambda(wo[2]) + lambda(wi[2]));
            d * g * fresnel(0.5 * length) / (4.0 * wo[2] * wi[2])
        };
        let direction = |cos: f64, phi: f64| {
            let sin = (1.0 - cos * cos).sqrt();
            [sin * phi.cos(), sin * phi.sin(), cos]
        };
        let albedo = |cos_o: f64| {
            let mut sum = 0.0;
            for i in 0..STEPS {
                let z = (i as f64 + 0.5) / STEPS as f64;
                for j in 0..STEPS / 4 {
                    let phi = std::f64::consts::PI * (j as f64 + 0.5) / (STEPS / 4) as f64;
                    sum += single(direction(cos_o, 0.0), direction(z, phi), &|_| 1.0) * z;
                }
            }
            8.0 * std::f64::consts::PI * sum / (STEPS * STEPS) as f64
        };
        let mean = (0..50)
            .map(|i| (i as f64 + 0.5) / 50.0)
            .map(|z| 2.0 * z * albedo(z))
            .sum::<f64>()
            / 50.0;
        let several = mean_f * mean_f * mean / (1.0 - mean_f * (1.0 - mean)) / (std::f64::consts::PI * (1.0 - mean));

        let fresnel = Fresnel::Schlick { f0: [0.2; 3] };
        let lobe = Lobe::RoughConductor(RoughConductor::new(grey(1.0), Vec2::splat(alpha as f32), fresnel));
        for (cos_o, cos_i, phi) in [
            (0.9, 0.8, 3.0),
            (0.5, 0.5, 1.0),
            (0.2, 0.7, 2.0),
            (0.6, 0.1, 0.1),
            (0.3, 0.3, 3.1),
        ] {
            let (wo, wi) = (direction(cos_o, 0.0), direction(cos_i, phi));
            let expected = single(wo, wi, &f) + several * (1.0 - albedo(cos_o)) * (1.0 - albedo(cos_i));
            let vec = |w: [f64; 3]| Vec3::new(w[0] as f32, w[1] as f32, w[2] as f32);
            let value = lobe.eval(vec(wo), vec(wi)).max_component() as f64;
            assert!(
                (value / expected - 1.0).abs() < 5e-3,
                "{alpha} {cos_o} {cos_i}: {value} {expected}"
            );
        }
    }
}

/// Walter et al. 2007, eq. 21, in f64 and in the notation of the paper. Multiple scattering adds
/// almost nothing here.
#[test]
fn rough_glass_matches_walter_2007() {
    let alpha = 0.04f64;
    for ior in [1.5, 0.75] {
        let lobe = Lobe::RoughDielectric(RoughDielectric::new(
            grey(1.0),
            grey(1.0),
            Vec2::splat(alpha as f32),
            ior as f32,
        ));
        for (wo, h) in [
            ([0.0, 0.0, 1.0], [0.02, 0.01, 1.0]),
            ([0.5, 0.2, 0.9], [-0.03, 0.04, 1.0]),
            ([0.2, -0.3, -0.8], [0.01, 0.05, -1.0]),
        ] {
            let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            let unit = |a: [f64; 3]| a.map(|x| x / dot(a, a).sqrt());
            let (o, m) = (unit(wo), unit(h));
            let (eta_o, eta_i) = if o[2] > 0.0 { (1.0, ior) } else { (ior, 1.0) };
            // Snell's law at the facet, and Fresnel's equations
            let (c, ratio) = (dot(o, m), eta_o / eta_i);
            let cos_t = (1.0 - ratio * ratio * (1.0 - c * c)).sqrt();
            let i = [0, 1, 2].map(|k| (ratio * c - cos_t) * m[k] - ratio * o[k]);
            let s = (eta_o * c - eta_i * cos_t) / (eta_o * c + eta_i * cos_t);
            let p = (eta_i * c - eta_o * cos_t) / (eta_i * c + eta_o * cos_t);
            let fresnel = 0.5 * (s * s + p * p);
            let tan2 = |w: [f64; 3]| 1.0 / (w[2] * w[2]) - 1.0;
            let d = alpha.powi(2) / (std::f64::consts::PI * m[2].powi(4) * (alpha.powi(2) + tan2(m)).powi(2));
            let g1 = |w: [f64; 3]| 2.0 / (1.0 + (1.0 + alpha.powi(2) * tan2(w)).sqrt());
            let jacobian = eta_o.powi(2) / (eta_i * dot(i, m) + eta_o * dot(o, m)).powi(2);
            let cosines = (dot(i, m) * dot(o, m) / (i[2] * o[2])).abs();
            let expected = cosines * jacobian * (1.0 - fresnel) * g1(i) * g1(o) * d;
            let vec = |w: [f64; 3]| Vec3::new(w[0] as f32, w[1] as f32, w[2] as f32);
            let value = lobe.eval(vec(o), vec(i)).max_component() as f64;
            assert!((value / expected - 1.0).abs() < 2e-3, "{ior} {o:?}: {value} {expected}");
        }
    }
}

/// A surface of low roughness scatters as much light as a smooth surface, in the same direction.
#[test]
fn low_roughness_matches_smooth_lobes() {
    let alpha = Vec2::splat(2.0 * MIN_ALPHA);
    let ones = grey(1.0);
    for degrees in [0.0, 30.0, 60.0, 80.0] {
        for side in [1.0, -1.0] {
            let wo = incident(degrees) * Vec3::new(1.0, 1.0, side);
            for mode in [TransportMode::Radiance, TransportMode::Importance] {
                let mirror = Mirror {
                    reflectance: ones,
                    fresnel: GOLD,
                };
                let glass = Dielectric {
                    reflectance: ones,
                    transmittance: ones,
                    ior: 1.5,
                };
                let pairs = [
                    (
                        Lobe::RoughConductor(RoughConductor::new(ones, alpha, GOLD)),
                        Lobe::Mirror(mirror),
                    ),
                    (
                        Lobe::RoughDielectric(RoughDielectric::new(ones, ones, alpha, 1.5)),
                        Lobe::Dielectric(glass),
                    ),
                ];
                for (rough, smooth) in pairs {
                    for expected in smooth.directions(wo, mode).into_iter().flatten() {
                        // Sum flux and mean direction on this side
                        let (mut flux, mut mean) = (0.0, Vec3::ZERO);
                        const N: u32 = 1 << 14;
                        for i in 0..N {
                            let (u_lobe, u) = even_numbers(i);
                            let sample = rough.sample(wo, u_lobe, u, mode);
                            if let Some(s) = sample.filter(|s| s.wi.z * expected.wi.z > 0.0) {
                                flux += s.weight.max_component() / N as f32;
                                mean += s.wi * (s.weight.max_component() / N as f32);
                                assert_eq!((s.eta, s.scattering), (expected.eta, Scattering::Glossy));
                            }
                        }
                        let share = expected.pdf * expected.weight.max_component();
                        assert!((flux - share).abs() < 3e-3, "{degrees}° {side}: {flux} {share}");
                        let off = (mean / flux).distance(expected.wi);
                        assert!(off < 0.01, "{degrees}° {side}: {off}");
                    }
                }
            }
        }
    }
}

/// Extreme and invalid lobes give finite values and do not panic.
#[test]
fn rough_lobes_stay_finite_for_any_input() {
    let numbers = [f32::NAN, f32::INFINITY, -1.0, 0.0, 1e-20, 1.0, 50.0];
    let directions = [
        Vec3::X,
        Vec3::Z,
        Vec3::NEG_Z,
        Vec3::new(0.6, 0.0, -0.8),
        Vec3::new(1.0, 0.0, 1e-30),
        Vec3::new(-1.0, 0.0, -1e-7),
    ];
    let lobes = rough_lobes()
        .map(|(_, lobe)| lobe)
        .chain(numbers.into_iter().flat_map(|x| {
            let alpha = Vec2::new(x, 0.5);
            [
                Lobe::RoughConductor(RoughConductor::new(grey(1.0), alpha, Fresnel::Schlick { f0: [0.5; 3] })),
                Lobe::RoughDielectric(RoughDielectric::new(grey(1.0), grey(1.0), alpha, 1.5)),
                Lobe::RoughDielectric(RoughDielectric::new(
                    grey(1.0),
                    grey(1.0),
                    Vec2::splat(0.3),
                    1.0 / (1.0 + x.abs().min(99.0)),
                )),
                Lobe::CoatedLambert(CoatedLambert::new(grey(1.0), x, 0.04)),
            ]
        }));
    let sheen = Sheen { color: grey(1.0) };
    let lobes = lobes.chain([Lobe::Sheen(sheen)]).map(Bsdf::Single);
    let layered = layered_bsdfs().into_iter().map(|(_, bsdf)| bsdf);
    for lobe in lobes.chain(layered) {
        for wo in directions {
            for wi in directions {
                let (f, pdf) = (lobe.eval(wo, wi), lobe.pdf(wo, wi));
                assert!(
                    f.is_valid() && pdf.is_finite() && pdf >= 0.0,
                    "{lobe:?} {wo} {wi}: {f:?} {pdf}"
                );
            }
            for i in 0..200 {
                let (u_lobe, u) = even_numbers(i);
                if let Some(s) = lobe.sample(wo, u_lobe, u, TransportMode::Radiance) {
                    assert!(
                        s.weight.is_valid() && s.wi.is_finite() && s.pdf > 0.0,
                        "{lobe:?} {wo}: {s:?}"
                    );
                }
            }
        }
    }
}

/// Objects that conserve energy are invisible in a furnace (here a sky of uniform light). This test
/// also covers both sides of a surface, the index of refraction, and the choice of lobes in the
/// integrator.
#[cfg(any(feature = "embree", feature = "obvhs"))]
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn rough_objects_vanish_in_a_furnace() {
    let glass = Material {
        transmission: grey(1.0),
        roughness: 0.6,
        ..Material::default()
    };
    let metal = Material {
        specular: grey(1.0),
        gloss: Gloss::Ggx(Fresnel::Full),
        roughness: 0.8,
        ..Material::default()
    };
    let plastic = Material::metallic_roughness(grey(1.0), 0.0, 0.4);
    let lacquer = Material {
        diffuse: grey(1.0),
        clearcoat: 0.6,
        ..Material::default()
    };
    let cloth = Material {
        diffuse: grey(1.0),
        sheen: grey(0.8),
        ..Material::default()
    };
    for (name, material) in [
        ("glass", glass),
        ("metal", metal),
        ("plastic", plastic),
        ("lacquer", lacquer),
        ("cloth", cloth),
    ] {
        let mut b = embrasure::scene::SceneBuilder::new();
        crate::support::add(&mut b, crate::support::sphere(1.0, Vec3::ZERO, 2), material);
        b.add_constant_light(Spectrum::ONE).unwrap();
        let (scene, report) = b.build().unwrap();
        assert!(report.scaled_materials.is_empty());
        let camera = crate::support::pinhole(Vec3::new(0.0, 0.5, 3.0), Vec3::ZERO, 36.0);
        let film = crate::support::render_film(&scene, camera, [48, 48], 256, None);
        assert_means_within(name, Mean::of_film(&film, 0), Mean::exact(1.0), 5e-3);
    }
}

/// [`Bsdf::sample`] selects a lobe that is no delta distribution if `u_lobe` is below
/// `smooth_probability`, and otherwise a delta lobe.
#[test]
fn smooth_lobes_are_chosen_first() {
    let mirror_and_rough_glass = Material {
        specular: grey(0.4),
        gloss: Gloss::Mirror(GOLD),
        transmission: grey(0.5),
        roughness: 0.5,
        ..Material::default()
    };
    let mirror = ("mirror and rough glass".to_string(), mirror_and_rough_glass.bsdf());
    let all = bsdfs().into_iter().chain(rough_bsdfs()).chain(layered_bsdfs());
    for (name, bsdf) in all.chain([mirror]) {
        for wo in INCIDENCES.map(incident) {
            let smooth = bsdf.smooth_probability(wo);
            for (u_lobe, u) in (0..2000).map(even_numbers) {
                // Skip numbers at the limit of rounding
                if (u_lobe - smooth).abs() < 1e-5 {
                    continue;
                }
                if let Some(s) = bsdf.sample(wo, u_lobe, u, TransportMode::Radiance) {
                    assert_eq!(s.is_delta(), u_lobe > smooth, "{name} {wo}: {u_lobe} {smooth}");
                }
            }
        }
    }
}

/// Light samples, also light samples through glass, agree with scattered rays that hit lights.
#[cfg(any(feature = "embree", feature = "obvhs"))]
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn strategies_agree_on_light_through_rough_glass() {
    use crate::support::{add, material, polygon, room, sphere};
    use embrasure::integrator::{DirectLight, Directions, PathIntegrator, Strategy};
    let mut b = embrasure::scene::SceneBuilder::new();
    add(&mut b, room(), material(0.4, 0.0));
    let corners = [[-0.7, -0.7], [0.7, -0.7], [0.7, 0.7], [-0.7, 0.7]];
    let lamp = corners.map(|[x, z]| Vec3::new(x, 0.97, z));
    add(&mut b, polygon(&lamp), material(0.0, 2.0));
    let glass = Material {
        transmission: Spectrum::rgb(1.0, 0.9, 0.8),
        roughness: 1.0,
        ..Material::default()
    };
    add(&mut b, sphere(0.5, Vec3::ZERO, 3), glass);
    let plastic = Material {
        clearcoat: 1.0,
        sheen: grey(0.5),
        ..Material::metallic_roughness(grey(0.8), 0.3, 0.8)
    };
    add(&mut b, sphere(0.3, Vec3::new(-0.4, -0.6, 0.5), 2), plastic);
    let scene = b.build().unwrap().0;
    let camera = crate::support::pinhole(Vec3::new(0.0, 0.1, 0.95), Vec3::new(0.0, -0.2, 0.0), 70.0);
    let size = embrasure::math::UVec2::splat(24);
    let mean = |directions, direct, reuse| {
        crate::support::with_world(&scene, camera, size, |world| {
            let path = PathIntegrator {
                strategy: Strategy {
                    directions,
                    direct,
                    ..Strategy::default()
                },
                ..crate::support::path_tracer(world, Some(6))
            };
            let film = crate::support::film_of(
                &crate::support::PathTracer { path, reuse },
                size,
                crate::support::budget(1024),
                3,
            );
            // Pixels with path reuse have correlated errors, so their error estimate is too small.
            let mean = Mean::of_film(&film, 0);
            Mean::new(mean.value, if reuse { 2.0 * mean.error() } else { mean.error() })
        })
    };
    let expected = mean(Directions::Bsdf, DirectLight::Mis, false);
    for (directions, direct, reuse) in [
        (Directions::Bsdf, DirectLight::None, false),
        (Directions::Bsdf, DirectLight::Light, false),
        (Directions::Bsdf, DirectLight::Mis, true),
        (Directions::Cosine, DirectLight::None, false),
        (Directions::Cosine, DirectLight::Mis, false),
        (Directions::Uniform, DirectLight::Mis, true),
    ] {
        let what = format!("{directions:?} {direct:?} {reuse}");
        assert_same_mean(what, mean(directions, direct, reuse), expected);
    }
}

/// A lobe with parts is stored as a mixture, because the path tracer draws a random number for the
/// choice of a part only for mixtures.
#[test]
fn lobes_with_parts_are_mixtures() {
    let metal = |roughness| Material::metallic_roughness(grey(0.9), 1.0, roughness).bsdf();
    assert!(matches!(metal(0.5), Bsdf::Mix(_)) && metal(0.5).lobes().all(Lobe::has_parts));
    // Below a roughness of 1/64 the metal is a mirror.
    assert!(matches!(metal(0.015), Bsdf::Single(Lobe::Mirror(_))));
    let glass = |roughness, ior| {
        let material = Material {
            transmission: grey(1.0),
            roughness,
            ior,
            ..Material::default()
        };
        material.bsdf()
    };
    assert!(matches!(glass(0.5, 1.5), Bsdf::Mix(_)));
    assert!(matches!(glass(0.015, 1.5), Bsdf::Single(Lobe::Dielectric(_))));
    assert!(matches!(glass(1.0, 1.0), Bsdf::Single(Lobe::Dielectric(_))));
}

#[test]
fn lobes_are_small() {
    // A mixture stores copies of three lobes, so lobes must be small.
    assert!(size_of::<RoughConductor>() <= 60 && size_of::<RoughDielectric>() <= 60);
    assert_eq!(size_of::<Lobe>(), 64);
    assert!(size_of::<Bsdf>() <= 336);
}
