//! Absorption inside transmitting bodies.

use crate::support::statistics::{Mean, assert_means_within};
use crate::support::*;
use crate::transport::bidirectional::{assert_same_means, bidirectional, light_tracer, renders};
use embrasure::color::Spectrum;
use embrasure::integrator::{DirectLight, PathIntegrator, Strategy};
use embrasure::material::Material;
use embrasure::math::{UVec2, Vec3};
use embrasure::scene::{Scene, SceneBuilder};

const ABSORPTION: [f32; 3] = [0.5, 1.5, 4.0];

fn absorbing(ior: f32) -> Material {
    Material {
        ior,
        absorption: Spectrum::from(ABSORPTION),
        ..glass([1.0; 3], false)
    }
}

/// A lamp of radiance 2 seen straight through a slab. With `a = exp(−σ d)`, the transmittance is
/// `(1 − R)² a / (1 − R² a²)`. This includes all internal reflections.
#[test]
fn slabs_absorb_by_beers_law() {
    for (ior, thickness) in [(1.0, 0.5f32), (1.0, 2.0), (1.5, 0.5), (2.4, 1.0)] {
        let mut b = SceneBuilder::new();
        add(
            &mut b,
            slab(Vec3::ZERO, Vec3::new(3.0, 3.0, 0.5 * thickness)),
            absorbing(ior),
        );
        let lamp = [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]].map(|[x, y]| Vec3::new(x, y, -3.0));
        add(&mut b, polygon(&lamp), material(0.0, 2.0));
        let scene = b.build().unwrap().0;
        let camera = pinhole(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 1.0);
        let film = render_film(&scene, camera, [8, 8], 4096, Some(60));
        let r = f64::from((ior - 1.0) / (ior + 1.0)).powi(2);
        for (c, absorption) in ABSORPTION.into_iter().enumerate() {
            let a = (-f64::from(absorption * thickness)).exp();
            let expected = 2.0 * (1.0 - r).powi(2) * a / (1.0 - r * r * a * a);
            let what = format!("{ior} {thickness} {c}");
            assert_means_within(what, Mean::of_film(&film, c), Mean::exact(expected), 3e-3 * expected);
        }
    }
}

/// Absorption depends on the path length in the body: from inside, and from outside at an angle.
#[test]
fn absorption_depends_on_path_length() {
    let scene = || {
        let mut b = SceneBuilder::new();
        add(&mut b, slab(Vec3::ZERO, Vec3::new(50.0, 50.0, 0.5)), absorbing(1.0));
        let lamp = [[-99.0, -99.0], [99.0, -99.0], [99.0, 99.0], [-99.0, 99.0]].map(|[x, y]| Vec3::new(x, y, -3.0));
        add(&mut b, polygon(&lamp), material(0.0, 1.0));
        b.build().unwrap().0
    };
    for (from, to, length) in [
        (Vec3::new(0.0, 0.0, 0.25), Vec3::ZERO, 0.75),
        (Vec3::new(0.0, 0.0, 2.0), Vec3::new(0.0, 3.0, -2.0), 1.25),
        (Vec3::new(0.0, 0.0, -0.25), Vec3::new(0.0, 3.0, -4.25), 0.25 * 1.25),
    ] {
        let film = render_film(&scene(), pinhole(from, to, 0.1), [8, 8], 4096, Some(8));
        for (c, absorption) in ABSORPTION.into_iter().enumerate() {
            let expected = (-f64::from(absorption) * length).exp();
            let what = format!("{from} {c}");
            assert_means_within(what, Mean::of_film(&film, c), Mean::exact(expected), 3e-3 * expected);
        }
    }
}

/// A room with a lamp and a block of absorbing glass of this `roughness`, with a matte ball inside.
fn aquarium(roughness: f32) -> Scene {
    let mut b = SceneBuilder::new();
    add(&mut b, room(), material(0.5, 0.0));
    let lamp = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(|[x, z]| Vec3::new(x, 0.95, z));
    add(&mut b, polygon(&lamp), material(0.0, 4.0));
    let body = Material {
        roughness,
        absorption: Spectrum::rgb(0.3, 1.0, 2.0),
        ..glass([1.0; 3], false)
    };
    add(&mut b, slab(Vec3::new(0.1, -0.4, -0.1), Vec3::new(0.5, 0.5, 0.5)), body);
    add(&mut b, sphere(0.25, Vec3::new(0.1, -0.5, -0.1), 2), material(0.8, 0.0));
    b.build().unwrap().0
}

/// Estimators from camera and lights agree with objects inside bodies, because a segment absorbs
/// the same light in both directions.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn estimators_agree_on_absorbing_bodies() {
    let resolution = UVec2::splat(8);
    let camera = pinhole(Vec3::new(-0.3, 0.3, 0.95), Vec3::new(0.0, -0.4, 0.0), 80.0);
    for roughness in [0.0, 0.5] {
        let scene = aquarium(roughness);
        assert!(scene.has_absorption());
        with_world(&scene, camera, resolution, |world| {
            let path = |direct| PathIntegrator {
                strategy: Strategy {
                    direct,
                    ..Strategy::default()
                },
                ..path_tracer(world, Some(6))
            };
            let expected = renders(|seed| film_of(&path(DirectLight::Mis), resolution, budget(256), seed));
            let reusing = PathTracer {
                path: path(DirectLight::Mis),
                reuse: true,
            };
            let reused = renders(|seed| film_of(&reusing, resolution, budget(256), 50 + seed));
            assert_same_means(&format!("reuse, roughness {roughness}"), &reused, &expected);
            let blind = renders(|seed| film_of(&path(DirectLight::None), resolution, budget(1024), 100 + seed));
            assert_same_means(&format!("no light samples, roughness {roughness}"), &blind, &expected);
            let films =
                renders(|seed| film_of_iterations(&bidirectional(world, 6), resolution, budget(128), 150 + seed));
            assert_same_means(&format!("bdpt, roughness {roughness}"), &films, &expected);
            if roughness > 0.0 {
                // Light samples alone and light tracing can connect points through rough glass, but
                // not through smooth glass.
                let sampled = renders(|seed| film_of(&path(DirectLight::Light), resolution, budget(512), 200 + seed));
                assert_same_means("light samples", &sampled, &expected);
                let films = renders(|seed| film_of_iterations(&light_tracer(world, 6), resolution, budget(512), seed));
                assert_same_means("light tracing", &films, &expected);
            }
        });
    }
}
