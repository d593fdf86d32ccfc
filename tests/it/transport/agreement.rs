//! Each unbiased estimator is compared with the default estimator, pixel by pixel.
#![cfg(feature = "embree")]

use crate::support::statistics::{Mean, assert_same_mean};
use crate::support::*;
use embrasure::camera::CameraParameters;
use embrasure::color::Spectrum;
use embrasure::compare::Errors;
use embrasure::film::{Accumulator, Film, RgbImage};
use embrasure::integrator::*;
use embrasure::material::Material;
use embrasure::math::{UVec2, Vec3};
use embrasure::sampler::{CubePoints, Fibonacci, Perturbation, PerturbedQmc, RenderSampler, SamplerKind};
use embrasure::scene::{Scene, SceneBuilder};

/// Few pixels and many samples: the means are nearly normal, so the test is sharp.
const RESOLUTION: UVec2 = UVec2::splat(8);
const MAX_DEPTH: u32 = 6;
/// Factor on the number of samples of estimators that hit small lamps by chance. With fewer
/// samples, their means are far from normal.
const BLIND: u32 = 32;

type Render = Box<dyn Fn(World<Backend>, u32) -> Film>;

/// An estimator of the image, with its number of samples.
struct Estimator {
    name: String,
    spp: u32,
    render: Render,
}

fn path(name: &str, spp: u32, strategy: Strategy, roulette_depth: u32, light_samples: u32) -> Estimator {
    path_with(name, spp, strategy, Roulette::after(roulette_depth), light_samples)
}

fn path_with(name: &str, spp: u32, strategy: Strategy, roulette: Roulette, light_samples: u32) -> Estimator {
    let render = move |world: World<Backend>, spp| {
        let integrator = PathIntegrator {
            strategy,
            roulette,
            light_samples,
            ..path_tracer(world, Some(MAX_DEPTH))
        };
        film_of(&integrator, RESOLUTION, spp, 1)
    };
    Estimator {
        name: name.into(),
        spp,
        render: Box::new(render),
    }
}

/// All estimators. Efficient estimators have `spp` samples. Estimators that hit lamps by chance
/// have `blind` × `spp` samples.
fn estimators(spp: u32, blind: u32) -> Vec<Estimator> {
    let rare = slack().ceil() as u32 * blind * spp;
    let mut all = Vec::new();
    for (d, directions) in [
        ("uniform", Directions::Uniform),
        ("cosine", Directions::Cosine),
        ("bsdf", Directions::Bsdf),
        // All these estimators use independent random numbers, so these directions are also made
        // from independent random numbers.
        ("perturbed qmc", Directions::PerturbedQmc),
        ("perturbed qmc uniform", Directions::PerturbedQmcUniform),
    ] {
        for (l, direct, heuristic, spp) in [
            ("none", DirectLight::None, Heuristic::Power, rare),
            ("light", DirectLight::Light, Heuristic::Power, spp),
            ("mis balance", DirectLight::Mis, Heuristic::Balance, spp),
            ("mis power", DirectLight::Mis, Heuristic::Power, spp),
        ] {
            // With small lamps, this estimator takes most of the time. Comparisons with wide lamps
            // test its sampling of directions equally well.
            if l == "none" && blind == BLIND && !["uniform", "bsdf"].contains(&d) {
                continue;
            }
            let strategy = Strategy {
                directions,
                direct,
                heuristic,
            };
            all.push(path(&format!("{d}, {l}"), spp, strategy, 2, 1));
        }
    }
    all.push(path("no roulette", spp, Strategy::default(), u32::MAX, 1));
    let balance = Strategy {
        heuristic: Heuristic::Balance,
        ..Strategy::default()
    };
    all.push(path("three light samples", spp, Strategy::default(), 2, 3));
    all.push(path("three light samples, balance", spp, balance, 2, 3));
    for (name, survival) in [
        ("roulette by luminance", Survival::Luminance),
        ("constant roulette", Survival::Constant(0.7)),
        ("roulette below a threshold", Survival::Threshold(0.5)),
    ] {
        all.push(path_with(
            name,
            spp,
            Strategy::default(),
            Roulette { depth: 1, survival },
            1,
        ));
    }
    // With small lamps, too few paths hit a lamp for a z-test.
    if blind < BLIND {
        all.push(Estimator {
            name: "coin and absorption at every hit, naive".into(),
            spp: rare,
            render: Box::new(|world, spp| {
                let integrator = NaiveIntegrator {
                    directions: Directions::Bsdf,
                    emission_coin: EmissionCoin::EveryHit,
                    emission_probability: 0.2,
                    absorption: Absorption::Chance,
                    ..NaiveIntegrator::new(world, Some(MAX_DEPTH), Roulette::after(u32::MAX))
                };
                film_of(&integrator, RESOLUTION, spp, 2)
            }),
        });
    }
    all.push(Estimator {
        name: "simple".into(),
        spp,
        render: Box::new(|world, spp| {
            let integrator = SimpleIntegrator {
                world,
                max_depth: MAX_DEPTH,
            };
            film_of(&integrator, RESOLUTION, spp, 2)
        }),
    });
    all.push(Estimator {
        name: "one sample of direct and indirect light".into(),
        spp: 4 * spp,
        render: Box::new(|world, spp| {
            let integrator = OneSampleIntegrator {
                world,
                direct_probability: 0.4,
                max_depth: Some(MAX_DEPTH),
            };
            film_of(&integrator, RESOLUTION, spp, 2)
        }),
    });
    all.push(Estimator {
        name: "naive".into(),
        spp: rare,
        render: Box::new(|world, spp| {
            let integrator = NaiveIntegrator::new(world, Some(MAX_DEPTH), Roulette::after(2));
            film_of(&integrator, RESOLUTION, spp, 2)
        }),
    });
    all.push(Estimator {
        name: "distributed".into(),
        // Each sample has up to 2⁶ paths, but they share vertices: one sample has about the error
        // of 4 samples of the path tracer.
        spp: spp / 4,
        render: Box::new(|world, spp| {
            let integrator = DistributedIntegrator {
                world,
                strategy: Strategy::default(),
                max_depth: MAX_DEPTH,
                branching: 2,
            };
            film_of(&integrator, RESOLUTION, spp, 3)
        }),
    });
    all.push(Estimator {
        name: "bidirectional".into(),
        spp,
        render: Box::new(|world, spp| {
            let integrator = BidirectionalIntegrator {
                world,
                heuristic: Heuristic::Power,
                max_depth: Some(MAX_DEPTH),
                roulette: Roulette::after(2),
            };
            film_of_iterations(&integrator, RESOLUTION, spp, 4)
        }),
    });
    all
}

/// Fails unless the images agree: at least 99.75 % of the channels of pixels, and the means of the
/// images, may differ by noise only.
///
/// With all samples, the standard error of a difference of means is between 0.04 % and 4 %, with a
/// median of 2 %. With a quarter of the samples, it is twice as large. The test finds a wrong
/// factor if the error exceeds six standard errors. `bsdf.rs`, `lights.rs` and `closed_forms.rs`
/// find smaller errors.
fn assert_agree(what: &str, a: &Film, b: &Film) {
    // Šidák: all N = 192 channels stay below |z| < 4.1 with a probability of 99 %. Skewed
    // distributions need a slightly larger threshold. With a quarter of the samples, one more
    // channel may exceed the threshold.
    const THRESHOLD: f64 = 4.5;
    let pixels = |film: &Film| -> Vec<_> { film.pixels().map(|(_, s)| s).collect() };
    let (a, b) = (pixels(a), pixels(b));
    let total: f64 = b.iter().map(|s| s.mean(1)).sum();
    let mut beyond = 0;
    for c in 0..3 {
        let (mut sum, mut variance) = (0.0, 0.0);
        let variances: Vec<f64> = (a.iter().zip(&b))
            .map(|(a, b)| a.variance_of_mean(c) + b.variance_of_mean(c))
            .collect();
        let means: Vec<f64> = b.iter().map(|s| s.mean(c)).collect();
        for (i, (a, b)) in a.iter().zip(&b).enumerate() {
            let (difference, v) = (a.mean(c) - b.mean(c), variances[i]);
            // If a pixel missed rare bright samples, its variance estimate is too small. The
            // relative variance of the pixels around it is then used.
            let near = v.max(means[i].powi(2) * relative_variance_about(i, &variances, &means));
            beyond += usize::from(difference.abs() > THRESHOLD * near.sqrt() + 1e-6);
            sum += difference;
            variance += v;
        }
        if c == 1 {
            println!(
                "{what}: {:+.5} ± {:.5} of the mean",
                sum / total,
                variance.sqrt() / total
            );
        }
        let difference = Mean::new(sum, variance.sqrt().max(1e-9));
        assert_same_mean(format!("{what}, channel {c}"), difference, Mean::exact(0.0));
    }
    let share = beyond as f64 / (3 * a.len()) as f64;
    assert!(
        share <= 0.0027 * slack(),
        "{what}: {:.2} % of the channels differ",
        100.0 * share
    );
}

/// Mean of variance / mean² over pixel `i` and its neighbours, without black pixels.
fn relative_variance_about(i: usize, variances: &[f64], means: &[f64]) -> f64 {
    let width = RESOLUTION.x as usize;
    let is_near = |j: usize| (i % width).abs_diff(j % width) <= 1 && (i / width).abs_diff(j / width) <= 1;
    let near: Vec<f64> = (0..means.len())
        .filter(|&j| is_near(j) && means[j] > 0.0)
        .map(|j| variances[j] / means[j].powi(2))
        .collect();
    near.iter().sum::<f64>() / near.len().max(1) as f64
}

/// Compares all [`estimators`], except estimators whose names end with an entry of `skip`.
fn all_agree(what: &str, scene: &Scene, camera: CameraParameters, samples: (u32, u32), skip: &[&str]) {
    with_world(scene, camera, RESOLUTION, |world| {
        all_agree_in(what, world, samples, skip)
    });
}

fn all_agree_in(what: &str, world: World<Backend>, (spp, blind): (u32, u32), skip: &[&str]) {
    let spp = budget(spp);
    let best = path_tracer(world, Some(MAX_DEPTH));
    let reference = film_of(&best, RESOLUTION, 4 * spp, 0);
    for estimator in estimators(spp, blind) {
        if skip.iter().any(|end| estimator.name.ends_with(end)) {
            continue;
        }
        let film = (estimator.render)(world, estimator.spp);
        assert_agree(&format!("{what}: {}", estimator.name), &film, &reference);
    }
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn estimators_agree_on_our_scenes() {
    let cornell = pinhole(Vec3::new(278.0, 273.0, -800.0), Vec3::new(278.0, 273.0, 0.0), 39.0);
    all_agree("cornell-box", &own("cornell-box.toml"), cornell, (512, BLIND), &[]);
    // In the closed box and in the furnace, every ray hits a light. The box skips `light`: if a
    // lamp touches other surfaces, 1/distance² has no finite variance, and z-tests fail.
    let inside = pinhole(Vec3::new(0.4, 0.3, 0.6), Vec3::new(-1.0, -1.0, -1.0), 60.0);
    all_agree("closed-box", &own("closed-box.toml"), inside, (512, 8), &["light"]);
    let furnace = pinhole(Vec3::new(0.0, 0.5, 4.0), Vec3::ZERO, 40.0);
    // A thin lens, and a point light, which no ray can hit
    let lens = CameraParameters {
        lens_radius: 0.18,
        focus_distance: 7.45,
        ..pinhole(Vec3::new(0.0, 2.2, 7.4), Vec3::new(0.0, 0.85, 0.0), 31.0)
    };
    all_agree(
        "depth-of-field",
        &own("depth-of-field.toml"),
        lens,
        (4096, BLIND),
        &["none", "naive"],
    );
    all_agree("furnace", &own("furnace.toml"), furnace, (512, 8), &[]);
}

/// A room with every lobe: a Phong floor, a Blinn ball, a ball of glass, a metal ball, a mirror
/// over a diffuse base, and a colour filter. Paths hit the large lamp of the room.
#[test]
fn estimators_agree_on_every_lobe() {
    let inside = pinhole(Vec3::new(0.0, 0.1, 0.95), Vec3::new(0.0, -0.3, -1.0), 80.0);
    all_agree("lobes", &lobes_room(), inside, (1024, BLIND / 2), &[]);
}

/// Panes, thin glass and a filter between lights, surfaces and the camera: shadow rays and
/// scattered rays have the same transmittance.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn estimators_agree_through_glass() {
    all_agree("glass", &glazed_room(), in_glazed_room(), (1024, BLIND / 2), &[]);
}

/// Points are sampled uniformly over the area of all surfaces. No two surfaces touch, so the
/// geometry term is bounded and z-tests are valid. The floor is in an instance. One body is a
/// mirror, and one transmits half of the light.
#[test]
fn area_integrator_agrees_on_separate_surfaces() {
    let mut b = SceneBuilder::new();
    let square = |y: f32, half: f32| {
        polygon(&[
            Vec3::new(-half, y, half),
            Vec3::new(half, y, half),
            Vec3::new(half, y, -half),
            Vec3::new(-half, y, -half),
        ])
    };
    add(&mut b, square(2.0, 1.5), material(0.7, 0.0));
    add(&mut b, square(1.2, 0.3), material(0.2, 8.0));
    let half_there = Material {
        opacity: 0.5,
        ..material(0.6, 0.0)
    };
    add(&mut b, square(0.5, 0.4), half_there);
    add(&mut b, sphere(0.3, Vec3::new(0.8, 0.6, 0.0), 2), glass([0.9; 3], false));
    b.add_constant_light(Spectrum::splat(0.3)).unwrap();
    add(&mut b, square(0.0, 1.5), material(0.7, 0.0));
    let scene = b.build().unwrap().0;
    let camera = pinhole(Vec3::new(0.3, 1.0, 5.0), Vec3::new(0.0, 0.9, 0.0), 40.0);
    with_world(&scene, camera, RESOLUTION, |world| {
        let reference = film_of(&path_tracer(world, Some(3)), RESOLUTION, budget(4096), 0);
        let areas = SurfaceAreas::new(world.scene);
        let integrator = AreaIntegrator {
            world,
            areas: &areas,
            max_depth: Some(3),
        };
        assert_agree(
            "area",
            &film_of(&integrator, RESOLUTION, budget(1 << 15), 1),
            &reference,
        );
    });
}

/// On Veach's plates, the error of MIS is at most 10 % above the error of the better of its two
/// strategies.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn mis_is_as_good_as_the_better_strategy() {
    let scene = own("veach-plates.toml");
    let resolution = UVec2::new(80, 60);
    let camera = pinhole(Vec3::new(0.0, 2.2, 9.5), Vec3::new(0.0, 1.5, 0.0), 38.0);
    let render = |direct, spp, seed| {
        with_world(&scene, camera, resolution, |world| {
            let integrator = PathIntegrator {
                strategy: Strategy {
                    direct,
                    ..Strategy::default()
                },
                ..path_tracer(world, Some(4))
            };
            RgbImage::from(&film_of(&integrator, resolution, spp, seed).develop())
        })
    };
    let reference = render(DirectLight::Mis, 1024, 1);
    let error = |direct| Errors::new(&render(direct, 64, 0), &reference).unwrap().rel_mse;
    let [none, light, mis] = [DirectLight::None, DirectLight::Light, DirectLight::Mis].map(error);
    println!("relMSE: none {none}, light {light}, mis {mis}");
    assert!(mis < 1.1 * none.min(light), "none {none}, light {light}, mis {mis}");
}

/// Samplers whose samples within a pixel depend on each other. The variance over seeds measures the
/// error of these samplers, but the variance over samples does not.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn dependent_samples_have_the_same_means() {
    const SEEDS: u64 = 48;
    // For each sampler, at least one whole block of samples, and some samples of the next block
    const SPP: u32 = 80;
    let inside = pinhole(Vec3::new(0.0, 0.1, 0.95), Vec3::new(0.0, -0.3, -1.0), 80.0);
    let cornell = pinhole(Vec3::new(278.0, 273.0, -800.0), Vec3::new(278.0, 273.0, 0.0), 39.0);
    for (what, scene, camera) in [
        ("lobes", lobes_room(), inside),
        ("cornell-box", own("cornell-box.toml"), cornell),
    ] {
        with_world(&scene, camera, RESOLUTION, |world| {
            let path = |directions| PathIntegrator {
                strategy: Strategy {
                    directions,
                    ..Strategy::default()
                },
                ..path_tracer(world, Some(MAX_DEPTH))
            };
            let pixels = |film: Film| -> Vec<Accumulator> { film.pixels().map(|(_, sums)| sums).collect() };
            let reference = pixels(film_of(&path(Directions::Bsdf), RESOLUTION, 2 * SEEDS as u32 * SPP, 0));
            for directions in [
                Directions::Bsdf,
                Directions::Fibonacci,
                Directions::PerturbedQmc,
                Directions::PerturbedQmcUniform,
            ] {
                let integrator = path(directions);
                let film = |seed| match directions {
                    Directions::Fibonacci => {
                        let others = SamplerKind::Sobol.with_seed(seed, SPP);
                        let sampler = RenderSampler::Fibonacci(Fibonacci::new(seed, SPP, others));
                        film_by(&sampler, &integrator, RESOLUTION, SPP)
                    }
                    Directions::PerturbedQmc | Directions::PerturbedQmcUniform => {
                        let others = SamplerKind::Sobol.with_seed(seed, SPP);
                        let options = Perturbation {
                            points: CubePoints::Halton,
                            size: 1.0,
                            is_scrambled: true,
                        };
                        let sampler = RenderSampler::PerturbedQmc(PerturbedQmc::new(seed, SPP, options, others));
                        film_by(&sampler, &integrator, RESOLUTION, SPP)
                    }
                    _ => {
                        let sampler = RenderSampler::Plain(SamplerKind::Orthogonal.with_seed(seed, SPP));
                        film_by(&sampler, &integrator, RESOLUTION, SPP)
                    }
                };
                let films: Vec<_> = (1..=SEEDS).map(|seed| pixels(film(seed))).collect();
                for c in 0..3 {
                    let means = |value: &dyn Fn(&[Accumulator]) -> f64, variance: f64| {
                        let values: Vec<f64> = films.iter().map(|film| value(film)).collect();
                        [
                            Mean::of(&values),
                            Mean::new(value(&reference), variance.sqrt().max(1e-9)),
                        ]
                    };
                    let [a, b] = means(
                        &|film| film.iter().map(|sums| sums.mean(c)).sum(),
                        reference.iter().map(|sums| sums.variance_of_mean(c)).sum(),
                    );
                    assert_same_mean(format!("{what}, {directions:?}, channel {c}"), a, b);
                    let far = (0..reference.len()).filter(|&i| {
                        // Student's t distribution has heavier tails than the normal distribution.
                        let [a, b] = means(&|film| film[i].mean(c), reference[i].variance_of_mean(c));
                        a.t(b).0.abs() > 5.0
                    });
                    assert!(far.count() <= 1, "{what}, {directions:?}: pixels of channel {c} differ");
                }
            }
        });
    }
}

/// Boxes of McGuire's archive: Phong, mirrors and glass.
#[test]
#[cfg_attr(not(shared), ignore = "needs ../shared")]
#[cfg_attr(all(shared, not(long)), ignore = "long")]
fn estimators_agree_on_mcguires_boxes() {
    let folder = shared("scenes/cornell-box-mcguire");
    for (name, height) in [("Original", 1.0), ("Glossy", 0.8), ("Mirror", 1.0), ("Sphere", 0.8)] {
        let scene = load(&folder.join(format!("CornellBox-{name}.obj")));
        let camera = pinhole(Vec3::new(0.0, height, 3.6), Vec3::new(0.0, height, 0.0), 36.0);
        // Without light samples, directions that do not follow the BSDF rarely hit these small
        // lamps, so sample variances are wrong. Even with 32,768 samples, pixels exceed the
        // threshold in both directions for many seeds.
        let skip = [
            "naive",
            "uniform, none",
            "cosine, none",
            "perturbed qmc, none",
            "perturbed qmc uniform, none",
        ];
        all_agree(name, &scene, camera, (1024, BLIND), &skip);
    }
}
