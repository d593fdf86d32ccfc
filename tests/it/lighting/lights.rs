//! Lights: samples against densities; irradiance and images against closed forms and other
//! estimators.

use crate::chi_square::{chi_square, sidak};
use crate::support::statistics::{Mean, assert_same_mean};
use crate::support::*;
use embrasure::camera::CameraParameters;
use embrasure::color::Spectrum;
use embrasure::geometry::{Mesh, Placement, PrimId};
use embrasure::integrator::{DirectLight, NaiveIntegrator, PathIntegrator, Roulette, Strategy};
use embrasure::light::*;
use embrasure::light_sampling::*;
use embrasure::material::{Map, Material};
use embrasure::math::{Affine3A, Quat, UVec2, Vec2, Vec3};
use embrasure::sampler::{Dimension, Independent, SampleKey, Sampler};
use embrasure::scene::{RectangleParameters, Scene, SceneBuilder, SkyParameters};
use embrasure::texture::{Mapping, Texels, Texture, TextureId, Wrap};

fn at(index: u32) -> Vec2 {
    let mut sampler = Independent::new(11);
    sampler.start(SampleKey::new(0, 0, index));
    sampler.get_2d(Dimension::PIXEL)
}

fn triangle(sampling: TriangleSampling) -> TriangleLight {
    let mesh = polygon(&[
        Vec3::new(-0.4, 1.0, 0.3),
        Vec3::new(0.5, 1.2, -0.8),
        Vec3::new(1.1, 1.4, 0.9),
    ]);
    TriangleLight::new(mesh.corners(PrimId(0)), Spectrum::ONE, sampling)
}

/// A map with black parts, a small sun and soft parts.
pub fn map() -> LatLongImage {
    let (width, height) = (32, 16);
    let texel = |i: usize| match (i % width, i / width) {
        (5, 4) => Spectrum::splat(50.0),
        (x, y) if y < 8 => Spectrum::rgb(0.1 * x as f32, 0.5, 1.0),
        (20..=24, _) => Spectrum::splat(0.3),
        _ => Spectrum::ZERO,
    };
    LatLongImage {
        width,
        height,
        texels: (0..width * height).map(texel).collect(),
    }
}

/// Point of the triangle in the direction `w` from the origin, if there is one.
fn met(w: Vec3) -> Option<Vec3> {
    let [a, b, c] = [
        Vec3::new(-0.4, 1.0, 0.3),
        Vec3::new(0.5, 1.2, -0.8),
        Vec3::new(1.1, 1.4, 0.9),
    ];
    let n = (b - a).cross(c - a);
    let t = a.dot(n) / w.dot(n);
    let q = t * w;
    let inside = [(a, b), (b, c), (c, a)]
        .iter()
        .all(|&(p, r)| (r - p).cross(q - p).dot(n) >= 0.0);
    (t > 0.0 && inside).then_some(q)
}

/// The first and the last column of an environment are neighbours: the seam is invisible.
#[test]
fn environment_has_no_seam() {
    let column = |x: usize| Spectrum::splat([1.0, 0.0, 2.0, 7.0][x]);
    let texels = (0..8).map(|i| column(i % 4)).collect();
    let (width, height) = (4, 2);
    let image = LatLongImage { width, height, texels };
    let map = EnvironmentLight::new(image, 1.0, Quat::IDENTITY);
    // Half a texel is an eighth of a turn. The seam is at +z.
    for (turn, expected) in [(-0.125, 7.0), (0.0, 4.0), (0.0625, 2.5), (-0.0625, 5.5), (0.125, 1.0)] {
        let (sin, cos) = (turn * std::f32::consts::TAU).sin_cos();
        let radiance = map.radiance(Vec3::new(-sin, 0.0, cos)).mean();
        assert!((radiance - expected).abs() < 1e-4, "{turn}: {radiance}, not {expected}");
    }
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn directions_follow_their_densities() {
    const SAMPLES: u32 = 1_000_000;
    let level = sidak(0.01, 8);
    for angle in [1.0, 12.0, 180.0] {
        let sun = SunLight::new(Vec3::new(0.2, -0.7, 0.4).normalize(), Spectrum::ONE, angle);
        let light = Light::Sun(sun);
        let sample = |i| {
            let s = light.sample(Vec3::ZERO, 0.0, at(i), &[])?;
            // Rounding puts hardly any direction outside the disc.
            let known = (sun.pdf(s.wi), sun.radiance(s.wi)) == (s.pdf, s.radiance);
            assert!(known || i % 100 != 0, "{angle}: {}", s.wi);
            Some(s.wi)
        };
        let outcome = chi_square(SAMPLES, sample, |w| sun.pdf(w) as f64, true);
        assert!(outcome.p_value > level, "sun of {angle}: {outcome:?}");
        assert!((outcome.integral - 1.0).abs() < 5e-3, "sun of {angle}: {outcome:?}");
    }
    for sampling in [TriangleSampling::Area, TriangleSampling::SolidAngle] {
        let triangle = triangle(sampling);
        let light = Light::from(triangle);
        let sample = |i| {
            let s = light.sample(Vec3::ZERO, 0.0, at(i), &[])?;
            if let Some(q) = met(s.wi) {
                let pdf = triangle.pdf(Vec3::ZERO, q, s.wi);
                assert!((pdf / s.pdf - 1.0).abs() < 1e-3, "{pdf} {}", s.pdf);
            }
            Some(s.wi)
        };
        let pdf = |w: Vec3| met(w).map_or(0.0, |q| triangle.pdf(Vec3::ZERO, q, w) as f64);
        let outcome = chi_square(SAMPLES, sample, pdf, true);
        assert!(outcome.p_value > level, "{sampling:?}: {outcome:?}");
        assert!((outcome.integral - 1.0).abs() < 2e-3, "{sampling:?}: {outcome:?}");
    }
    let constant = Light::Constant(ConstantLight {
        radiance: Spectrum::ONE,
    });
    let uniform = chi_square(
        SAMPLES,
        |i| constant.sample(Vec3::ZERO, 0.0, at(i), &[]).map(|s| s.wi),
        |_| 0.25 / std::f64::consts::PI,
        false,
    );
    assert!(uniform.p_value > level, "constant: {uniform:?}");
    for rotation in [Quat::IDENTITY, Quat::from_rotation_x(0.7)] {
        let map = EnvironmentLight::new(map(), 2.0, rotation);
        let light = Light::Environment(Box::new(map.clone()));
        let sample = |i| {
            let s = light.sample(Vec3::ZERO, 0.0, at(i), &[])?;
            let (pdf, radiance) = (map.pdf(s.wi), map.radiance(s.wi));
            // Both densities are equal, except if rounding moves the direction to another texel
            let close = (pdf / s.pdf - 1.0).abs() < 1e-2 || at_a_border(s.wi, rotation);
            assert!(close, "{pdf} {} {}", s.pdf, s.wi);
            assert!(
                (radiance - s.radiance).to_array().iter().all(|d| d.abs() < 0.1),
                "{radiance:?} {s:?}"
            );
            Some(s.wi)
        };
        let outcome = chi_square(SAMPLES, sample, |w| map.pdf(w) as f64, true);
        assert!(outcome.p_value > level, "environment: {outcome:?}");
        assert!((outcome.integral - 1.0).abs() < 2e-3, "environment: {outcome:?}");
    }
}

/// Returns true if rounding could move the direction to another texel of [`map`].
fn at_a_border(wi: Vec3, rotation: Quat) -> bool {
    let w = rotation.inverse() * wi;
    let x = (0.5 + w.x.atan2(-w.z) / std::f32::consts::TAU) * 32.0;
    let y = w.y.acos() / std::f32::consts::PI * 16.0;
    [x, y].iter().any(|v| (v - v.round()).abs() < 1e-3)
}

/// The mean of 1/pdf is the solid angle, from any point.
#[test]
fn triangle_densities_sum_to_the_solid_angle() {
    for sampling in [TriangleSampling::Area, TriangleSampling::SolidAngle] {
        let light = Light::from(triangle(sampling));
        for (p, tolerance) in [
            (Vec3::ZERO, 5e-3),
            (Vec3::new(0.3, 0.9, 0.1), 5e-2),
            (Vec3::new(0.3, -200.0, 0.1), 5e-3),
            (Vec3::new(6.0, 0.0, 0.0), 2e-2),
        ] {
            const N: u32 = 200_000;
            let samples = (0..N).filter_map(|i| light.sample(p, 0.0, at(i), &[]));
            let mean = samples.map(|s| 1.0 / s.pdf as f64).sum::<f64>() / N as f64;
            let corners = [
                Vec3::new(-0.4, 1.0, 0.3),
                Vec3::new(0.5, 1.2, -0.8),
                Vec3::new(1.1, 1.4, 0.9),
            ];
            let exact = embrasure::sampling::spherical_triangle::SphericalTriangle::new(corners, p).unwrap();
            assert!(
                (mean / exact.solid_angle() - 1.0).abs() < tolerance,
                "{sampling:?} {p}: {mean} {exact:?}"
            );
        }
    }
}

/// Radiance of a floor of albedo 0.5 under one light, towards the camera: albedo over π times the
/// irradiance. The floor faces up.
fn floor_radiance(configure: impl FnOnce(&mut SceneBuilder)) -> f64 {
    let mut b = SceneBuilder::new();
    let s = 100.0;
    let corners = [
        Vec3::new(-s, 0.0, -s),
        Vec3::new(-s, 0.0, s),
        Vec3::new(s, 0.0, s),
        Vec3::new(s, 0.0, -s),
    ];
    add(&mut b, polygon(&corners), material(0.5, 0.0));
    configure(&mut b);
    let scene = b.build().unwrap().0;
    let camera = pinhole(Vec3::new(0.0, 0.05, 0.0), Vec3::ZERO, 1.0);
    film_mean(&render_film(&scene, camera, [8, 8], 4096, Some(1)), 1)
}

#[test]
fn irradiance_matches_closed_forms() {
    use std::f64::consts::PI;
    let check = |what: &str, got: f64, irradiance: f64| {
        let expected = 0.5 * irradiance / PI;
        assert!(
            (got / expected - 1.0).abs() < 5e-3,
            "{what}: {got}, expected {expected}"
        );
    };
    let sun = floor_radiance(|b| {
        b.add_directional_light(Vec3::new(1.0, -2.0, 0.0), Spectrum::splat(3.0))
            .unwrap()
    });
    check("directional", sun, 3.0 * 2.0 / 5f64.sqrt());
    for angle in [0.01, 0.53, 30.0] {
        // All of the disc is above the floor, and its mean direction is its centre.
        let sun = floor_radiance(|b| {
            b.add_sun(Vec3::new(1.0, -2.0, 0.0), Spectrum::splat(3.0), angle)
                .unwrap()
        });
        check("sun", sun, 3.0 * 2.0 / 5f64.sqrt());
    }
    let rectangle = floor_radiance(|b| {
        let rectangle = RectangleParameters {
            position: Vec3::new(0.0, 2.0, 0.0),
            direction: Vec3::NEG_Y,
            size: [2.0, 1.0],
            up: None,
            radiance: Spectrum::splat(4.0),
        };
        b.add_rectangle(&rectangle).unwrap();
    });
    // The rectangle is four quarters, each with a corner above the point (Howell's catalogue of
    // view factors, B-4).
    let (a, b) = (0.5, 0.25);
    let (ra, rb) = (1f64.hypot(a), 1f64.hypot(b));
    let quarter = (a / ra * (b / ra).atan() + b / rb * (a / rb).atan()) / (2.0 * PI);
    check("rectangle", rectangle, 4.0 * PI * 4.0 * quarter);
    let spot = |towards: Vec3| {
        floor_radiance(|b| {
            b.add_spot_light(Vec3::new(0.0, 2.0, 0.0), towards, Spectrum::splat(8.0), 30.0, 20.0)
                .unwrap();
        })
    };
    check("spot", spot(Vec3::NEG_Y), 2.0);
    // The floor is 25° off the axis of the spot light. This is the middle of the rim in angle, and
    // nearly the middle in cosine.
    let t =
        (25f64.to_radians().cos() - 30f64.to_radians().cos()) / (20f64.to_radians().cos() - 30f64.to_radians().cos());
    let tilted = Vec3::new(25f32.to_radians().sin(), -25f32.to_radians().cos(), 0.0);
    check("spot, falling off", spot(tilted), 2.0 * t * t * (3.0 - 2.0 * t));
    // A map that is 2 above and black below
    let half = LatLongImage {
        width: 64,
        height: 32,
        texels: (0..64 * 32)
            .map(|i| {
                if i < 64 * 16 {
                    Spectrum::splat(2.0)
                } else {
                    Spectrum::ZERO
                }
            })
            .collect(),
    };
    let sky = floor_radiance(|b| b.add_environment(half, 1.0, Quat::from_rotation_y(1.0)).unwrap());
    check("environment", sky, 2.0 * PI);
    // Test an emitting triangle with both kinds of triangle sampling
    let lamp = |sampling| {
        floor_radiance(move |b| {
            b.triangle_sampling(sampling);
            let corners = [
                Vec3::new(-1.0, 1.0, -1.0),
                Vec3::new(1.0, 1.0, -1.0),
                Vec3::new(0.0, 1.0, 1.0),
            ];
            add(b, polygon(&corners), material(0.0, 4.0));
        })
    };
    let (area, angle) = (lamp(TriangleSampling::Area), lamp(TriangleSampling::SolidAngle));
    assert!(
        (area / angle - 1.0).abs() < 5e-3,
        "{area} by area, {angle} by solid angle"
    );
}

/// One light selected by power, one light selected uniformly, and samples of all lights have the
/// same mean. They differ only in noise.
#[test]
fn every_light_selection_has_the_same_mean() {
    let render = |mode| {
        let mut b = SceneBuilder::new();
        add(&mut b, room(), material(0.5, 0.0));
        for (i, power) in [1.0, 3.0, 0.2, 8.0].into_iter().enumerate() {
            let x = -0.6 + 0.4 * i as f32;
            let corners = [
                Vec3::new(x, 0.9, -0.2),
                Vec3::new(x + 0.2, 0.9, -0.2),
                Vec3::new(x, 0.9, 0.2),
            ];
            add(&mut b, polygon(&corners), material(0.0, power));
        }
        b.add_point_light(Vec3::new(0.3, -0.5, 0.2), Spectrum::splat(0.1))
            .unwrap();
        let scene = b.build().unwrap().0;
        let film = render_film(
            (&scene, mode),
            pinhole(Vec3::ZERO, Vec3::new(0.3, -1.0, 0.2), 70.0),
            [16, 16],
            1024,
            Some(3),
        );
        Mean::of_film(&film, 0)
    };
    let reference = render(SelectionMode::Power);
    for mode in [
        SelectionMode::Auto,
        SelectionMode::Place,
        SelectionMode::Uniform,
        SelectionMode::All,
    ] {
        assert_same_mean(format!("{mode:?}"), render(mode), reference);
    }
}

/// Selection by place chooses each light as often as its probability says. The place is the
/// position of the vertex.
#[test]
fn light_choices_follow_their_probabilities() {
    use statrs::distribution::{ChiSquared, ContinuousCDF};
    const DRAWS: u32 = 200_000;
    let lights: Vec<Light> = (0..200u32)
        .map(|i| {
            let u = at(i).extend(at(i + 1000).x);
            Light::Point(PointLight {
                position: 4.0 * Vec3::from(u) - 2.0,
                intensity: Spectrum::splat(1.0 + 9.0 * at(i).x * at(i).y),
            })
        })
        .collect();
    let bounds = [Vec3::splat(-2.0), Vec3::splat(2.0)].into_iter().collect();
    let selection = LightSelection::new(SelectionMode::Place, &lights, bounds, 3.5);
    let level = sidak(0.01, 3);
    for (p, n) in [
        (Vec3::new(0.1, -1.9, 0.7), Vec3::Y),
        (Vec3::new(-1.0, 0.3, 0.2), Vec3::ZERO),
        (Vec3::new(9.0, 5.0, 3.0), Vec3::new(-0.8, -0.6, 0.0)),
    ] {
        let context = LightSampleContext { p, n };
        let mut counts = vec![0u32; lights.len()];
        for i in 0..DRAWS {
            let (id, pmf) = selection.sample(&lights, &context, at(i).x).unwrap();
            assert_eq!(pmf, selection.pmf(&lights, &context, id));
            counts[id.0 as usize] += 1;
        }
        // Count all rare lights as one light.
        let (mut statistic, mut bins, mut rare) = (0.0, 0, [0.0; 2]);
        for (i, &count) in (0..).zip(&counts) {
            let expected = (selection.pmf(&lights, &context, LightId(i)) as f64) * DRAWS as f64;
            if expected < 10.0 {
                rare[0] += count as f64;
                rare[1] += expected;
            } else {
                statistic += (count as f64 - expected).powi(2) / expected;
                bins += 1;
            }
        }
        if rare[1] > 0.0 {
            statistic += (rare[0] - rare[1]).powi(2) / rare[1];
            bins += 1;
        }
        let p_value = 1.0 - ChiSquared::new((bins - 1) as f64).unwrap().cdf(statistic);
        assert!(p_value > level, "{p}: {p_value}, {bins} bins, rare {rare:?}");
    }
}

/// Samples of all lamps at every vertex have the same mean as samples of one light selected by
/// power. Within a lamp, triangles are selected by power. Wide lamps have more samples.
#[test]
fn all_lamps_give_the_picture_by_power() {
    let render = |mode, samples, direct, seed| {
        let mut b = SceneBuilder::new();
        add(&mut b, room(), material(0.5, 0.0));
        for (radius, x, radiance) in [(0.25, -0.5, 1.0), (0.05, 0.1, 9.0)] {
            add(
                &mut b,
                sphere(radius, Vec3::new(x, 0.4, 0.1), 1),
                material(0.0, radiance),
            );
        }
        let quad = [[0.4, -0.4], [0.8, -0.4], [0.8, 0.4], [0.4, 0.4]].map(|[x, z]| Vec3::new(x, 0.9, z));
        add(&mut b, polygon(&quad), material(0.0, 2.0));
        b.add_point_light(Vec3::new(0.3, -0.5, 0.2), Spectrum::splat(0.1))
            .unwrap();
        let scene = b.build().unwrap().0;
        let choice = LightChoice {
            mode,
            lamp_samples: samples,
        };
        if let Some(lamps) = scene.light_selection(choice).all() {
            // Two balls, a quad and a point
            assert_eq!(lamps.len(), 4);
            assert_eq!(lamps.samples(), if samples == 1 { 4 } else { 3 + 1 + 2 + 1 });
        }
        let camera = pinhole(Vec3::ZERO, Vec3::new(0.3, -1.0, 0.2), 70.0);
        let resolution = UVec2::splat(16);
        let film = with_world((&scene, choice), camera, resolution, |world| {
            let integrator = PathIntegrator {
                strategy: Strategy {
                    direct,
                    ..Strategy::default()
                },
                ..path_tracer(world, Some(3))
            };
            film_of(&integrator, resolution, 1024, seed)
        });
        Mean::of_film(&film, 0)
    };
    let reference = render(SelectionMode::Power, 1, DirectLight::Mis, 0);
    for (samples, direct) in [(1, DirectLight::Mis), (3, DirectLight::Mis), (3, DirectLight::Light)] {
        let mean = render(SelectionMode::All, samples, direct, 1);
        assert_same_mean(format!("{samples} samples, {direct:?}"), mean, reference);
    }
}

/// Selection by place and by power agree in every integrator that samples lights, with and without
/// path reuse. The room has matte, glossy and transparent objects, a large lamp, many small lamps,
/// a sun and a sky.
#[cfg(any(feature = "embree", feature = "obvhs"))]
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn selection_by_place_and_by_power_agree() {
    use embrasure::integrator::DistributedIntegrator;
    use embrasure::material::Gloss;
    let scene = {
        let mut b = SceneBuilder::new();
        // Build a room with an open roof
        let mut walls = room();
        walls
            .triangles
            .retain(|t| t.iter().any(|&i| walls.positions[i as usize].y < 0.0));
        add(&mut b, walls, material(0.6, 0.0));
        add(
            &mut b,
            sphere(0.3, Vec3::new(-0.4, -0.6, -0.3), 2),
            Material {
                specular: Spectrum::splat(0.5),
                gloss: Gloss::Phong(10.0),
                ..material(0.3, 0.0)
            },
        );
        add(
            &mut b,
            sphere(0.3, Vec3::new(0.5, -0.6, 0.2), 2),
            Material {
                transmission: Spectrum::splat(0.9),
                ..material(0.0, 0.0)
            },
        );
        for i in 0..90u32 {
            let c = Vec3::new(at(i).x, 0.9 * at(i).y, at(i + 500).x) * 1.6 - Vec3::new(0.8, 0.5, 0.8);
            let lamp = [c, c + Vec3::new(0.05, 0.0, 0.0), c + Vec3::new(0.0, 0.02, 0.05)];
            add(&mut b, polygon(&lamp), material(0.0, 10.0));
        }
        let window = [
            Vec3::new(-0.98, -0.5, -0.5),
            Vec3::new(-0.98, 0.5, -0.5),
            Vec3::new(-0.98, 0.5, 0.5),
            Vec3::new(-0.98, -0.5, 0.5),
        ];
        add(&mut b, polygon(&window), material(0.2, 1.0));
        b.add_directional_light(Vec3::new(0.3, -1.0, 0.2), Spectrum::splat(0.5))
            .unwrap();
        b.add_constant_light(Spectrum::splat(0.3)).unwrap();
        b.build().unwrap().0
    };
    let resolution = UVec2::splat(16);
    let camera = pinhole(Vec3::new(0.0, 0.2, 0.95), Vec3::new(0.0, -0.4, 0.0), 80.0);
    for what in ["alone", "shared", "branching"] {
        // With the same seed, camera rays hit the same points, so the ratio of two renders has less
        // noise than each mean. Errors are computed from renders with different seeds.
        let means = [SelectionMode::Power, SelectionMode::Place].map(|mode| {
            with_world((&scene, mode), camera, resolution, |world| -> Vec<f64> {
                let path = PathIntegrator {
                    light_samples: 2,
                    ..path_tracer(world, Some(5))
                };
                let path = PathTracer {
                    path,
                    reuse: what == "shared",
                };
                let branching = DistributedIntegrator {
                    world,
                    strategy: Strategy::default(),
                    max_depth: 3,
                    branching: 2,
                };
                let film = |seed| match what {
                    "branching" => film_of(&branching, resolution, 32, seed),
                    _ => film_of(&path, resolution, 64, seed),
                };
                (0..16).map(|seed| film_mean(&film(seed), 1)).collect()
            })
        });
        let [power, place] = &means;
        let ratios: Vec<f64> = power.iter().zip(place).map(|(a, b)| b / a - 1.0).collect();
        let mean = Mean::of(&ratios);
        assert!(mean.error() < 0.003, "{what}: {mean}: the error is too large");
        assert_same_mean(format!("{what}: by place brighter"), mean, Mean::exact(0.0));
    }
}
/// A square lamp at y = 1 that faces down, from -1 to 1, cut into `n` × `n` squares. Texture
/// coordinates run from 0 to 1 along x and z.
fn textured_lamp(n: u32) -> Mesh {
    let along = |i: u32| i as f32 / n as f32;
    let places = || (0..=n).flat_map(|z| (0..=n).map(move |x| Vec2::new(along(x), along(z))));
    let corner = |x: u32, z: u32| z * (n + 1) + x;
    let squares = (0..n).flat_map(|z| (0..n).map(move |x| (x, z)));
    Mesh {
        positions: places()
            .map(|uv| Vec3::new(2.0 * uv.x - 1.0, 1.0, 2.0 * uv.y - 1.0))
            .collect(),
        triangles: squares
            .flat_map(|(x, z)| {
                let [a, b, c, d] = [corner(x, z), corner(x + 1, z), corner(x + 1, z + 1), corner(x, z + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect(),
        uvs: places().collect(),
        ..Mesh::default()
    }
}

/// Material that emits `radiance` times the only texture of the scene.
fn glowing(radiance: f32, diffuse: f32) -> Material {
    let mut glowing = material(diffuse, radiance);
    glowing.maps.emission = Some(Map {
        texture: TextureId(0),
        mapping: Mapping::default(),
    });
    glowing
}

fn grey_texture(width: usize, height: usize, value: impl Fn(usize, usize) -> f32) -> Texture {
    let texels = (0..width * height).map(|i| value(i % width, i / width)).collect();
    Texture::new(width, height, 1, Texels::Floats(texels), Wrap::Clamp).unwrap()
}

/// Mean radiance of `scene` by the path tracer with `direct`, with its standard error.
fn seen(scene: &Scene, camera: CameraParameters, spp: u32, direct: DirectLight, max_depth: u32) -> Mean {
    let size = UVec2::splat(8);
    with_world(scene, camera, size, |world| {
        let strategy = Strategy {
            direct,
            ..Strategy::default()
        };
        let integrator = PathIntegrator {
            strategy,
            ..path_tracer(world, Some(max_depth))
        };
        Mean::of_film(&film_of(&integrator, size, spp, 7), 0)
    })
}

/// One half of a lamp is black, and the lamp has large or small triangles. The floor below gets
/// half of the light that the form factor of the rectangle gives.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn half_black_lamp_gives_half_the_light() {
    for (pieces, sampling) in [
        (1, TriangleSampling::Area),
        (1, TriangleSampling::SolidAngle),
        (8, TriangleSampling::Area),
    ] {
        let mut b = SceneBuilder::new();
        b.triangle_sampling(sampling);
        let texture = grey_texture(1024, 1, |x, _| if x < 512 { 0.0 } else { 1.0 });
        b.set_textures(vec![texture], &[Some(TextureId(0))]);
        // If the emission is 0, the texture without a factor is the emission.
        add(&mut b, textured_lamp(pieces), glowing(0.0, 0.0));
        let floor = [[-2.0, -2.0], [-2.0, 2.0], [2.0, 2.0], [2.0, -2.0]].map(|[x, z]| Vec3::new(x, 0.0, z));
        add(&mut b, polygon(&floor), material(0.8, 0.0));
        let scene = b.build().unwrap().0;
        let black = scene.lights().iter().filter(|light| light.power(1.0) == 0.0).count();
        // Columns of squares beside the edge contain part of its soft step.
        assert_eq!(black, if pieces == 8 { 3 * 8 * 2 } else { 0 });

        // Two quarters of the square, each with a corner above the point (Howell, "Radiation Heat
        // Transfer Configuration Factors", B-3)
        let quarter = (1.0 / 2f64.sqrt() * (1.0 / 2f64.sqrt()).atan()) / std::f64::consts::PI;
        let expected = 0.8 * 2.0 * quarter;
        let camera = pinhole(Vec3::new(0.0, 0.5, 0.0), Vec3::ZERO, 0.1);
        for direct in [DirectLight::Mis, DirectLight::Light, DirectLight::None] {
            let mean = seen(&scene, camera, 8192, direct, 1);
            let what = format!("{pieces} {sampling:?} {direct:?}");
            assert_same_mean(what, mean, Mean::exact(expected));
        }
    }
}

/// A texture has a single bright texel beside a few dim texels. Even if the mip level used for
/// power does not contain the bright texel, its light is found.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn single_emitting_texel_lights_a_room() {
    let mut b = SceneBuilder::new();
    let texture = grey_texture(48, 32, |x, y| match (x, y) {
        (35, 10) => 40.0,
        (5..=15, 20..) => 0.2 * (x % 4) as f32,
        _ => 0.0,
    });
    b.set_textures(vec![texture], &[Some(TextureId(0))]);
    add(&mut b, room(), material(0.6, 0.0));
    let mut lamp = textured_lamp(3);
    lamp.positions.iter_mut().for_each(|p| *p *= Vec3::new(0.9, 0.8, 0.9));
    add(&mut b, lamp, glowing(2.0, 0.4));
    let scene = b.build().unwrap().0;
    let camera = pinhole(Vec3::new(0.0, -0.5, 0.95), Vec3::new(0.0, 0.3, 0.0), 80.0);
    let size = UVec2::splat(8);
    let naive = with_world(&scene, camera, size, |world| {
        let integrator = NaiveIntegrator::new(world, Some(4), Roulette::default());
        Mean::of_film(&film_of(&integrator, size, 1 << 15, 6), 0)
    });
    for direct in [DirectLight::Mis, DirectLight::Light] {
        assert_same_mean(format!("{direct:?}"), seen(&scene, camera, 8192, direct, 4), naive);
        assert!(naive.error() < 0.02 * naive.value, "{naive}: the error is too large");
    }
}

/// Mirrored or moving copies of a lamp have the texture in the right orientation: light samples
/// agree with rays that hit the lamp.
#[test]
fn instanced_lamps_keep_their_texture() {
    let mirror = Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0).into());
    let aside = Affine3A::from_translation(Vec3::new(0.2, 0.1, 0.0).into()) * mirror;
    let floor = |placement: Option<Placement>, is_flipped: bool| {
        let mut b = SceneBuilder::new();
        let texture = grey_texture(64, 1, |x, _| {
            let x = if is_flipped { 63 - x } else { x };
            if x < 16 { 0.0 } else { 1.0 }
        });
        b.set_textures(vec![texture], &[Some(TextureId(0))]);
        let lamp = b.add_material(glowing(0.0, 0.0)).unwrap();
        match placement {
            Some(placement) => {
                let prototype = b.add_prototype(vec![(textured_lamp(1), lamp)]).unwrap();
                b.add_instance(prototype, placement).unwrap();
            }
            None => b.add_mesh(textured_lamp(1), lamp).unwrap(),
        }
        let floor = [[-2.0, -2.0], [-2.0, 2.0], [2.0, 2.0], [2.0, -2.0]].map(|[x, z]| Vec3::new(x, 0.0, z));
        add(&mut b, polygon(&floor), material(0.8, 0.0));
        let scene = b.build().unwrap().0;
        let place = Vec3::new(-0.8, 0.0, 0.1);
        let camera = pinhole(place + 0.5 * Vec3::Y, place, 0.1);
        [DirectLight::Light, DirectLight::None].map(|direct| seen(&scene, camera, 4096, direct, 1))
    };
    for (name, placement) in [
        ("mirrored", Placement::Still(mirror)),
        ("moving", Placement::Moving(vec![mirror, aside].into())),
    ] {
        let [sampled, met] = floor(Some(placement), false);
        assert_same_mean(name, sampled, met);
    }
    // A mirrored copy equals a lamp with a mirrored texture.
    let copy = floor(Some(Placement::Still(mirror)), false)[0];
    let [plain, flipped] = [false, true].map(|is_flipped| floor(None, is_flipped)[0]);
    assert_same_mean("flipped", copy, flipped);
    assert!(copy.t(plain).0.abs() > 20.0, "{copy} {plain}");
}

/// Skies of one elevation and turbidity share one image for any scale and azimuth, and their light
/// adds up.
#[test]
fn skies_of_one_elevation_share_their_image() {
    let sky = |azimuth: f32, elevation: f32, scale: f32| SkyParameters {
        sun: [azimuth, elevation],
        scale,
        turbidity: 3.0,
        up: Vec3::Y,
    };
    let bytes = |skies: &[SkyParameters]| {
        let mut b = SceneBuilder::new();
        add(&mut b, panel(0.0, 1.0), material(0.5, 0.0));
        skies.iter().for_each(|sky| b.add_sky(sky).unwrap());
        b.build().unwrap().0.bytes()
    };
    let one = bytes(&[sky(0.0, 30.0, 1.0)]);
    let shared = bytes(&[sky(0.0, 30.0, 1.0), sky(70.0, 30.0, 2.0)]);
    let different = bytes(&[sky(0.0, 30.0, 1.0), sky(0.0, 31.0, 1.0)]);
    assert!(one > 1_000_000 && shared < one + 10_000, "{one} {shared}");
    assert!(different > 2 * one - 10_000, "{one} {different}");

    let light = |skies: &[SkyParameters]| floor_radiance(|b| skies.iter().for_each(|sky| b.add_sky(sky).unwrap()));
    let (one, three) = (
        light(&[sky(0.0, 30.0, 1.0)]),
        light(&[sky(0.0, 30.0, 1.0), sky(70.0, 30.0, 2.0)]),
    );
    assert!((three / (3.0 * one) - 1.0).abs() < 5e-3, "{one} {three}");
}
