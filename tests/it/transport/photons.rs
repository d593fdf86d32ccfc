//! Photon mapping: power of photons against closed forms, and images against the path tracer. The
//! number of threads and the parts of a render change no bit of the image.
#![cfg(feature = "embree")]

use crate::support::program::{assert_same_bits, done, folder};
use crate::support::statistics::{Mean, assert_all_means_within, assert_same_mean};
use crate::support::*;
use embrasure::camera::CameraParameters;
use embrasure::color::Spectrum;
use embrasure::compare::Errors;
use embrasure::film::{Film, Rect, RgbImage};
use embrasure::geometry::Placement;
use embrasure::integrator::*;
use embrasure::material::Material;
use embrasure::math::{UVec2, Vec3, affine_from_trs};
use embrasure::pipeline::CompiledIntegrator;
use embrasure::render::{RayCounts, photon_maps};
use embrasure::sampler::Independent;
use embrasure::scene::{Scene, SceneBuilder};
use std::f64::consts::PI;
use std::path::Path;

/// Photons of paths with at most `max_depth` scatterings, including photons that come straight from
/// lights.
fn photons_of(scene: &Scene, paths: u32, max_depth: u32) -> Vec<Photon> {
    let camera = pinhole(Vec3::ZERO, Vec3::NEG_Z, 60.0);
    with_world(scene, camera, UVec2::ONE, |world| {
        let tracer = PhotonTracer {
            world,
            max_depth: Some(max_depth),
            roulette: Roulette::default(),
            min_scatterings: 0,
        };
        let work_items = (0..PhotonTracer::<Backend>::work_items(paths)).flat_map(|index| {
            let mut rays = RayCounts::default();
            let item = PhotonWorkItem {
                iteration: 0,
                index,
                paths,
            };
            tracer.work_item(item, None, &mut Independent::new(5), &mut rays)
        });
        work_items.collect()
    })
}

/// Conservation of flux: in a closed room, the photons before any scattering carry the power of all
/// lights.
#[test]
fn photons_carry_the_power_of_lights() {
    let (intensity, emission) = (3.0, 5.0);
    let mut b = SceneBuilder::new();
    add(&mut b, room(), material(0.5, 0.0));
    // Square light of half width 0.25 in front of the wall, facing +z
    add(&mut b, panel(-0.9, 0.25), material(0.0, emission));
    b.add_point_light(Vec3::new(0.1, 0.2, 0.3), Spectrum::splat(intensity))
        .unwrap();
    let (scene, _) = b.build().unwrap();
    let paths = 20_000;
    let photons = photons_of(&scene, paths, 3);
    let sum = |scatterings: u16| -> f64 {
        let first = photons.iter().filter(|p| p.scatterings == scatterings);
        first.map(|p| p.power().mean() as f64).sum::<f64>() / paths as f64
    };
    let expected = 4.0 * PI * intensity as f64 + PI * emission as f64 * 0.25;
    // Lights are sampled in proportion to their power, so each path carries the total power.
    assert!((sum(0) / expected - 1.0).abs() < 1e-3, "{} {expected}", sum(0));
    // Each scattering keeps half of the power. Photons that hit the black lamp are lost, but the
    // lamp has less than 1 % of the area.
    for (scatterings, share) in [(1, 0.5), (2, 0.25)] {
        let ratio = sum(scatterings) / (share * expected);
        assert!((0.95..1.02).contains(&ratio), "{scatterings}: {ratio}");
    }
    assert!(photons.iter().all(|p| p.scatterings < 3));
}

/// Irradiance of a point light on a plane, `I cos θ / d²`, in rings. z-tests are valid, because all
/// photons have the same power.
#[test]
fn photon_density_matches_irradiance() {
    let (intensity, height) = (2.0, 0.7);
    let mut b = SceneBuilder::new();
    add(&mut b, panel(0.0, 50.0), material(0.5, 0.0));
    b.add_point_light(Vec3::new(0.0, 0.0, height as f32), Spectrum::splat(intensity))
        .unwrap();
    let (scene, _) = b.build().unwrap();
    let paths = 100_000;
    let photons = photons_of(&scene, paths, 1);
    let power = 4.0 * PI * intensity as f64;
    for (inner, outer) in [(0.0, 0.2), (0.2, 0.5), (0.5, 1.0), (1.0, 3.0), (3.0, 20.0)] {
        let within = |p: &&Photon| (inner..outer).contains(&(p.p().truncate().length() as f64));
        let n = photons.iter().filter(within).count();
        // Fraction of the sphere around the light that is covered by a disk of radius `r`
        let share = |r: f64| 0.5 * (1.0 - height / (height * height + r * r).sqrt());
        let expected = paths as f64 * (share(outer) - share(inner));
        assert_same_mean(
            format!("{inner}..{outer}"),
            Mean::of_events(n, expected),
            Mean::exact(expected),
        );
        let one = photons.iter().find(within).unwrap();
        assert!((one.power().mean() as f64 / power - 1.0).abs() < 1e-4);
    }
}

/// Progressive photon mapping with the search radius `radius` in the first iteration, and with the
/// parameter `alpha` that reduces the radius.
fn progressive<A>(world: World<A>, (radius, alpha): (f32, f32), max_depth: u32) -> ProgressivePhotonIntegrator<A> {
    ProgressivePhotonIntegrator {
        world,
        strategy: Strategy::default(),
        max_depth: Some(max_depth),
        roulette: Roulette::default(),
        photons: None,
        radius: ProgressiveRadius {
            first: SearchRadius::Fixed(radius),
            alpha,
        },
    }
}

/// Vertex connection and merging with search radius `radius`.
fn merging<A>(world: World<A>, radius: f32, max_depth: u32) -> VertexMergingIntegrator<A> {
    VertexMergingIntegrator {
        world,
        heuristic: Heuristic::Power,
        max_depth: Some(max_depth),
        roulette: Roulette::default(),
        photons: Some(1000),
        radius: ProgressiveRadius {
            first: SearchRadius::Fixed(radius),
            alpha: 1.0,
        },
    }
}

fn iterations(integrator: &dyn CompiledIntegrator, resolution: UVec2, count: u32, seed: u64) -> Film {
    let mut film = Film::new(resolution, Rect::full(resolution));
    render_into(&mut film, integrator, &independent(seed), count);
    film
}

/// Photon mapping with `paths` paths.
fn mapped(world: World<Backend>, resolution: UVec2, paths: u32, max_depth: u32, spp: u32, seed: u64) -> Film {
    let tracer = PhotonTracer {
        world,
        max_depth: Some(max_depth),
        roulette: Roulette::default(),
        min_scatterings: 0,
    };
    let (maps, _) = photon_maps(&tracer, paths, &Independent::new(seed), &()).unwrap();
    let integrator = PhotonMapIntegrator {
        world,
        maps: &maps,
        strategy: Strategy::default(),
        max_depth: Some(max_depth),
        roulette: Roulette::default(),
        photon_count: 50,
        radius: None,
        gather_rays: 4,
    };
    film_of(&integrator, resolution, spp, seed)
}

/// Photons are used only at surfaces of the same time. An emitting room moves by a quarter of its
/// width while the shutter is open. It is as bright as a still room.
#[test]
fn moving_room_is_as_bright_as_a_still_room() {
    let mean = |way: f32, seed: u64| {
        let mut b = SceneBuilder::new();
        let id = b.add_material(material(0.5, 1.0)).unwrap();
        let prototype = b.add_prototype(vec![(room(), id)]).unwrap();
        let steps = [0.0, way].map(|x| affine_from_trs(Vec3::new(x, 0.0, 0.0), Vec3::ZERO, Vec3::ONE));
        let placement = match way {
            0.0 => Placement::Still(steps[0]),
            _ => Placement::Moving(steps.into()),
        };
        b.add_instance(prototype, placement).unwrap();
        let scene = b.build().unwrap().0;
        // The image shows two walls: the room moves along one of them, and away from the other.
        let camera = pinhole(Vec3::new(0.4, 0.1, 0.2), Vec3::new(1.5, 0.0, -0.4), 70.0);
        let resolution = UVec2::splat(8);
        with_world(&scene, camera, resolution, |world| {
            film_mean(&mapped(world, resolution, 1 << 16, 3, 16, seed), 1)
        })
    };
    let mean_of = |way: f32| (0..4).map(|seed| mean(way, seed)).sum::<f64>() / 4.0;
    let (still, moving) = (mean_of(0.0), mean_of(0.5));
    println!("still {still}, moving {moving}");
    assert!((still - 1.875).abs() < 0.06, "{still}");
    assert!((moving / still - 1.0).abs() < 0.02, "{moving}, not {still}");
}

/// A convex body reflects all light in uniform light. No scattered photon hits the body again, so
/// photon mapping has no bias.
#[test]
fn the_furnace_has_no_bias() {
    let scene = own("furnace.toml");
    let camera = pinhole(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 40.0);
    let resolution = UVec2::splat(16);
    with_world(&scene, camera, resolution, |world| {
        let film = iterations(&progressive(world, (0.05, 2.0 / 3.0), 6), resolution, 64, 1);
        assert_unbiased("sppm in the furnace", &film, 1.0);
        let film = iterations(&merging(world, 0.05, 6), resolution, 64, 4);
        // VCM also merges photons that come straight from the light, and the body consists of flat
        // triangles.
        let (mean, error) = (film_mean(&film, 0), film_error(&film, 0));
        println!("vcm in the furnace: mean {mean} ± {error}");
        assert!((mean - 1.0).abs() < 0.02, "vcm in the furnace: {mean}");
        let film = mapped(world, resolution, 1000, 6, 32, 2);
        assert_unbiased("photon-map in the furnace", &film, 1.0);
    });
}

/// The closed box has the radiance 2 everywhere. A density estimate loses the part of its disk that
/// is beyond an edge of the box. The camera looks into a corner of a room of width 2. There the
/// mean is smaller than 2 by about the search radius. Photon mapping with final gathering loses
/// less.
#[test]
fn closed_box_loses_light_at_edges_only() {
    let scene = own("closed-box.toml");
    let camera = pinhole(Vec3::new(0.4, 0.3, 0.6), Vec3::splat(-1.0), 60.0);
    let resolution = UVec2::splat(16);
    let depth = 30;
    with_world(&scene, camera, resolution, |world| {
        for (radius, bound) in [(0.1, 0.05), (0.02, 0.01)] {
            let integrator = ProgressivePhotonIntegrator {
                photons: Some(2000),
                ..progressive(world, (radius, 1.0), depth)
            };
            let film = iterations(&integrator, resolution, 64, 3);
            let (mean, error) = (film_mean(&film, 0), film_error(&film, 0));
            println!("sppm, radius {radius}: {mean} ± {error}");
            assert!(
                (2.0 * (1.0 - bound)..2.0 + 4.0 * error).contains(&mean),
                "{radius}: {mean} ± {error}"
            );
        }
        let film = mapped(world, resolution, 40_000, depth, 16, 4);
        let mean = film_mean(&film, 0);
        println!("photon-map: {mean}");
        assert!((1.94..2.02).contains(&mean), "{mean}");
    });
}

fn cornell() -> CameraParameters {
    pinhole(Vec3::new(278.0, 273.0, -800.0), Vec3::new(278.0, 273.0, 0.0), 39.0)
}

fn image(film: &Film) -> RgbImage {
    let size = film.resolution();
    RgbImage {
        width: size.x as usize,
        height: size.y as usize,
        pixels: film
            .pixels()
            .map(|(_, a)| [0, 1, 2].map(|c| a.mean(c) as f32))
            .collect(),
    }
}

/// The variance of n iterations falls as n^−α, and the squared bias as n^(2α − 2). At α = 2/3 both
/// fall equally (Knaus and Zwicker 2011, eqs. 14 and 17). Errors of direct light, which fall as
/// 1/n, and photons at edges make the slope steeper. With a fixed radius, the bias of the first
/// iteration remains.
#[test]
fn errors_shrink_as_iterations_are_added() {
    let scene = own("cornell-box.toml");
    let resolution = UVec2::splat(24);
    with_world(&scene, cornell(), resolution, |world| {
        let reference = film_of(&path_tracer(world, Some(5)), resolution, 1000, 1);
        let of = |alpha| ProgressivePhotonIntegrator {
            photons: Some(4000),
            ..progressive(world, (60.0, alpha), 5)
        };
        let error = |film: &Film| Errors::new(&image(film), &image(&reference)).unwrap().rel_mse;
        let shrinks = of(2.0 / 3.0);
        let few = |seed| error(&iterations(&shrinks, resolution, 4, seed));
        let few = (10..14).map(few).sum::<f64>() / 4.0;
        let film = iterations(&shrinks, resolution, 128, 20);
        let many = error(&film);
        let slope = (many / few).ln() / 32f64.ln();
        println!("relMSE {few} of 4 iterations, {many} of 128: exponent {slope}");
        assert!((-1.05..-0.5).contains(&slope), "{few} {many}: {slope}");

        // Both films use the same photons, so they have the same noise, which moves means by 0.5 %.
        let bias = |film: &Film| film_mean(film, 0) / film_mean(&reference, 0) - 1.0;
        let (stays, shrinks) = (bias(&iterations(&of(1.0), resolution, 128, 20)), bias(&film));
        println!("bias of the mean {stays} at the first radius, {shrinks} with radii that shrink");
        assert!((-0.04..0.0).contains(&stays), "{stays}");
        assert!((0.004..0.02).contains(&(shrinks - stays)), "{shrinks} {stays}");
    });
}

/// Means of blocks of 4 × 4 pixels of a channel.
fn blocks(film: &Film, c: usize) -> Vec<Mean> {
    let size = film.resolution().x as usize;
    let pixels: Vec<(f64, f64)> = film.pixels().map(|(_, a)| (a.mean(c), a.variance_of_mean(c))).collect();
    let block = |x: usize, y: usize| {
        let at = |i: usize| pixels[(4 * y + i / 4) * size + 4 * x + i % 4];
        let sum = (0..16).map(at).fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
        Mean::new(sum.0 / 16.0, sum.1.sqrt() / 16.0)
    };
    (0..size / 4)
        .flat_map(|y| (0..size / 4).map(move |x| (x, y)))
        .map(|(x, y)| block(x, y))
        .collect()
}

/// Asserts that each block differs from the path tracer by at most noise plus the fraction `bias`
/// of the mean of the block.
fn assert_same_blocks(what: &str, film: &Film, reference: &Film, bias: f64) {
    let pairs: Vec<_> = [0, 1, 2]
        .iter()
        .flat_map(|&c| blocks(film, c).into_iter().zip(blocks(reference, c)))
        .collect();
    assert_all_means_within(what, &pairs, |expected| bias * expected.value);
}

/// Photons and camera rays hit a panel of opacity 0.25 with the probability 0.25.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn opacity_is_applied_once() {
    let mut b = SceneBuilder::new();
    add(&mut b, room(), material(0.5, 0.3));
    let veil = Material {
        opacity: 0.25,
        ..material(0.8, 0.0)
    };
    add(&mut b, panel(-0.2, 0.7), veil);
    let (scene, _) = b.build().unwrap();
    let camera = pinhole(Vec3::new(0.0, 0.1, 0.9), Vec3::new(0.0, 0.0, -1.0), 80.0);
    let resolution = UVec2::splat(16);
    with_world(&scene, camera, resolution, |world| {
        let reference = film_of(&path_tracer(world, Some(4)), resolution, 1024, 1);
        let integrator = ProgressivePhotonIntegrator {
            photons: Some(10_000),
            ..progressive(world, (0.05, 1.0), 4)
        };
        assert_same_blocks("sppm", &iterations(&integrator, resolution, 64, 2), &reference, 0.025);
        let film = mapped(world, resolution, 60_000, 4, 32, 3);
        assert_same_blocks("photon-map", &film, &reference, 0.025);
        // The radius is large enough to merge many vertices
        let film = iterations(&merging(world, 0.05, 4), resolution, 128, 4);
        assert_same_blocks("vcm", &film, &reference, 0.025);
    });
}

/// Panes, thin glass and filters: photons go through them in the same way as camera rays.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn photons_pass_glass() {
    let scene = glazed_room();
    let resolution = UVec2::splat(16);
    with_world(&scene, in_glazed_room(), resolution, |world| {
        let reference = film_of(&path_tracer(world, Some(4)), resolution, 1024, 1);
        let integrator = ProgressivePhotonIntegrator {
            photons: Some(10_000),
            ..progressive(world, (0.03, 1.0), 4)
        };
        assert_same_blocks("sppm", &iterations(&integrator, resolution, 64, 2), &reference, 0.03);
        let film = mapped(world, resolution, 60_000, 4, 32, 3);
        assert_same_blocks("photon-map", &film, &reference, 0.05);
        let film = iterations(&merging(world, 0.03, 4), resolution, 128, 4);
        assert_same_blocks("vcm", &film, &reference, 0.03);
    });
}

/// A room with every kind of lobe, including glass and mirrors, and caustics of a wide lamp. Each
/// light path is counted once, at every depth.
#[test]
fn all_light_is_counted_once() {
    let scene = lobes_room();
    let inside = pinhole(Vec3::new(0.0, 0.1, 0.95), Vec3::new(0.0, -0.3, -1.0), 80.0);
    let resolution = UVec2::splat(16);
    with_world(&scene, inside, resolution, |world| {
        let depths = if cfg!(long) { &[2, 6][..] } else { &[6] };
        for &depth in depths {
            let reference = film_of(&path_tracer(world, Some(depth)), resolution, 1024, 1);
            let integrator = ProgressivePhotonIntegrator {
                photons: Some(10_000),
                ..progressive(world, (0.03, 1.0), depth)
            };
            let film = iterations(&integrator, resolution, 64, 2);
            assert_same_blocks(&format!("sppm, depth {depth}"), &film, &reference, 0.03);
            let film = mapped(world, resolution, 60_000, depth, 16, 3);
            assert_same_blocks(&format!("photon-map, depth {depth}"), &film, &reference, 0.05);
            let film = iterations(&merging(world, 0.03, depth), resolution, 128, 4);
            assert_same_blocks(&format!("vcm, depth {depth}"), &film, &reference, 0.03);
        }
    });
}

/// A glass ball above a floor, under a lamp that camera paths hit often enough. The caustic has the
/// right light in each region.
#[test]
fn caustic_of_a_ball_agrees_with_paths() {
    let mut b = SceneBuilder::new();
    add(&mut b, panel(0.0, 1.0), material(0.6, 0.0));
    let glass = Material {
        transmission: Spectrum::ONE,
        ..material(0.0, 0.0)
    };
    add(&mut b, sphere(0.35, Vec3::new(0.0, 0.0, 0.5), 3), glass);
    let lamp = |x: f32, y: f32| Vec3::new(0.4 * x, 0.4 * y, 2.0);
    let corners = [lamp(-1.0, -1.0), lamp(-1.0, 1.0), lamp(1.0, 1.0), lamp(1.0, -1.0)];
    add(&mut b, polygon(&corners), material(0.0, 10.0));
    let (scene, _) = b.build().unwrap();
    // The camera sees the floor and the lower side of the ball. It does not see the image of the
    // lamp in the upper side, which few samples would hit.
    let camera = pinhole(Vec3::new(0.0, -1.2, 0.5), Vec3::new(0.0, -0.1, 0.0), 40.0);
    let resolution = UVec2::splat(16);
    with_world(&scene, camera, resolution, |world| {
        let reference = film_of(&path_tracer(world, Some(8)), resolution, 2048, 1);
        let integrator = ProgressivePhotonIntegrator {
            photons: Some(10_000),
            ..progressive(world, (0.02, 1.0), 8)
        };
        assert_same_blocks("sppm", &iterations(&integrator, resolution, 64, 2), &reference, 0.02);
        let film = iterations(&merging(world, 0.02, 8), resolution, 128, 4);
        assert_same_blocks("vcm", &film, &reference, 0.02);
        assert_same_blocks(
            "photon-map",
            &mapped(world, resolution, 60_000, 8, 32, 3),
            &reference,
            0.05,
        );
    });
}

/// Renders with more threads, in crops, merged from parts, or resumed are bit-identical to one
/// render.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn threads_and_parts_change_no_bit() {
    let folder = folder(&[]);
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box.toml");
    let scene = scene.to_str().unwrap();
    let path = |name: &str| folder.path().join(name);
    for method in ["sppm", "photon-map", "vcm"] {
        let render = |more: &str, output: &str| {
            let common = format!(
                "--integrator {method} --size 20x18 --spp 128 --photons 1500 --photon-count 20 --max-depth 5 -q -o {output}"
            );
            let mut args = vec!["render", scene];
            args.extend(common.split(' ').chain(more.split(' ')));
            done(folder.path(), &args);
        };
        render("--threads 1", "one.exr");
        render("--threads 3", "three.exr");
        assert_same_bits(&path("one.exr"), &path("three.exr"));

        render("--samples 0..64", "a.exr");
        render("--samples 64..128", "b.exr");
        done(folder.path(), &["merge", "a.exr", "b.exr", "-o", "merged.exr"]);
        assert_same_bits(&path("one.exr"), &path("merged.exr"));

        render("--crop 5,3,17,16", "crop.exr");
        let (full, crop) = (
            read_channel(&path("one.exr"), "G"),
            read_channel(&path("crop.exr"), "G"),
        );
        for (i, value) in crop.iter().enumerate() {
            let (x, y) = (5 + i % 12, 3 + i / 12);
            assert_eq!(
                value.to_bits(),
                full[y * 20 + x].to_bits(),
                "{method}: column {x}, row {y}"
            );
        }
    }
}
