//! Path reuse between pixels: the same means with less error.
#![cfg(feature = "embree")]

use crate::support::statistics::{Mean, assert_same_mean};
use crate::support::*;
use embrasure::bsdf::Fresnel;
use embrasure::camera::CameraParameters;
use embrasure::color::Spectrum;
use embrasure::compare::Errors;
use embrasure::film::{Film, RgbImage};
use embrasure::geometry::Mesh;
use embrasure::integrator::*;
use embrasure::material::{Gloss, Material};
use embrasure::math::{UVec2, Vec3};
use embrasure::scene::{Scene, SceneBuilder};

/// The image has one whole tile, and parts of three other tiles.
const RESOLUTION: UVec2 = UVec2::new(21, 18);
const SEEDS: u64 = 32;

fn path<'a>(world: World<'a, Backend<'a>>, reuse: bool) -> PathTracer<'a> {
    let path = PathIntegrator {
        light_samples: 2,
        ..path_tracer(world, Some(6))
    };
    PathTracer { path, reuse }
}

fn cornell() -> CameraParameters {
    pinhole(Vec3::new(278.0, 273.0, -800.0), Vec3::new(278.0, 273.0, 0.0), 39.0)
}

/// Pixel means of the film, channel 0 first.
fn means(film: &Film) -> [Vec<f64>; 3] {
    let pixels: Vec<_> = film.pixels().map(|(_, a)| a).collect();
    [0, 1, 2].map(|c| pixels.iter().map(|a| a.mean(c)).collect())
}

/// Asserts that renders by `integrator` have the means of `reference`, for the whole image and
/// pixel by pixel. Pixels of one film have correlated errors. Films with different seeds are
/// independent, so means and variances are computed over seeds.
fn assert_same(what: &str, integrator: &PathTracer, reference: &Film, spp: u32) {
    let films: Vec<_> = (0..SEEDS)
        .map(|seed| means(&film_of(integrator, RESOLUTION, budget(spp), 100 + seed)))
        .collect();
    let reference: Vec<_> = reference.pixels().map(|(_, a)| a).collect();
    for c in 0..3 {
        // Compare the whole image
        let pictures: Vec<f64> = films.iter().map(|f| f[c].iter().sum::<f64>()).collect();
        let expected: f64 = reference.iter().map(|a| a.mean(c)).sum();
        let expected_variance: f64 = reference.iter().map(|a| a.variance_of_mean(c)).sum();
        let expected = Mean::new(expected, expected_variance.sqrt());
        assert_same_mean(format!("{what}, channel {c}"), Mean::of(&pictures), expected);
        // Compare pixel by pixel. 32 values have the heavier tails of Student's t distribution:
        // P(|t| > 5.5) is 5e-6.
        let mut beyond = 0;
        for (i, expected) in reference.iter().enumerate() {
            let mean = Mean::of(&films.iter().map(|f| f[c][i]).collect::<Vec<_>>());
            let allowed = 5.5 * (mean.variance + expected.variance_of_mean(c)).sqrt() + 1e-6;
            beyond += usize::from((mean.value - expected.mean(c)).abs() > allowed);
        }
        let share = beyond as f64 / reference.len() as f64;
        assert!(share <= 0.003, "{what}: {beyond} pixels of channel {c} differ");
    }
}

/// Asserts that path reuse does not change any mean, for any direction sampling, light sampling and
/// path termination.
fn assert_unmoved(what: &str, scene: &Scene, camera: CameraParameters, spp: u32) {
    with_world(scene, camera, RESOLUTION, |world| assert_unmoved_in(what, world, spp));
}

fn assert_unmoved_in(what: &str, world: World<Backend>, spp: u32) {
    let reference = film_of(&path(world, false), RESOLUTION, 2 * SEEDS as u32 * budget(spp), 0);
    let best = path(world, true);
    assert_same(what, &best, &reference, spp);
    // Paths that pixels share do not end before their second vertex, even if roulette starts at the
    // first vertex.
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
fn path_reuse_keeps_means() {
    assert_unmoved("cornell-box", &own("cornell-box.toml"), cornell(), 16);
    let inside = pinhole(Vec3::new(0.4, 0.3, 0.6), Vec3::new(-1.0, -1.0, -1.0), 60.0);
    assert_unmoved("closed-box", &own("closed-box.toml"), inside, 16);
    // Use every lobe, so that some paths can be shared and others cannot.
    let inside = pinhole(Vec3::new(0.0, 0.1, 0.95), Vec3::new(0.0, -0.3, -1.0), 80.0);
    assert_unmoved("lobes", &lobes_room(), inside, 16);
    assert_unmoved("glass", &glazed_room(), in_glazed_room(), 16);
    // Use dissimilar pixels: a lens, a point light, the horizon.
    let lens = CameraParameters {
        lens_radius: 0.18,
        focus_distance: 7.45,
        ..pinhole(Vec3::new(0.0, 2.2, 7.4), Vec3::new(0.0, 0.85, 0.0), 31.0)
    };
    assert_unmoved("depth-of-field", &own("depth-of-field.toml"), lens, 32);
}

/// Asserts that path reuse does not change any mean in a room with `walls`, seen from a corner,
/// with a lamp and the objects of `furnish`. Directions follow the BSDF. With cosine sampling,
/// samples of narrow lobes would have too long a tail for tests with 32 seeds.
fn assert_unmoved_between(what: &str, walls: Material, furnish: impl FnOnce(&mut SceneBuilder)) {
    let mut builder = SceneBuilder::new();
    add(&mut builder, room(), walls);
    let lamp = [[-0.4, -0.4], [0.4, -0.4], [0.4, 0.4], [-0.4, 0.4]].map(|[x, z]| Vec3::new(x, 0.98, z));
    add(&mut builder, polygon(&lamp), material(0.0, 5.0));
    furnish(&mut builder);
    let scene = builder.build().unwrap().0;
    let inside = pinhole(Vec3::new(0.8, 0.3, 0.8), Vec3::new(-0.6, -0.4, -0.6), 65.0);
    with_world(&scene, inside, RESOLUTION, |world| {
        let path = |reuse| {
            let mut path = path(world, reuse);
            path.path.max_depth = None;
            path
        };
        let reference = film_of(&path(false), RESOLUTION, budget(1024), 0);
        assert_same(what, &path(true), &reference, 16);
    });
}

/// A material as exporters write it: a diffuse base of reflectance `base` under a rough dielectric
/// coat, or a metal.
fn coated(base: f32, roughness: f32, metallic: f32) -> Material {
    Material {
        specular: Spectrum::ONE,
        gloss: Gloss::Metallic(metallic),
        roughness,
        ..material(base, 0.0)
    }
}

/// Vertices that pixels share have every kind of glossy BSDF. They scatter different light to each
/// pixel.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn glossy_shared_vertices_keep_means() {
    assert_unmoved_between("coats", coated(0.7, 0.5, 0.0), |_| ());
    assert_unmoved_between("metals", coated(0.7, 0.5, 1.0), |_| ());
    let layered = Material {
        sheen: Spectrum::splat(0.5),
        clearcoat: 1.0,
        clearcoat_roughness: 0.3,
        ..coated(0.6, 0.6, 0.3)
    };
    assert_unmoved_between("layers", layered, |_| ());
    // The light comes from a sky through a half-open ceiling, and from a lamp
    let mut builder = SceneBuilder::new();
    let wall = |corners: [[f32; 3]; 4]| polygon(&corners.map(Vec3::from));
    let floor = [
        [-1.0, -1.0, 1.0],
        [1.0, -1.0, 1.0],
        [1.0, -1.0, -1.0],
        [-1.0, -1.0, -1.0],
    ];
    add(&mut builder, wall(floor), coated(0.7, 0.5, 0.0));
    let back = [
        [-1.0, -1.0, -1.0],
        [1.0, -1.0, -1.0],
        [1.0, 1.0, -1.0],
        [-1.0, 1.0, -1.0],
    ];
    add(&mut builder, wall(back), coated(0.7, 0.6, 1.0));
    let side = [
        [-1.0, -1.0, 1.0],
        [-1.0, -1.0, -1.0],
        [-1.0, 1.0, -1.0],
        [-1.0, 1.0, 1.0],
    ];
    add(&mut builder, wall(side), coated(0.5, 0.4, 0.0));
    add(
        &mut builder,
        sphere(0.4, Vec3::new(0.2, -0.6, -0.2), 2),
        material(0.8, 0.0),
    );
    add(
        &mut builder,
        sphere(0.1, Vec3::new(0.6, 0.6, 0.4), 2),
        material(0.0, 8.0),
    );
    builder.add_constant_light(Spectrum::rgb(0.6, 0.8, 1.0)).unwrap();
    let scene = builder.build().unwrap().0;
    let outside = pinhole(Vec3::new(1.6, 0.8, 2.2), Vec3::new(-0.2, -0.4, -0.3), 45.0);
    assert_unmoved("coats under a sky", &scene, outside, 16);
    // Light of a delta lobe beside a diffuse lobe counts only for the pixel that traced the path.
    let polished = Material {
        specular: Spectrum::ONE,
        gloss: Gloss::Mirror(Fresnel::Dielectric { eta: 1.8 }),
        ..material(0.6, 0.0)
    };
    assert_unmoved_between("polish", polished, |_| ());
    let phong = Material {
        specular: Spectrum::splat(0.4),
        gloss: Gloss::Phong(8.0),
        ..material(0.4, 0.0)
    };
    assert_unmoved_between("Phong lobes", phong, |_| ());
}

/// Vertices that pixels share are on surfaces with varying normals, transmission, or an opacity
/// below 1.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn shared_vertices_on_any_surface_keep_means() {
    assert_unmoved_between("rough glass", coated(0.6, 0.5, 0.0), |builder| {
        let glass = Material {
            transmission: Spectrum::splat(0.95),
            roughness: 0.6,
            ior: 1.5,
            ..material(0.0, 0.0)
        };
        add(builder, sphere(0.5, Vec3::new(-0.1, -0.4, -0.1), 3), glass);
    });
    assert_unmoved_between("bent normals", coated(0.6, 0.5, 0.0), |builder| {
        // A flat floor with the normals of waves
        let at = |i: u32| -0.95 + 0.1 * i as f32;
        let mut floor = Mesh::default();
        for (i, j) in (0..20).flat_map(|i| (0..20).map(move |j| (i, j))) {
            floor.positions.push(Vec3::new(at(i), -0.9, at(j)));
            let wave = |k: u32| 0.8 * (1.3 * k as f32).sin();
            floor.normals.push(Vec3::new(wave(i), 1.0, wave(j + 1)).normalize());
        }
        for (i, j) in (0..19).flat_map(|i| (0..19).map(move |j| (i, j))) {
            let corner = 20 * i + j;
            floor.triangles.push([corner, corner + 1, corner + 21]);
            floor.triangles.push([corner, corner + 21, corner + 20]);
        }
        add(builder, floor, coated(0.5, 0.5, 0.5));
    });
    assert_unmoved_between("holes", coated(0.6, 0.5, 0.0), |builder| {
        let veil = Material {
            opacity: 0.4,
            ..coated(0.8, 0.6, 0.0)
        };
        let corners = [[-0.9, -0.5], [0.3, -0.5], [0.3, 0.6], [-0.9, 0.6]];
        add(builder, polygon(&corners.map(|[x, y]| Vec3::new(x, y, -0.3))), veil);
    });
}

/// A veil lies between the first and the second vertex of all paths that pixels of the floor share.
/// The densities of these paths include the probability that a ray passes the veil.
#[test]
fn shared_paths_through_a_veil_keep_means() {
    assert_unmoved_between("veil", material(0.7, 0.0), |builder| {
        let veil = Material {
            opacity: 0.5,
            ..material(0.0, 0.0)
        };
        let corners = [[-0.98, -0.98], [-0.98, 0.98], [0.98, 0.98], [0.98, -0.98]];
        add(builder, polygon(&corners.map(|[x, z]| Vec3::new(x, -0.8, z))), veil);
    });
}

/// If a pixel shows a mirror or glass, its first vertex for path reuse is on the surface that the
/// mirror or glass shows.
#[test]
fn first_vertices_behind_mirrors_keep_means() {
    assert_unmoved_between("mirror and glass", coated(0.6, 0.5, 0.0), |builder| {
        let mirror = Material {
            specular: Spectrum::splat(0.9),
            gloss: Gloss::Mirror(Fresnel::Full),
            ..material(0.0, 0.0)
        };
        let corners = [[-0.9, -0.9], [0.9, -0.9], [0.9, 0.7], [-0.9, 0.7]];
        add(builder, polygon(&corners.map(|[x, y]| Vec3::new(x, y, -0.97))), mirror);
        let glass = Material {
            transmission: Spectrum::ONE,
            ior: 1.5,
            ..material(0.0, 0.0)
        };
        add(builder, sphere(0.35, Vec3::new(-0.3, -0.5, -0.1), 3), glass);
    });
}

/// Paths from black surfaces end, so they find no light that other pixels could reuse.
#[test]
fn black_surfaces_keep_means() {
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

/// A bright closed room. A patch of reflectance `rho` covers half of the view of
/// `looking_at_the_patch`.
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

/// If direction sampling needs no albedo, paths that leave black surfaces continue. They add no
/// light to their own pixel, but neighbouring pixels reuse them, so these paths must be complete.
#[test]
fn paths_from_black_surfaces_keep_means() {
    assert_unmoved("a black patch", &patched_room(0.0), looking_at_the_patch(), 16);
}

/// Roulette must not end a path because the first surface of the path is dark.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn dark_neighbours_do_not_add_variance() {
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

/// Path reuse reduces the error as much as many more samples would. The variance channel contains
/// the remaining error.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn path_reuse_reduces_the_reported_error() {
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

    // Compare the reported variance with squared differences of two renders
    let other = render(true, 32, 1);
    let mut told = 0.0;
    let mut seen = 0.0;
    for (a, b) in shared.tiles().iter().zip(other.tiles()) {
        for ((_, a), (_, b)) in a.read().iter().zip(b.read().iter()) {
            told += a.variance_of_mean(1) + b.variance_of_mean(1);
            seen += (a.mean(1) - b.mean(1)).powi(2);
        }
    }
    println!("variance told {told:.4}, seen {seen:.4}");
    assert!((told / seen - 1.0).abs() < 0.15, "variance told {told}, seen {seen}");
}

/// The error estimate of `--noise` matches the spread over seeds. With low-discrepancy points, the
/// true error is a little smaller than the estimate.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn reported_error_matches_spread_of_seeds() {
    let scene = own("cornell-box.toml");
    type Render<'a> = &'a dyn Fn(&PathTracer, UVec2, u64) -> Film;
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
        let floor = films.iter().map(Film::error_floor).sum::<f64>() / films.len() as f64;
        let values: Vec<_> = films.iter().map(means).collect();
        let mut seen = 0.0;
        for c in 0..3 {
            for i in 0..values[0][c].len() {
                let Mean {
                    value: mean, variance, ..
                } = Mean::of(&values.iter().map(|v| v[c][i]).collect::<Vec<_>>());
                seen += variance * films.len() as f64 / (mean * mean + floor * floor);
            }
        }
        seen /= 3.0 * resolution.element_product() as f64;
        println!("{what}: told {told:.3e}, seen {seen:.3e}");
        assert!(range.contains(&(told / seen)), "{what}: told {told}, seen {seen}");
    };
    check(
        "independent",
        64,
        &|integrator, resolution, seed| film_of(integrator, resolution, 128, seed),
        0.93..1.07,
    );
    check(
        "sobol",
        // The allowed range is wide, so fewer renders suffice.
        48,
        &|integrator, resolution, seed| film_by(&sobol(seed), integrator, resolution, 128),
        0.95..1.5,
    );
}
