//! Light tracing and bidirectional path tracing: each strategy separately, all strategies together,
//! closed forms, and bit-identical renders.

use crate::support::statistics::{Mean, assert_all_means_within, assert_same_mean};
use crate::support::*;
use embrasure::bsdf::Fresnel;
use embrasure::camera::{Camera, CameraParameters};
use embrasure::color::Spectrum;
use embrasure::film::{Film, Filter, FilterKind, Rect};
use embrasure::geometry::Mesh;
use embrasure::integrator::*;
use embrasure::light_sampling::{LightChoice, SelectionMode};
use embrasure::material::{Gloss, Material};
use embrasure::math::{UVec2, Vec3};
use embrasure::pipeline::CompiledIntegrator;
use embrasure::scene::{Scene, SceneBuilder};

const RESOLUTION: UVec2 = UVec2::splat(16);
/// Number of renders of each kind. Their spread gives the error.
const SEEDS: u64 = 16;

pub(crate) fn bidirectional<A>(world: World<A>, max_depth: u32) -> BidirectionalIntegrator<A> {
    BidirectionalIntegrator {
        world,
        heuristic: Heuristic::Power,
        max_depth: Some(max_depth),
        roulette: Roulette::after(3),
    }
}

pub(crate) fn light_tracer<A>(world: World<A>, max_depth: u32) -> LightIntegrator<A> {
    LightIntegrator {
        world,
        max_depth: Some(max_depth),
        roulette: Roulette::after(3),
    }
}

/// Means of the four quarters and of the whole image, for each channel.
fn regions(film: &Film, value: impl Fn(UVec2, usize) -> f64) -> Vec<f64> {
    let half = film.resolution() / 2;
    let mut means = vec![0.0; 15];
    for pixel in film.crop().pixels() {
        let quarter = usize::from(pixel.x >= half.x) + 2 * usize::from(pixel.y >= half.y);
        for c in 0..3 {
            let share = value(pixel, c) / film.crop().area() as f64;
            means[3 * quarter + c] += 4.0 * share;
            means[12 + c] += share;
        }
    }
    means
}

fn picture(film: &Film) -> Vec<f64> {
    regions(film, |pixel, c| film.sums(pixel).unwrap().mean(c))
}

/// Means of the light of the film's part `part`, such as a strategy.
fn part(film: &Film, part: usize) -> Vec<f64> {
    let iterations = film.sums(UVec2::ZERO).unwrap().samples();
    regions(film, |pixel, c| {
        film.tile_at(pixel).unwrap().part_sums(pixel)[part].mean(c, iterations)
    })
}

/// Asserts that the means over renders are equal. Returns the standard error of the difference of
/// the means of the whole image.
fn assert_same_means_to(what: &str, a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let pairs: Vec<_> = Mean::of_each(a).into_iter().zip(Mean::of_each(b)).collect();
    assert_all_means_within(what, &pairs, |_| 1e-7);
    let (a, b) = pairs[pairs.len() - 2];
    a.error().hypot(b.error())
}

/// Asserts that means are equal, relative to the mean of the whole image. Returns the standard
/// error as [`assert_same_means_to`] does.
pub(crate) fn assert_same_means(what: &str, a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let whole = Mean::of_each(b)[b[0].len() - 2].value;
    let relative = |renders: &[Vec<f64>]| -> Vec<Vec<f64>> {
        renders.iter().map(|r| r.iter().map(|v| v / whole).collect()).collect()
    };
    assert_same_means_to(what, &relative(a), &relative(b))
}

/// Means of the regions in [`SEEDS`] renders.
pub(crate) fn renders(of: impl Fn(u64) -> Film) -> Vec<Vec<f64>> {
    (0..SEEDS).map(|seed| picture(&of(seed))).collect()
}

/// A room whose walls do not touch, so distances between surfaces have a minimum. The middle of the
/// ceiling emits.
fn open_box() -> (Scene, CameraParameters) {
    let mut b = SceneBuilder::new();
    let wall = |color: [f32; 3]| Material {
        diffuse: Spectrum::from(color),
        ..material(0.0, 0.0)
    };
    // Start with the wall z = -1 of a cube that faces inwards, and rotate it to the other walls
    let (s, z) = (0.8, -1.0);
    let back = [
        Vec3::new(-s, -s, z),
        Vec3::new(s, -s, z),
        Vec3::new(s, s, z),
        Vec3::new(-s, s, z),
    ];
    let turned = |turn: fn(Vec3) -> Vec3| polygon(&back.map(turn));
    add(&mut b, turned(|p| p), wall([0.6, 0.6, 0.6]));
    add(&mut b, turned(|p| Vec3::new(p.z, p.y, -p.x)), wall([0.7, 0.3, 0.2]));
    add(&mut b, turned(|p| Vec3::new(-p.z, p.y, p.x)), wall([0.2, 0.6, 0.3]));
    add(&mut b, turned(|p| Vec3::new(p.x, p.z, -p.y)), wall([0.5, 0.5, 0.5]));
    let lamp = turned(|p| Vec3::new(0.6 * p.x, -p.z, 0.6 * p.y));
    let glow = Material {
        emission: Spectrum::rgb(3.0, 2.5, 2.0),
        ..wall([0.4, 0.4, 0.4])
    };
    add(&mut b, lamp, glow);
    let camera = pinhole(Vec3::new(0.1, 0.2, 3.5), Vec3::new(0.0, 0.05, 0.0), 40.0);
    (b.build().unwrap().0, camera)
}

/// For paths of one to five segments, each strategy that can sample paths of this length is tested
/// without MIS weights. The strategy must find all light of these paths. This test detects a wrong
/// density (Veach 1997, figure 10.3).
#[test]
fn each_bdpt_strategy_alone_is_unbiased() {
    const MAX_DEPTH: u32 = 4;
    let (scene, camera) = open_box();
    with_world(&scene, camera, RESOLUTION, |world| {
        let world = World {
            strategies: true,
            paths: None,
            ..world
        };
        let integrator = bidirectional(world, MAX_DEPTH);
        let films: Vec<Film> = (0..SEEDS)
            .map(|seed| film_of_iterations(&integrator, RESOLUTION, 128, seed))
            .collect();
        let sum = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a + b).collect() };
        let mut index = 0;
        let mut so_far = vec![vec![0.0; 15]; films.len()];
        for depth in 0..=MAX_DEPTH {
            // The weighted strategies for all path lengths up to this one sum to the light that the
            // path tracer finds up to this length.
            let n = depth as usize + 2;
            let mut weighed = vec![vec![0.0; 15]; films.len()];
            for (weighed, film) in weighed.iter_mut().zip(&films) {
                for i in index..index + n {
                    *weighed = sum(weighed, &part(film, 2 * i));
                }
            }
            for (so_far, weighed) in so_far.iter_mut().zip(&weighed) {
                *so_far = sum(so_far, weighed);
            }
            let expected = renders(|seed| film_of(&path_tracer(world, Some(depth)), RESOLUTION, 128, seed));
            let error = assert_same_means(&format!("up to {n} vertices"), &so_far, &expected);
            assert!(error < 0.006, "{error}");

            // Each strategy without weights gives the same light as the weighted sum. Differences
            // are computed within each render, because strategies share subpaths.
            for t in 1..=n {
                let strategy = format!("(s, t) = ({}, {t})", n - t);
                let none = vec![vec![0.0; 15]; films.len()];
                let differences: Vec<_> = films
                    .iter()
                    .zip(&weighed)
                    .map(|(film, weighed)| {
                        let alone = part(film, 2 * (index + t - 1) + 1);
                        alone.iter().zip(weighed).map(|(a, b)| (a - b) / weighed[13]).collect()
                    })
                    .collect();
                let error = assert_same_means_to(&strategy, &differences, &none);
                assert!(error < 0.1, "{strategy} is known to {error} only");
            }
            index += n;
        }
        // All strategies together are the image.
        for (film, so_far) in films.iter().zip(&so_far) {
            for (sum, value) in so_far.iter().zip(picture(film)) {
                assert!((sum - value).abs() < 1e-4 * value.abs(), "{sum} {value}");
            }
        }
    });
}

/// A corner with a lamp and a sky, with matte, glossy and rough surfaces, rough glass, an opacity
/// below 1, and smooth normals. If `has_mirrors` is true, it also has glass and a mirror. Otherwise
/// it has a point light and a directional light: camera paths cannot find light of these two lights
/// in mirrors and glass.
fn stage(has_mirrors: bool) -> Scene {
    let mut b = SceneBuilder::new();
    let quad = |at: [[f32; 3]; 4]| polygon(&at.map(Vec3::from));
    let grey = Spectrum::splat;
    let floor = quad([[-2., -1., 2.], [2., -1., 2.], [2., -1., -1.5], [-2., -1., -1.5]]);
    let phong = Material {
        specular: Spectrum::rgb(0.3, 0.4, 0.3),
        gloss: Gloss::Phong(8.0),
        ..material(0.4, 0.0)
    };
    add(&mut b, floor, phong);
    let wall = quad([[-2., -1., -1.5], [2., -1., -1.5], [2., 1.5, -1.5], [-2., 1.5, -1.5]]);
    add(&mut b, wall, material(0.6, 0.0));
    let lamp = quad([[-0.5, 1.4, -0.5], [0.5, 1.4, -0.5], [0.5, 1.4, 0.3], [-0.5, 1.4, 0.3]]);
    add(&mut b, lamp, material(0.3, 4.0));
    let mut smooth = |center: Vec3, radius: f32, material: Material| {
        let ball = sphere(radius, center, 2);
        let normals = ball.positions.iter().map(|&p| (p - center).normalize()).collect();
        add(&mut b, Mesh { normals, ..ball }, material);
    };
    smooth(Vec3::new(-0.9, -0.5, -0.4), 0.45, material(0.7, 0.0));
    let rough_glass = Material {
        transmission: grey(0.9),
        gloss: Gloss::Ggx(Fresnel::Dielectric { eta: 1.5 }),
        roughness: 0.5,
        ..material(0.0, 0.0)
    };
    smooth(Vec3::new(0.1, -0.55, 0.2), 0.4, rough_glass);
    let metal = Material {
        specular: grey(0.9),
        gloss: Gloss::Ggx(Fresnel::Full),
        roughness: 0.6,
        ..material(0.0, 0.0)
    };
    smooth(Vec3::new(1.0, -0.6, -0.3), 0.4, metal);
    let glass = Material {
        transmission: grey(1.0),
        ..material(0.0, 0.0)
    };
    if has_mirrors {
        add(&mut b, sphere(0.25, Vec3::new(0.8, -0.7, 0.8), 1), glass);
    }
    let mirror = Material {
        specular: grey(0.5),
        gloss: Gloss::Mirror(Fresnel::Full),
        ..material(0.3, 0.0)
    };
    if has_mirrors {
        add(
            &mut b,
            quad([[1.6, -1., 1.], [1.6, -1., -1.4], [1.6, 0.6, -1.4], [1.6, 0.6, 1.]]),
            mirror,
        );
    }
    let veil = Material {
        opacity: 0.5,
        ..material(0.5, 0.0)
    };
    add(
        &mut b,
        quad([[-1.5, 0.2, 0.2], [-0.3, 0.2, 0.2], [-0.3, 0.9, -0.4], [-1.5, 0.9, -0.4]]),
        veil,
    );
    b.add_constant_light(Spectrum::rgb(0.1, 0.15, 0.2)).unwrap();
    if !has_mirrors {
        b.add_point_light(Vec3::new(-1.2, 0.6, 0.8), grey(0.8)).unwrap();
        b.add_directional_light(Vec3::new(0.3, -1.0, -0.6).normalize(), grey(0.4))
            .unwrap();
    }
    b.build().unwrap().0
}

fn stage_camera() -> CameraParameters {
    CameraParameters {
        lens_radius: 0.05,
        focus_distance: 4.0,
        ..pinhole(Vec3::new(0.0, 0.3, 4.2), Vec3::new(0.0, -0.2, 0.0), 40.0)
    }
}

/// A scene with all kinds of lights and surfaces, seen through a lens. The mean equals the mean of
/// the path tracer, for two light selections and for the power and the balance heuristic.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn bidirectional_paths_agree_with_paths() {
    for (selection, has_mirrors) in [
        (SelectionMode::Auto, true),
        (SelectionMode::Auto, false),
        (SelectionMode::All, false),
    ] {
        let scene = stage(has_mirrors);
        with_world((&scene, selection), stage_camera(), RESOLUTION, |world| {
            let expected = renders(|seed| film_of(&path_tracer(world, Some(6)), RESOLUTION, budget(256), seed));
            let heuristics = if selection == SelectionMode::All {
                vec![Heuristic::Balance]
            } else {
                vec![Heuristic::Power]
            };
            for heuristic in heuristics {
                let integrator = BidirectionalIntegrator {
                    heuristic,
                    ..bidirectional(world, 6)
                };
                let films = renders(|seed| film_of_iterations(&integrator, RESOLUTION, budget(96), seed));
                let error = assert_same_means(&format!("{selection:?}, {heuristic:?}"), &films, &expected);
                assert!(error < 0.004 * slack(), "{error}");
            }
        });
    }
}

/// Shading normals are strongly bent, so a camera path may hit the triangle that it has left. The
/// weights of all strategies take this light into account.
#[test]
fn bidirectional_paths_agree_on_bent_normals() {
    let (scene, camera) = tilted_room();
    with_world(&scene, camera, RESOLUTION, |world| {
        let expected = renders(|seed| film_of(&path_tracer(world, Some(4)), RESOLUTION, budget(256), seed));
        let films = renders(|seed| film_of_iterations(&bidirectional(world, 4), RESOLUTION, budget(96), seed));
        let error = assert_same_means("bent normals", &films, &expected);
        assert!(error < 0.004 * slack(), "{error}");
    });
}

/// Means of the light tracer equal means of the path tracer, if the camera sees no mirror or glass
/// directly.
#[test]
fn light_tracing_agrees_with_paths() {
    let (scene, camera) = open_box();
    let lens = CameraParameters {
        lens_radius: 0.2,
        focus_distance: 3.5,
        ..camera
    };
    for camera in [camera, lens] {
        with_world(&scene, camera, RESOLUTION, |world| {
            let expected = renders(|seed| film_of(&path_tracer(world, Some(5)), RESOLUTION, budget(256), seed));
            let films = renders(|seed| film_of_iterations(&light_tracer(world, 5), RESOLUTION, budget(192), seed));
            let error = assert_same_means("light", &films, &expected);
            assert!(error < 0.004 * slack(), "{error}");
        });
    }
}

/// Connections go through thin glass and filters, also connections to the lens.
#[test]
fn light_tracing_passes_glass() {
    let mut b = room_below_a_pane();
    // The index is 1, so no ray from the camera is reflected
    let veil = Material {
        ior: 1.0,
        diffuse: Spectrum::splat(0.1),
        ..glass([0.3, 0.5, 0.6], true)
    };
    add(&mut b, panel(-0.2, 2.0), veil);
    let scene = b.build().unwrap().0;
    let camera = pinhole(Vec3::new(0.0, -0.5, 0.9), Vec3::new(0.0, -0.6, -1.0), 60.0);
    with_world(&scene, camera, RESOLUTION, |world| {
        let expected = renders(|seed| film_of(&path_tracer(world, Some(5)), RESOLUTION, budget(256), seed));
        let films = renders(|seed| film_of_iterations(&light_tracer(world, 5), RESOLUTION, budget(192), seed));
        assert_same_means("light through glass", &films, &expected);
    });
}

/// Splats have the same filter weights as samples, also if the filter is wider than a pixel.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn filters_weigh_splats() {
    let (scene, camera) = open_box();
    let accel = backend(&scene);
    let accel: Backend = &accel;
    let camera = Camera::new(camera, RESOLUTION).unwrap();
    let selection = scene.light_selection(LightChoice::default());
    for kind in [FilterKind::Tent, FilterKind::Gaussian, FilterKind::Mitchell] {
        let filter = Filter::new(kind, kind.usual_radius());
        let world = World::new(&scene, &accel, &selection, &camera, &filter);
        let by_iterations = |integrator: &dyn Fn(&mut Film, u64)| {
            renders(|seed| {
                let mut film = Film::new(RESOLUTION, Rect::full(RESOLUTION));
                integrator(&mut film, seed);
                film
            })
        };
        let expected = by_iterations(&|film, seed| {
            render_into(film, &path_tracer(world, Some(3)), &independent(seed), budget(256));
        });
        let light = by_iterations(&|film, seed| {
            render_into(film, &light_tracer(world, 3), &independent(seed), budget(192));
        });
        assert_same_means(&format!("{kind:?}, light"), &light, &expected);
        let both = by_iterations(&|film, seed| {
            render_into(film, &bidirectional(world, 3), &independent(seed), budget(96));
        });
        assert_same_means(&format!("{kind:?}, both"), &both, &expected);
    }
}

/// Fails if the mean of the image is not `expected`, or its standard error exceeds 0.5 %.
fn assert_known(
    what: &str,
    iterations: u32,
    integrator: &(impl CompiledIntegrator + IterationIntegrator),
    expected: f64,
) {
    let films: Vec<_> = (0..SEEDS)
        .map(|seed| {
            picture(&film_of_iterations(
                integrator,
                RESOLUTION,
                iterations / SEEDS as u32,
                seed,
            ))
        })
        .collect();
    let mean = Mean::of_each(&films)[13];
    assert_same_mean(what, mean, Mean::exact(expected));
    assert!(
        mean.error() < 0.005 * expected,
        "{what}: {mean}: the error is too large"
    );
}

/// Three scenes with known means, because flux is conserved: a room that emits and reflects, a
/// white object in a furnace, and a point light in a sphere.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn closed_forms_hold() {
    let inside = pinhole(Vec3::new(0.4, 0.3, 0.6), Vec3::new(-1.0, -1.0, -1.0), 60.0);
    with_world(&own("closed-box.toml"), inside, RESOLUTION, |world| {
        assert_known("closed box, bdpt", 128, &bidirectional(world, 20), 2.0);
        assert_known("closed box, light", 2048, &light_tracer(world, 20), 2.0);
    });
    let outside = pinhole(Vec3::new(0.0, 0.5, 4.0), Vec3::ZERO, 40.0);
    with_world(&own("furnace.toml"), outside, RESOLUTION, |world| {
        assert_known("furnace, bdpt", 128, &bidirectional(world, 20), 1.0);
        assert_known("furnace, light", 2048, &light_tracer(world, 20), 1.0);
    });

    // If the flux 4πI hits an area A that reflects the fraction ρ, then E = 4πI / (A (1 − ρ))
    // everywhere, because every point of a sphere sees all other points in the same way.
    let (rho, intensity) = (0.6, 2.0);
    let mut ball = sphere(1.0, Vec3::ZERO, 4);
    for triangle in &mut ball.triangles {
        triangle.swap(1, 2);
    }
    let corners = |t: &[u32; 3]| t.map(|i| ball.positions[i as usize]);
    let area: f64 = ball
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = corners(t);
            0.5 * (b - a).cross(c - a).length() as f64
        })
        .sum();
    let mut b = SceneBuilder::new();
    add(&mut b, ball, material(rho, 0.0));
    b.add_point_light(Vec3::ZERO, Spectrum::splat(intensity)).unwrap();
    let camera = pinhole(Vec3::new(0.2, -0.1, 0.3), Vec3::new(0.5, 1.0, -0.7), 100.0);
    let expected = 4.0 * intensity as f64 * rho as f64 / (area * (1.0 - rho as f64));
    with_world(&b.build().unwrap().0, camera, RESOLUTION, |world| {
        assert_known("point in a sphere, bdpt", 128, &bidirectional(world, 30), expected);
        assert_known("point in a sphere, light", 512, &light_tracer(world, 30), expected);
    });
}
