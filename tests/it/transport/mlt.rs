//! Metropolis light transport in path space against closed forms and the path tracer.
#![cfg(feature = "embree")]

use crate::support::statistics::{Mean, assert_same_mean};
use crate::support::*;
use embrasure::camera::CameraParameters;
use embrasure::color::Spectrum;
use embrasure::film::{Film, Rect};
use embrasure::integrator::{
    ImportanceImage, LightIntegrator, Metropolis, MetropolisDirect, MetropolisTarget, PathSpaceIntegrator, Roulette,
    World,
};
use embrasure::material::Material;
use embrasure::math::{UVec2, Vec3};
use embrasure::scene::{Scene, SceneBuilder};

const ALL_LIGHT: Metropolis = Metropolis {
    direct: MetropolisDirect::Metropolis,
    target: MetropolisTarget::Relative,
    chains: None,
    bootstrap: None,
    large_step_probability: 0.3,
    mutation_size: 1.0 / 64.0,
};

fn mlt<'a>(
    world: World<'a, Backend<'a>>,
    max_depth: u32,
    metropolis: Metropolis,
    importance: &'a ImportanceImage,
) -> PathSpaceIntegrator<'a, Backend<'a>> {
    PathSpaceIntegrator {
        world,
        max_depth: Some(max_depth),
        roulette: Roulette::default(),
        light_samples: 1,
        metropolis,
        importance,
    }
}

/// Renders the iterations before index `end`.
fn iterations(world: World<Backend>, (max_depth, metropolis): (u32, Metropolis), seed: u64, end: u32) -> Film {
    let resolution = world.camera.resolution();
    let mut film = Film::new(resolution, Rect::full(resolution));
    let test = rough_picture(world, max_depth);
    let integrator = mlt(world, max_depth, metropolis, &test);
    render_into(&mut film, &integrator, &independent(seed), end);
    film
}

/// Means of channel `c` over the cells of a grid of `cells` × `cells`.
fn regions(film: &Film, cells: u32, c: usize) -> Vec<f64> {
    let size = film.resolution();
    let mut sums = vec![[0.0; 2]; (cells * cells) as usize];
    for (pixel, sums_of_pixel) in film.pixels() {
        let cell = pixel * cells / size;
        let sum = &mut sums[(cell.y * cells + cell.x) as usize];
        *sum = [sum[0] + sums_of_pixel.mean(c), sum[1] + 1.0];
    }
    sums.into_iter().map(|[sum, n]| sum / n).collect()
}

/// Means of regions over independent renders with different seeds, each paired with the mean of
/// `reference`.
fn means_of_regions(films: &[Film], reference: &[Film], cells: u32) -> Vec<[Mean; 2]> {
    let mut all = Vec::new();
    for c in 0..3 {
        let [a, b] = [films, reference]
            .map(|films| -> Vec<Vec<f64>> { films.iter().map(|film| regions(film, cells, c)).collect() });
        for cell in 0..(cells * cells) as usize {
            let of_cell = |films: &[Vec<f64>]| Mean::of(&films.iter().map(|film| film[cell]).collect::<Vec<_>>());
            all.push([of_cell(&a), of_cell(&b)]);
        }
    }
    all
}

/// Asserts that chains and the path tracer agree in all regions of the image, over renders with
/// different seeds.
pub(super) fn agrees(
    what: &str,
    scene: &Scene,
    camera: CameraParameters,
    (depth, direct): (u32, MetropolisDirect),
    spp: u32,
) {
    const SEEDS: u64 = 16;
    let spp = budget(spp);
    with_world(scene, camera, UVec2::splat(16), |world| {
        let metropolis = Metropolis {
            direct,
            bootstrap: Some(96),
            ..ALL_LIGHT
        };
        let films: Vec<Film> = (0..SEEDS)
            .map(|seed| iterations(world, (depth, metropolis), seed, spp))
            .collect();
        let path = path_tracer(world, Some(depth));
        let reference: Vec<Film> = (0..SEEDS)
            .map(|seed| film_of(&path, UVec2::splat(16), 8 * spp, 100 + seed))
            .collect();
        for cells in [1, 4] {
            for [a, b] in means_of_regions(&films, &reference, cells) {
                assert_same_mean(what, a, b);
            }
        }
    });
}

#[test]
fn closed_box_shows_the_geometric_series() {
    let mut b = SceneBuilder::new();
    add(&mut b, room(), material(0.5, 1.0));
    let scene = b.build().unwrap().0;
    let camera = pinhole(Vec3::new(0.1, -0.2, 0.3), Vec3::new(1.0, 0.2, 0.5), 90.0);
    for (direct, depth, expected) in [
        (MetropolisDirect::Metropolis, 0, 1.0),
        (MetropolisDirect::Ordinary, 1, 1.5),
        (MetropolisDirect::Metropolis, 4, 2.0 - 0.5f64.powi(4)),
        (MetropolisDirect::Ordinary, 10, 2.0 - 0.5f64.powi(10)),
    ] {
        let film = with_world(&scene, camera, UVec2::splat(32), |world| {
            iterations(world, (depth, Metropolis { direct, ..ALL_LIGHT }), 3, 128)
        });
        let mean = film_mean(&film, 0);
        println!("{direct:?}, depth {depth}: {mean}, expected {expected}");
        assert!(
            (mean / expected - 1.0).abs() < 0.003,
            "{direct:?}, depth {depth}: {mean}, expected {expected}"
        );
    }
}

/// A sphere that reflects all light is invisible in an environment of uniform radiance 1.
#[test]
fn furnace_is_even() {
    let mut b = SceneBuilder::new();
    add(&mut b, sphere(1.0, Vec3::ZERO, 3), material(1.0, 0.0));
    b.add_constant_light(Spectrum::ONE).unwrap();
    let scene = b.build().unwrap().0;
    let camera = pinhole(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 40.0);
    let film = with_world(&scene, camera, UVec2::splat(32), |world| {
        iterations(world, (4, ALL_LIGHT), 1, 128)
    });
    let mean = film_mean(&film, 0);
    println!("furnace: {mean}");
    assert!((mean - 1.0).abs() < 0.003, "{mean}");
    let regions = regions(&film, 4, 0);
    assert!(regions.iter().all(|mean| (mean - 1.0).abs() < 0.15), "{regions:.3?}");
}

#[test]
fn cornell_box_agrees_with_paths() {
    let camera = pinhole(Vec3::new(278.0, 273.0, -800.0), Vec3::new(278.0, 273.0, 0.0), 39.0);
    let scene = own("cornell-box.toml");
    agrees("cornell", &scene, camera, (6, MetropolisDirect::Ordinary), 48);
    agrees(
        "cornell, all light",
        &scene,
        camera,
        (6, MetropolisDirect::Metropolis),
        48,
    );
}

/// A scene with every kind of lobe, seen through a lens.
#[test]
fn every_lobe_agrees_with_paths() {
    let camera = CameraParameters {
        lens_radius: 0.05,
        ..pinhole(Vec3::new(0.0, 0.1, 0.95), Vec3::new(0.0, -0.3, -1.0), 80.0)
    };
    agrees("lobes", &lobes_room(), camera, (5, MetropolisDirect::Ordinary), 48);
}

#[test]
fn light_through_glass_agrees_with_paths() {
    agrees(
        "glass",
        &glazed_room(),
        in_glazed_room(),
        (5, MetropolisDirect::Metropolis),
        48,
    );
}

/// Point, spot, directional and constant lights, and a wall with opacity below 1.
#[test]
fn all_light_types_agree_with_paths() {
    let mut b = SceneBuilder::new();
    let floor = polygon(&[
        Vec3::new(-2.0, 0.0, -2.0),
        Vec3::new(-2.0, 0.0, 2.0),
        Vec3::new(2.0, 0.0, 2.0),
        Vec3::new(2.0, 0.0, -2.0),
    ]);
    add(&mut b, floor, material(0.6, 0.0));
    add(&mut b, sphere(0.5, Vec3::new(0.3, 0.5, 0.0), 2), material(0.7, 0.0));
    let veil = Material {
        opacity: 0.4,
        ..material(0.5, 0.0)
    };
    let wall = polygon(&[
        Vec3::new(-1.0, 0.0, -0.4),
        Vec3::new(0.2, 0.0, -0.8),
        Vec3::new(0.2, 1.6, -0.8),
        Vec3::new(-1.0, 1.6, -0.4),
    ]);
    add(&mut b, wall, veil);
    b.add_constant_light(Spectrum::rgb(0.3, 0.4, 0.5)).unwrap();
    b.add_directional_light(Vec3::new(0.5, -1.0, 0.6), Spectrum::splat(1.0))
        .unwrap();
    b.add_point_light(Vec3::new(-0.8, 1.5, 0.8), Spectrum::splat(1.0))
        .unwrap();
    b.add_spot_light(
        Vec3::new(1.0, 1.5, 1.0),
        Vec3::new(-0.6, -1.0, -0.7),
        Spectrum::splat(2.0),
        40.0,
        30.0,
    )
    .unwrap();
    let scene = b.build().unwrap().0;
    let camera = pinhole(Vec3::new(0.0, 1.2, 2.6), Vec3::new(0.0, 0.5, 0.0), 50.0);
    agrees("lights", &scene, camera, (4, MetropolisDirect::Ordinary), 48);
    agrees(
        "lights, all light",
        &scene,
        camera,
        (4, MetropolisDirect::Metropolis),
        48,
    );
}

/// A lamp behind a wall lights a room only through a slit below the wall. Each render finds all of
/// this light exactly once.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn light_through_a_gap_is_found_by_each_seed() {
    const SEEDS: u64 = 20;
    let mut b = SceneBuilder::new();
    add(&mut b, room(), material(0.7, 0.0));
    // A wall across the room with a slit at the floor. The lamp behind it faces away.
    let wall = polygon(&[
        Vec3::new(-1.0, -0.7, 0.0),
        Vec3::new(1.0, -0.7, 0.0),
        Vec3::new(1.0, 1.0, 0.0),
        Vec3::new(-1.0, 1.0, 0.0),
    ]);
    add(&mut b, wall, material(0.7, 0.0));
    let lamp = polygon(&[
        Vec3::new(-0.3, 0.0, -0.5),
        Vec3::new(-0.3, 0.6, -0.5),
        Vec3::new(0.3, 0.6, -0.5),
        Vec3::new(0.3, 0.0, -0.5),
    ]);
    add(&mut b, lamp, material(0.0, 10.0));
    let scene = b.build().unwrap().0;
    let camera = pinhole(Vec3::new(0.0, 0.3, 0.9), Vec3::new(0.0, -0.3, 0.0), 80.0);
    with_world(&scene, camera, UVec2::splat(16), |world| {
        let metropolis = Metropolis {
            bootstrap: Some(256),
            ..Metropolis::default()
        };
        let films: Vec<Film> = (0..SEEDS)
            .map(|seed| iterations(world, (6, metropolis), seed, budget(320)))
            .collect();
        let path = path_tracer(world, Some(6));
        let reference: Vec<Film> = (0..16)
            .map(|seed| film_of(&path, UVec2::splat(16), budget(1024), 100 + seed))
            .collect();
        let of =
            |films: &[Film], cells| -> Vec<Vec<f64>> { films.iter().map(|film| regions(film, cells, 1)).collect() };
        let mean = |films: &[Vec<f64>], cell: usize| films.iter().map(|f| f[cell]).sum::<f64>() / films.len() as f64;
        let ratio = mean(&of(&films, 1), 0) / mean(&of(&reference, 1), 0);
        let [a, b] = means_of_regions(&films, &reference, 1)[1];
        assert_same_mean("gap", a, b);
        let error = a.error().hypot(b.error()) / b.value;
        assert!(error < 0.0036 * slack(), "{ratio} ± {error}: the error is too large");
        let (found, expected) = (of(&films, 4), of(&reference, 4));
        for cell in 0..16 {
            let expected = mean(&expected, cell);
            let missing = found.iter().filter(|film| film[cell] < 0.3 * expected).count();
            assert_eq!(missing, 0, "region {cell} of mean {expected}");
        }
        for [a, b] in means_of_regions(&films, &reference, 4) {
            assert_same_mean("gap", a, b);
        }
    });
}

/// Each iteration depends only on its index. The number of threads and the parts of a render
/// therefore change no bit of the image.
#[test]
fn threads_change_no_bit() {
    let scene = lobes_room();
    let camera = pinhole(Vec3::new(0.0, 0.1, 0.95), Vec3::new(0.0, -0.3, -1.0), 80.0);
    let render = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            with_world(&scene, camera, UVec2::splat(24), |world| {
                iterations(world, (5, ALL_LIGHT), 9, 3)
            })
        })
    };
    let bits = |film: &Film| -> Vec<[u64; 3]> {
        film.pixels()
            .map(|(_, sums)| [0, 1, 2].map(|c| sums.mean(c).to_bits()))
            .collect()
    };
    assert_eq!(bits(&render(1)), bits(&render(3)));
}

/// Shading normals are strongly bent, so a camera path may hit the triangle that it has left.
/// Chains and light tracing do not find the light of such paths.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn bent_normals_agree_with_light_tracing() {
    let (scene, camera) = tilted_room();
    with_world(&scene, camera, UVec2::splat(16), |world| {
        let seeds = 0..16;
        let films: Vec<Film> = seeds
            .clone()
            .map(|seed| iterations(world, (3, ALL_LIGHT), seed, 24))
            .collect();
        let light = LightIntegrator {
            world,
            max_depth: Some(3),
            roulette: Roulette::default(),
        };
        let reference: Vec<Film> = seeds
            .map(|seed| film_of_iterations(&light, UVec2::splat(16), 96, 50 + seed))
            .collect();
        for [a, b] in means_of_regions(&films, &reference, 2) {
            assert_same_mean("bent normals", a, b);
        }
    });
}
