//! Metropolis light transport in primary sample space: iterations against closed forms and path
//! tracing. The number of threads and the parts of a render change no bit of the image.

#![cfg(any(feature = "embree", feature = "obvhs"))]

use crate::support::statistics::{Mean, assert_same_mean};
use crate::support::*;
use embrasure::bsdf::Fresnel;
use embrasure::camera::{Camera, CameraParameters};
use embrasure::color::Spectrum;
use embrasure::film::{Accumulator, Film, Filter, FilterKind, Rect};
use embrasure::integrator::{Heuristic, ImportanceImage, Metropolis, MetropolisDirect, PrimarySpaceIntegrator, World};
use embrasure::light_sampling::{LightChoice, SelectionMode};
use embrasure::material::{Gloss, Material};
use embrasure::math::{UVec2, Vec3};
use embrasure::pipeline::CompiledIntegrator;
use embrasure::render::Statistics;
use embrasure::sampler::RenderSampler;
use embrasure::scene::{Scene, SceneBuilder};
use std::f64::consts::PI;

const BOTH: [MetropolisDirect; 2] = [MetropolisDirect::Ordinary, MetropolisDirect::Metropolis];

/// Integrator with few chains and few bootstrap paths, so that their errors are visible.
fn pssmlt<'a>(
    world: World<'a, Backend<'a>>,
    max_depth: u32,
    importance: &'a ImportanceImage,
) -> PrimarySpaceIntegrator<'a, Backend<'a>> {
    PrimarySpaceIntegrator {
        world,
        heuristic: Heuristic::Power,
        max_depth: Some(max_depth),
        light_samples: 1,
        metropolis: Metropolis {
            chains: Some(8),
            bootstrap: Some(256),
            ..Metropolis::default()
        },
        importance,
    }
}

/// Renders samples `first`..`end` of the pixels of `crop`.
fn part(
    integrator: &dyn CompiledIntegrator,
    sampler: &RenderSampler,
    (resolution, crop): (UVec2, Rect),
    [first, end]: [u32; 2],
) -> (Film, Statistics) {
    let mut film = Film::starting_at(resolution, crop, first);
    let statistics = render_into(&mut film, integrator, sampler, end);
    (film, statistics)
}

/// Mean of the whole image for each of `count` iterations.
fn means_of_iterations(integrator: &dyn CompiledIntegrator, resolution: UVec2, count: u32) -> Vec<f64> {
    let of = |iteration| {
        let all = (resolution, Rect::full(resolution));
        film_mean(
            &part(integrator, &independent(55), all, [iteration, iteration + 1]).0,
            1,
        )
    };
    (0..count).map(of).collect()
}

/// Fails if the mean over iterations differs from `expected`, or if its standard error exceeds 0.2
/// % with all samples.
fn assert_mean(what: &str, iterations: &[f64], expected: f64) {
    let mean = Mean::of(iterations);
    assert!(
        mean.error() < 2e-3 * slack() * expected,
        "{what}: {mean}: the error is too large"
    );
    assert_same_mean(what, mean, Mean::exact(expected));
}

/// A room of reflectance 0.5 whose walls emit 1, seen from inside.
fn glowing_room() -> (Scene, CameraParameters) {
    let mut b = SceneBuilder::new();
    add(&mut b, room(), material(0.5, 1.0));
    let camera = pinhole(Vec3::new(0.1, -0.2, 0.3), Vec3::new(1.0, 0.2, 0.5), 90.0);
    (b.build().unwrap().0, camera)
}

#[test]
fn closed_box_shows_the_geometric_series() {
    let (scene, camera) = glowing_room();
    let resolution = UVec2::splat(24);
    with_world(&scene, camera, resolution, |world| {
        for direct in BOTH {
            for (max_depth, iterations) in [(0, 400), (1, 400), (5, 600)] {
                let test = rough_picture(world, max_depth);
                let mut integrator = pssmlt(world, max_depth, &test);
                integrator.metropolis.direct = direct;
                integrator.metropolis.bootstrap = Some(1024);
                let means = means_of_iterations(&integrator, resolution, budget(iterations));
                let expected = 2.0 - 0.5f64.powi(max_depth as i32);
                assert_mean(&format!("{direct:?}, max_depth {max_depth}"), &means, expected);
            }
        }
    });
}

// The backend `brute` would take minutes.

#[test]
fn white_furnace_hides_a_white_object() {
    let mut b = SceneBuilder::new();
    add(&mut b, sphere(1.0, Vec3::ZERO, 3), material(1.0, 0.0));
    b.add_constant_light(Spectrum::ONE).unwrap();
    let scene = b.build().unwrap().0;
    let camera = pinhole(Vec3::new(0.0, 0.5, 3.0), Vec3::ZERO, 50.0);
    let resolution = UVec2::splat(24);
    with_world(&scene, camera, resolution, |world| {
        // No light is scattered twice, so chains of longer paths find no light. They nevertheless
        // use a part of the bootstrap paths.
        for (direct, max_depth, iterations) in [
            (MetropolisDirect::Ordinary, 20, 200),
            (MetropolisDirect::Metropolis, 1, 800),
        ] {
            let test = rough_picture(world, max_depth);
            let mut integrator = pssmlt(world, max_depth, &test);
            integrator.metropolis.direct = direct;
            integrator.metropolis.bootstrap = Some(1024);
            let means = means_of_iterations(&integrator, resolution, budget(iterations));
            assert_mean(&format!("{direct:?}"), &means, 1.0);
        }
    });
}

/// A point light anywhere in a diffuse sphere (the integrating sphere). Light that was scattered
/// once illuminates the sphere evenly, with the irradiance ρ Φ / (4 π R²). Each further scattering
/// multiplies the irradiance by ρ.

#[test]
fn point_light_lights_a_sphere_evenly() {
    let (rho, intensity, radius) = (0.6, 3.0, 2.0);
    let mut b = SceneBuilder::new();
    add(&mut b, sphere(radius, Vec3::ZERO, 5), material(rho, 0.0));
    b.add_point_light(Vec3::new(0.7, -0.4, 0.9), Spectrum::splat(intensity))
        .unwrap();
    let scene = b.build().unwrap().0;
    let camera = pinhole(Vec3::new(-0.5, 0.2, 0.3), Vec3::new(1.0, 0.9, -0.2), 80.0);
    let resolution = UVec2::splat(16);
    with_world(&scene, camera, resolution, |world| {
        let max = 4;
        let means = |max_depth| {
            let test = rough_picture(world, max_depth);
            let mut integrator = pssmlt(world, max_depth, &test);
            integrator.metropolis.bootstrap = Some(2048);
            means_of_iterations(&integrator, resolution, budget(400))
        };
        // Direct light is bit-identical in both renders. So their difference is the light of at
        // least two scatterings, and its radiance is ρ E / π.
        let indirect: Vec<f64> = means(max)
            .iter()
            .zip(means(1))
            .map(|(all, direct)| all - direct)
            .collect();
        let (rho, irradiance) = (rho as f64, (intensity / (radius * radius)) as f64);
        let series: f64 = (1..max as i32).map(|k| rho.powi(k)).sum();
        assert_mean("indirect light", &indirect, rho / PI * irradiance * series);
    });
}

/// Each iteration is unbiased, even with few bootstrap paths and few mutations. In this test, a
/// chain often has only one path to start from, and four steps.
#[test]
fn single_iterations_are_unbiased() {
    let (scene, camera) = glowing_room();
    let resolution = UVec2::splat(4);
    with_world(&scene, camera, resolution, |world| {
        for (bootstrap, chains, iterations) in [(1, 1, 40_000), (6, 4, 20_000), (40, 16, 8_000)] {
            let test = rough_picture(world, 2);
            let mut integrator = pssmlt(world, 2, &test);
            integrator.metropolis = Metropolis {
                direct: MetropolisDirect::Metropolis,
                chains: Some(chains),
                bootstrap: Some(bootstrap),
                ..Metropolis::default()
            };
            let mean = Mean::of(&means_of_iterations(&integrator, resolution, budget(iterations)));
            assert!(mean.error() < 0.02 * slack(), "{mean}");
            assert_same_mean(format!("{bootstrap} paths, {chains} chains"), mean, Mean::exact(1.75));
        }
    });
}

/// Compares iterations with path tracing, by z-tests of the means of 16 regions.
pub(super) fn assert_agrees_with_paths(
    what: &str,
    (scene, camera, filter): (&Scene, CameraParameters, &Filter),
    depth_and_iterations: (u32, u32),
    set: impl Fn(&mut Metropolis),
) {
    assert_choosing_agrees_with_paths(
        what,
        (scene, camera, filter),
        LightChoice::default(),
        depth_and_iterations,
        set,
    );
}

/// Like [`assert_agrees_with_paths`], but with the light selection `choice`.
fn assert_choosing_agrees_with_paths(
    what: &str,
    (scene, camera, filter): (&Scene, CameraParameters, &Filter),
    choice: LightChoice,
    (max_depth, iterations): (u32, u32),
    set: impl Fn(&mut Metropolis),
) {
    let resolution = UVec2::splat(16);
    let camera = Camera::new(camera, resolution).unwrap();
    let accel = backend(scene);
    let accel: Backend = &accel;
    let selection = scene.light_selection(choice);
    let world = World::new(scene, &accel, &selection, &camera, filter);
    let region = |x: u32, y: u32| Rect {
        min: UVec2::new(x, y) * 4,
        max: UVec2::new(x + 1, y + 1) * 4,
    };
    let regions: Vec<Rect> = (0..16).map(|i| region(i % 4, i / 4)).collect();
    let mean = |film: &Film, region: Rect, c: usize| {
        let means = region.pixels().map(|pixel| film.sums(pixel).unwrap().mean(c));
        means.sum::<f64>() / region.area() as f64
    };

    // Render by path tracing, whose pixels are independent
    let paths = film_of(&path_tracer(world, Some(max_depth)), resolution, budget(2048), 9);
    let error = |region: Rect, c: usize| {
        let variances = region
            .pixels()
            .map(|pixel| paths.sums(pixel).unwrap().variance_of_mean(c));
        variances.sum::<f64>().sqrt() / region.area() as f64
    };

    for direct in BOTH {
        let test = rough_picture(world, max_depth);
        let mut integrator = pssmlt(world, max_depth, &test);
        integrator.metropolis.direct = direct;
        set(&mut integrator.metropolis);
        let iteration = |index: u32| {
            let all = (resolution, Rect::full(resolution));
            part(&integrator, &independent(3), all, [index, index + 1]).0
        };
        let iterations: Vec<Film> = (0..budget(iterations)).map(iteration).collect();
        let mut relative = Vec::new();
        for &region in &regions {
            for c in 0..3 {
                let values: Vec<f64> = iterations.iter().map(|film| mean(film, region, c)).collect();
                let (got, expected) = (Mean::of(&values), Mean::new(mean(&paths, region, c), error(region, c)));
                relative.push(got.error().hypot(expected.error()) / expected.value);
                assert_same_mean(format!("{what}, {direct:?}, {region:?}, channel {c}"), got, expected);
            }
        }
        relative.sort_by(f64::total_cmp);
        println!(
            "{what}, {direct:?}: regions are known to {:.4}",
            relative[relative.len() / 2]
        );
        assert!(
            relative[relative.len() / 2] < 0.06 * slack(),
            "{what}, {direct:?}: too noisy to tell anything"
        );
    }
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn pictures_agree_with_path_tracing() {
    let cornell = pinhole(Vec3::new(278.0, 273.0, -800.0), Vec3::new(278.0, 273.0, 0.0), 39.0);
    let scene = own("cornell-box.toml");
    let many = |metropolis: &mut Metropolis| (metropolis.chains, metropolis.bootstrap) = (Some(64), Some(512));
    assert_agrees_with_paths("cornell-box", (&scene, cornell, &Filter::BOX), (4, 800), many);
    // This filter is wider than a pixel, so chains also sample positions beyond the borders of
    // the image.
    let filter = Filter::new(FilterKind::Mitchell, 2.0);
    assert_agrees_with_paths("cornell-box, filtered", (&scene, cornell, &filter), (3, 800), many);
}

/// A room with every lobe, including delta lobes.
#[test]
fn every_lobe_agrees_with_path_tracing() {
    let inside = pinhole(Vec3::new(0.0, 0.1, 0.95), Vec3::new(0.0, -0.3, -1.0), 80.0);
    let set = |metropolis: &mut Metropolis| {
        metropolis.large_step_probability = 0.6;
        metropolis.mutation_size = 0.1;
    };
    assert_agrees_with_paths("lobes", (&lobes_room(), inside, &Filter::BOX), (4, 800), set);
}

#[test]
fn glass_agrees_with_path_tracing() {
    let set = |metropolis: &mut Metropolis| {
        metropolis.large_step_probability = 0.6;
        metropolis.mutation_size = 0.1;
    };
    assert_agrees_with_paths("glass", (&glazed_room(), in_glazed_room(), &Filter::BOX), (4, 800), set);
}

/// A thin lens in front of lamps, a point light and a sky. All lights are sampled at every vertex.
#[test]
fn lens_agrees_with_path_tracing() {
    let mut b = SceneBuilder::new();
    let blinn = Material {
        specular: Spectrum::splat(0.5),
        gloss: Gloss::Blinn(20.0, Fresnel::Dielectric { eta: 1.5 }),
        ..material(0.4, 0.0)
    };
    add(&mut b, panel(-1.0, 3.0), material(0.7, 0.0));
    add(&mut b, sphere(0.6, Vec3::new(-0.3, 0.1, 0.0), 2), blinn);
    add(&mut b, sphere(0.2, Vec3::new(0.6, 0.5, 0.6), 0), material(0.5, 4.0));
    b.add_point_light(Vec3::new(1.5, 0.5, 1.0), Spectrum::rgb(2.0, 1.0, 0.5))
        .unwrap();
    b.add_constant_light(Spectrum::splat(0.3)).unwrap();
    let scene = b.build().unwrap().0;
    let camera = CameraParameters {
        lens_radius: 0.15,
        focus_distance: 4.0,
        ..pinhole(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 40.0)
    };
    let all = LightChoice {
        mode: SelectionMode::All,
        ..LightChoice::default()
    };
    assert_choosing_agrees_with_paths("lens", (&scene, camera, &Filter::BOX), all, (3, 800), |_| {});
}

/// A scene with two light groups.
fn grouped() -> Scene {
    let mut b = SceneBuilder::new();
    add(&mut b, room(), material(0.5, 0.0));
    for (name, x) in [("left", -0.5), ("right", 0.5)] {
        let group = b.light_group(name).unwrap();
        b.begin_light_group(Some(group));
        b.add_point_light(Vec3::new(x, 0.4, 0.2), Spectrum::rgb(1.0, 0.5, 0.8 + x))
            .unwrap();
    }
    b.build().unwrap().0
}

/// Means and variances of the pixels of a film.
fn sums(film: &Film) -> Vec<(UVec2, [[f64; 2]; 3])> {
    let of = |sums: &Accumulator| [0, 1, 2].map(|c| [sums.mean(c), sums.variance_of_mean(c)]);
    film.pixels().map(|(pixel, sums)| (pixel, of(&sums))).collect()
}

#[test]
fn threads_crops_and_parts_change_no_bit() {
    let scene = grouped();
    let camera = pinhole(Vec3::new(0.1, -0.2, 0.9), Vec3::new(-0.2, 0.1, -1.0), 70.0);
    let resolution = UVec2::new(40, 24);
    let full = Rect::full(resolution);
    with_world(&scene, camera, resolution, |world| {
        let test = rough_picture(world, 4);
        let integrator = pssmlt(world, 4, &test);
        let film = |threads, crop, samples| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| part(&integrator, &sobol(1), (resolution, crop), samples))
        };
        let (whole, statistics) = film(1, full, [0, 6]);
        assert!(whole.pixels().any(|(_, sums)| sums.mean(0) > 0.0));

        // The sums are the same with more threads
        let (other, same) = film(3, full, [0, 6]);
        assert_eq!((sums(&other), same), (sums(&whole), statistics.clone()));

        // A crop has the same sums
        let crop = Rect {
            min: UVec2::new(7, 3),
            max: UVec2::new(21, 20),
        };
        let is_seen = |(pixel, _): &(UVec2, _)| crop.contains(*pixel);
        let expected: Vec<_> = sums(&whole).into_iter().filter(is_seen).collect();
        let mut cropped = sums(&film(2, crop, [0, 6]).0);
        cropped.sort_by_key(|(pixel, _)| expected.iter().position(|(other, _)| other == pixel));
        assert_eq!(cropped, expected);

        // Merged parts have the same sums
        let (mut first, some) = film(2, full, [0, 2]);
        let (second, more) = film(1, full, [2, 6]);
        first.merge(&second);
        assert_eq!((sums(&first), some.merge(more)), (sums(&whole), statistics.clone()));

        // Each iteration has one mutation per pixel
        let counts: Vec<_> = statistics.mutations.values().collect();
        let proposed: u64 = counts.iter().map(|counts| counts.proposed).sum();
        assert_eq!(proposed, 6 * full.area());
        assert!(
            counts
                .iter()
                .all(|counts| counts.accepted > 0 && counts.accepted <= counts.proposed)
        );
        assert_eq!(statistics.mutations.keys().collect::<Vec<_>>(), ["large", "small"]);
    });
}

#[test]
fn light_groups_sum_to_the_same_image() {
    let scene = grouped();
    let camera = pinhole(Vec3::new(0.1, -0.2, 0.9), Vec3::new(-0.2, 0.1, -1.0), 70.0);
    let resolution = UVec2::splat(16);
    with_world(&scene, camera, resolution, |world| {
        let test = rough_picture(world, 4);
        let integrator = pssmlt(world, 4, &test);
        let film = |groups| {
            let mut film = Film::new(resolution, Rect::full(resolution)).with_parts(groups);
            render_into(&mut film, &integrator, &independent(1), 16);
            film
        };
        let (plain, told_apart) = (film(0), film(2));
        assert_eq!(sums(&plain), sums(&told_apart));
        for (pixel, picture) in sums(&plain) {
            let groups = told_apart.tile_at(pixel).unwrap().part_sums(pixel);
            let sum: f64 = groups.iter().map(|group| group.mean(2, 16)).sum();
            let [picture, _] = picture[2];
            assert!((sum - picture).abs() < 1e-5 * picture, "{pixel}: {sum}, {picture}");
            assert!(groups.iter().all(|group| group.mean(2, 16) > 0.0));
        }
    });
}

/// In a room of uniform radiance, chains of large steps have about the autocorrelation time of
/// independent samples. Tiny steps make this time longer.
#[test]
fn autocorrelation_time_grows_for_small_steps() {
    let (scene, camera) = glowing_room();
    let resolution = UVec2::splat(32);
    with_world(&scene, camera, resolution, |world| {
        let even = ImportanceImage::even();
        let chains = |large_step_probability, mutation_size| {
            let mut integrator = pssmlt(world, 3, &even);
            integrator.metropolis = Metropolis {
                direct: MetropolisDirect::Metropolis,
                chains: Some(8),
                large_step_probability,
                mutation_size,
                ..Metropolis::default()
            };
            let (_, statistics) = part(
                &integrator,
                &independent(3),
                (resolution, Rect::full(resolution)),
                [0, 40],
            );
            assert_eq!((statistics.chains.chains, statistics.chains.mutations), (320, 40 << 10));
            let time = statistics.chains.autocorrelation_time().unwrap();
            println!(
                "{large_step_probability}, {mutation_size}: {time}, {} stuck",
                statistics.chains.stuck
            );
            (time, statistics.chains.stuck)
        };
        let (independent, stuck) = chains(1.0, 0.5);
        assert!((0.7..3.0).contains(&independent) && stuck == 0, "{independent}");
        let (usual, _) = chains(0.3, 1.0 / 64.0);
        let (tiny, stuck) = chains(0.0, 0.0005);
        assert!(usual > 1.5 * independent && usual < 0.2 * 128.0, "{usual}");
        assert!(tiny > 0.5 * 128.0 && stuck > 160, "{tiny}, {stuck}");
    });
}

/// In a scene without light, there are no chains and no errors.
#[test]
fn dark_scene_renders_black() {
    let mut b = SceneBuilder::new();
    add(&mut b, room(), material(0.5, 0.0));
    let scene = b.build().unwrap().0;
    let resolution = UVec2::new(3, 2);
    with_world(&scene, pinhole(Vec3::ZERO, Vec3::X, 60.0), resolution, |world| {
        for direct in BOTH {
            for max_depth in [0, 1, 5] {
                let test = rough_picture(world, max_depth);
                let mut integrator = pssmlt(world, max_depth, &test);
                integrator.metropolis.direct = direct;
                assert!(
                    means_of_iterations(&integrator, resolution, 3)
                        .iter()
                        .all(|mean| *mean == 0.0)
                );
            }
        }
    });
}
