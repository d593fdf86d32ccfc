//! Pixels that share their paths: the same pictures, with less error.
#![cfg(feature = "embree")]

use crate::support::*;
use embrasure::camera::CameraParameters;
use embrasure::compare::Errors;
use embrasure::film::{Film, RgbImage};
use embrasure::integrator::*;
use embrasure::math::{UVec2, Vec3};
use embrasure::sampler::Sobol;
use embrasure::scene::{Scene, SceneBuilder};

/// One whole tile, and parts of three others.
const RESOLUTION: UVec2 = UVec2::new(21, 18);
const SEEDS: u64 = 32;

fn path<'a>(world: World<'a, Backend<'a>>, reuse: bool) -> MaybeReusing<'a, Backend<'a>> {
    let path = PathIntegrator {
        light_samples: 2,
        ..path_tracer(world, Some(6))
    };
    MaybeReusing { path, reuse }
}

fn cornell() -> CameraParameters {
    pinhole(Vec3::new(278.0, 273.0, -800.0), Vec3::new(278.0, 273.0, 0.0), 39.0)
}

/// Pixel means of the film, channel 0 first.
fn means(film: &Film) -> [Vec<f64>; 3] {
    let pixels: Vec<_> = film.pixels().map(|(_, a)| *a).collect();
    [0, 1, 2].map(|c| pixels.iter().map(|a| a.mean(c)).collect())
}

/// Mean of `values` and the variance of that mean.
fn mean_of(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let spread = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    (mean, spread / (n * (n - 1.0)))
}

/// Pixels of a film share errors, those of films with other seeds do not: means and variances are taken over seeds.
fn assert_same(what: &str, integrator: &MaybeReusing<Backend>, reference: &Film, spp: u32) {
    let films: Vec<_> = (0..SEEDS)
        .map(|seed| means(&film_of(integrator, RESOLUTION, spp, 100 + seed)))
        .collect();
    let reference: Vec<_> = reference.pixels().map(|(_, a)| *a).collect();
    for c in 0..3 {
        // The whole picture
        let pictures: Vec<f64> = films.iter().map(|f| f[c].iter().sum::<f64>()).collect();
        let (sum, variance) = mean_of(&pictures);
        let expected: f64 = reference.iter().map(|a| a.mean(c)).sum();
        let expected_variance: f64 = reference.iter().map(|a| a.variance_of_mean(c)).sum();
        let z = (sum - expected) / (variance + expected_variance).sqrt();
        println!(
            "{what}, channel {c}: {:.5} of the reference, z = {z:.2}",
            sum / expected
        );
        assert!(
            z.abs() < 4.0,
            "{what}: the means of channel {c} differ by {z:.2} standard errors"
        );
        // Pixel by pixel; 32 values have the heavier tails of Student's distribution: P(|t| > 5.5) is 5e-6.
        let mut beyond = 0;
        for (i, expected) in reference.iter().enumerate() {
            let (mean, variance) = mean_of(&films.iter().map(|f| f[c][i]).collect::<Vec<_>>());
            let allowed = 5.5 * (variance + expected.variance_of_mean(c)).sqrt() + 1e-6;
            beyond += usize::from((mean - expected.mean(c)).abs() > allowed);
        }
        let share = beyond as f64 / reference.len() as f64;
        assert!(share <= 0.003, "{what}: {beyond} pixels of channel {c} differ");
    }
}

/// Sharing must not move any mean, whichever way directions are drawn, light is found and paths end.
fn assert_unmoved(what: &str, scene: &Scene, camera: CameraParameters, spp: u32) {
    with_world(scene, camera, RESOLUTION, |world| assert_unmoved_in(what, world, spp));
}

fn assert_unmoved_in(what: &str, world: World<Backend>, spp: u32) {
    let reference = film_of(&path(world, false), RESOLUTION, 2 * SEEDS as u32 * spp, 0);
    let best = path(world, true);
    assert_same(what, &best, &reference, spp);
    // Shared paths end nowhere before their second vertex, however early roulette is to begin.
    let mut at_once = path(world, true);
    at_once.path.roulette.depth = 0;
    let [a, b] = [&best, &at_once].map(|integrator| means(&film_of(integrator, RESOLUTION, spp, 100)));
    assert_eq!(a, b, "{what}, roulette at once");
    for directions in [Directions::Cosine, Directions::Uniform] {
        let mut integrator = path(world, true);
        integrator.path.strategy.directions = directions;
        assert_same(&format!("{what}, {directions:?}"), &integrator, &reference, spp);
    }
}

#[test]
fn means_stay_where_they_are() {
    assert_unmoved("cornell-box", &own("cornell-box.toml"), cornell(), 16);
    let inside = pinhole(Vec3::new(0.4, 0.3, 0.6), Vec3::new(-1.0, -1.0, -1.0), 60.0);
    assert_unmoved("closed-box", &own("closed-box.toml"), inside, 16);
    // Every lobe: paths that cannot be shared, beside others that can.
    let inside = pinhole(Vec3::new(0.0, 0.1, 0.95), Vec3::new(0.0, -0.3, -1.0), 80.0);
    assert_unmoved("lobes", &lobes_room(), inside, 16);
    // Pixels that have little in common: a lens, a point light, the horizon.
    let lens = CameraParameters {
        lens_radius: 0.18,
        focus_distance: 7.45,
        ..pinhole(Vec3::new(0.0, 2.2, 7.4), Vec3::new(0.0, 0.85, 0.0), 31.0)
    };
    assert_unmoved("depth-of-field", &own("depth-of-field.toml"), lens, 32);
}

/// Some surfaces absorb everything: their paths end, and cannot have found what others see.
#[test]
fn black_surfaces_share_nothing() {
    let corners = |x: f32, z: f32| Vec3::new(x, 0.0, z);
    let mut builder = SceneBuilder::new();
    let floor = |a: f32, b: f32| polygon(&[corners(a, 3.0), corners(b, 3.0), corners(b, -3.0), corners(a, -3.0)]);
    add(&mut builder, floor(-3.0, 0.0), material(0.0, 0.0));
    add(&mut builder, floor(0.0, 3.0), material(0.7, 0.0));
    let wall = [
        Vec3::new(-3.0, 0.0, -3.0),
        Vec3::new(3.0, 0.0, -3.0),
        Vec3::new(3.0, 3.0, -3.0),
        Vec3::new(-3.0, 3.0, -3.0),
    ];
    add(&mut builder, polygon(&wall), material(0.8, 0.0));
    let lamp = [
        Vec3::new(-1.0, 4.0, -1.0),
        Vec3::new(1.0, 4.0, -1.0),
        Vec3::new(1.0, 4.0, 1.0),
        Vec3::new(-1.0, 4.0, 1.0),
    ];
    add(&mut builder, polygon(&lamp), material(0.0, 5.0));
    let scene = builder.build().unwrap().0;
    let above = pinhole(Vec3::new(0.0, 3.0, 5.0), Vec3::new(0.0, 0.3, -1.0), 40.0);
    assert_unmoved("half of the floor is black", &scene, above, 16);
}

/// A bright closed room, in which a patch of reflectance `rho` covers half of what `looking_at_the_patch` sees.
fn patched_room(rho: f32) -> Scene {
    let mut builder = SceneBuilder::new();
    let square = |y: f32, x: [f32; 2], z: f32| {
        let corner = |x, z| Vec3::new(x, y, z);
        [corner(x[0], z), corner(x[1], z), corner(x[1], -z), corner(x[0], -z)]
    };
    add(&mut builder, room(), material(0.9, 0.0));
    add(
        &mut builder,
        polygon(&square(-0.99, [-0.9, 0.0], 0.9)),
        material(rho, 0.0),
    );
    let mut lamp = square(0.98, [-0.3, 0.3], 0.3);
    lamp.reverse();
    add(&mut builder, polygon(&lamp), material(0.0, 5.0));
    builder.build().unwrap().0
}

fn looking_at_the_patch() -> CameraParameters {
    pinhole(Vec3::new(0.0, 0.5, 0.8), Vec3::new(0.0, -1.0, 0.0), 40.0)
}

/// The paths that leave black surfaces are followed where directions ask for no albedo. Nothing comes of them on their own; what
/// they find is for the neighbours, and must be whole.
#[test]
fn paths_from_black_surfaces_are_whole() {
    assert_unmoved("a black patch", &patched_room(0.0), looking_at_the_patch(), 16);
}

/// Roulette must not end paths for the darkness of the surface that happened to begin them.
#[test]
fn dark_neighbours_do_no_harm() {
    let variance = |reuse| {
        with_world(&patched_room(0.02), looking_at_the_patch(), RESOLUTION, |world| {
            let film = film_of(&path(world, reuse), RESOLUTION, 1024, 0);
            let pixels = film.pixels();
            pixels.map(|(_, a)| a.variance_of_mean(1)).sum::<f64>()
        })
    };
    let ratio = variance(true) / variance(false);
    println!("variance with shared paths: {ratio:.3} of that without");
    assert!(ratio < 0.4, "{ratio}");
}

/// What pixels get from each other is worth many samples, and the variance channel tells what error is left.
#[test]
fn errors_are_smaller_and_known() {
    let scene = own("cornell-box.toml");
    let resolution = UVec2::splat(96);
    let render = |reuse, spp, seed| {
        with_world(&scene, cornell(), resolution, |world| {
            film_of(&path(world, reuse), resolution, spp, seed)
        })
    };
    let image = |film: &Film| RgbImage::from(&film.develop());
    let reference = image(&render(true, 512, 7));
    let error = |film: &Film| Errors::new(&image(film), &reference).unwrap();
    let (alone, shared) = (render(false, 32, 0), render(true, 32, 0));
    let ratio = error(&alone).rel_mse / error(&shared).rel_mse;
    println!("relMSE falls by a factor of {ratio:.2}");
    assert!(ratio > 3.0, "relMSE falls by no more than a factor of {ratio}");

    // Variance as it is told, and as squared differences of two renders show it
    let other = render(true, 32, 1);
    let mut told = 0.0;
    let mut seen = 0.0;
    for (a, b) in shared.tiles().iter().zip(other.tiles()) {
        for ((_, a), (_, b)) in a.iter().zip(b.iter()) {
            told += a.variance_of_mean(1) + b.variance_of_mean(1);
            seen += (a.mean(1) - b.mean(1)).powi(2);
        }
    }
    println!("variance told {told:.4}, seen {seen:.4}");
    assert!((told / seen - 1.0).abs() < 0.15, "variance told {told}, seen {seen}");
}

/// The error by which `--noise` decides is that which pictures of other seeds show; low-discrepancy points are a little better than
/// it says.
#[test]
fn differences_of_blocks_tell_the_error() {
    let scene = own("cornell-box.toml");
    type Render<'a> = &'a dyn Fn(&MaybeReusing<Backend>, UVec2, u64) -> Film;
    let check = |what: &str, width: u32, film: Render, range: std::ops::Range<f64>| {
        let resolution = UVec2::splat(width);
        let films: Vec<Film> = (0..8)
            .map(|seed| {
                with_world(&scene, cornell(), resolution, |world| {
                    film(&path(world, true), resolution, seed)
                })
            })
            .collect();
        let told = films.iter().map(Film::error).sum::<f64>() / films.len() as f64;
        let values: Vec<_> = films.iter().map(means).collect();
        let mut seen = 0.0;
        for c in 0..3 {
            for i in 0..values[0][c].len() {
                let (mean, variance) = mean_of(&values.iter().map(|v| v[c][i]).collect::<Vec<_>>());
                seen += variance * films.len() as f64 / (mean * mean + 0.01);
            }
        }
        seen /= 3.0 * resolution.element_product() as f64;
        println!("{what}: told {told:.3e}, seen {seen:.3e}");
        assert!(range.contains(&(told / seen)), "{what}: told {told}, seen {seen}");
    };
    check(
        "independent",
        96,
        &|integrator, resolution, seed| film_of(integrator, resolution, 128, seed),
        0.93..1.07,
    );
    check(
        "sobol",
        // The range is wide.
        48,
        &|integrator, resolution, seed| film_by(&Sobol::new(seed), integrator, resolution, 128),
        0.95..1.5,
    );
}
