//! Emitting surfaces whose opacity is below 1: closed forms, and all integrators against each
//! other.

use super::bent_normals::{MAX_T, compare};
use super::{metropolis, mlt};
use crate::support::statistics::{Mean, assert_same_mean};
use crate::support::*;
use embrasure::camera::CameraParameters;
use embrasure::color::Spectrum;
use embrasure::film::Filter;
use embrasure::geometry::Mesh;
use embrasure::integrator::{DirectLight, MetropolisDirect, PathIntegrator, Strategy};
use embrasure::light::{AreaLight, Light};
use embrasure::material::Material;
use embrasure::math::{UVec2, Vec3};
use embrasure::scene::{Scene, SceneBuilder};
use half::f16;
use std::fs;

/// A black surface with emission 3 and the opacity `opacity`.
fn lamp(opacity: f32) -> Material {
    Material {
        opacity,
        ..material(0.0, 3.0)
    }
}

/// Corners of a square of half width 1 at height `y`, facing down.
fn ceiling(y: f32) -> [Vec3; 4] {
    [
        Vec3::new(-1.0, y, -1.0),
        Vec3::new(1.0, y, -1.0),
        Vec3::new(1.0, y, 1.0),
        Vec3::new(-1.0, y, 1.0),
    ]
}

/// A floor of reflectance 0.6 below lamps with `opacities`, the lowest first.
fn floor_below(opacities: &[f32]) -> Scene {
    let mut b = SceneBuilder::new();
    let floor = ceiling(0.0).map(|p| 20.0 * Vec3::new(p.x, p.y, -p.z));
    add(&mut b, polygon(&floor), material(0.6, 0.0));
    for (i, &opacity) in opacities.iter().enumerate() {
        add(&mut b, polygon(&ceiling(1.5 + i as f32)), lamp(opacity));
    }
    b.build().unwrap().0
}

/// Radiance of the floor below the middle of the lamp, found by light samples, by scattered rays,
/// and by both.
fn floor_radiances(scene: &Scene) -> [Mean; 3] {
    let camera = pinhole(Vec3::new(0.4, 0.7, 1.0), Vec3::ZERO, 0.01);
    let size = UVec2::splat(16);
    [DirectLight::Light, DirectLight::None, DirectLight::Mis].map(|direct| {
        with_world(scene, camera, size, |world| {
            let path = PathIntegrator {
                strategy: Strategy {
                    direct,
                    ..Strategy::default()
                },
                ..path_tracer(world, Some(1))
            };
            Mean::of_film(&film_of(&path, size, budget(4096), 7), 0)
        })
    })
}

#[test]
fn lamp_light_is_proportional_to_opacity() {
    let [_, _, whole] = floor_radiances(&floor_below(&[1.0]));
    for opacity in [0.5, 0.2] {
        let expected = Mean::new(whole.value * f64::from(opacity), whole.error() * f64::from(opacity));
        let scene = floor_below(&[opacity]);
        for (how, got) in ["light", "none", "mis"].into_iter().zip(floor_radiances(&scene)) {
            assert_same_mean(format!("opacity {opacity}, {how}"), got, expected);
            assert!(got.error() < 0.01 * slack() * expected.value, "{got}");
        }
    }
}

/// The opacities of a lamp are given at its vertices. Light samples, scattered rays, and both
/// together find the same light.
#[test]
fn opacities_of_vertices_dim_lamps() {
    let scene = |alphas: [f32; 4]| {
        let mut b = SceneBuilder::new();
        let floor = ceiling(0.0).map(|p| 20.0 * Vec3::new(p.x, p.y, -p.z));
        add(&mut b, polygon(&floor), material(0.6, 0.0));
        let mesh = Mesh {
            alphas: alphas.map(f16::from_f32).to_vec(),
            ..polygon(&ceiling(1.5))
        };
        add(&mut b, mesh, lamp(1.0));
        b.build().unwrap().0
    };
    let [_, _, expected] = floor_radiances(&floor_below(&[0.5]));
    for got in floor_radiances(&scene([0.5; 4])) {
        assert_same_mean("opacity 0.5 of all vertices", got, expected);
    }
    let [light, none, mis] = floor_radiances(&scene([0.0, 1.0, 0.25, 0.75]));
    assert_same_mean("light and none", light, none);
    assert_same_mean("light and mis", light, mis);
    assert!(light.value < expected.value * 1.2 && light.value > expected.value * 0.5);
}

#[test]
fn lamp_behind_a_lamp_shines_through_it() {
    let [_, _, low] = floor_radiances(&floor_below(&[1.0]));
    let [_, _, high] = floor_radiances(&floor_below(&[0.0, 1.0]));
    let expected = Mean::new(
        0.4 * low.value + 0.6 * 0.7 * high.value,
        low.error().hypot(high.error()),
    );
    let scene = floor_below(&[0.4, 0.7]);
    for (how, got) in ["light", "none", "mis"].into_iter().zip(floor_radiances(&scene)) {
        assert_same_mean(how, got, expected);
    }
}

#[test]
fn camera_sees_lamps_weighted_by_opacity() {
    let mut b = SceneBuilder::new();
    add(&mut b, panel(0.0, 2.0), lamp(0.3));
    add(&mut b, panel(-1.0, 3.0), lamp(0.6));
    let scene = b.build().unwrap().0;
    let film = render_film(&scene, from_front(), [32, 32], 256, Some(2));
    let expected = 3.0 * (0.3 + 0.7 * 0.6);
    assert_same_mean("two lamps", Mean::of_film(&film, 0), Mean::exact(expected));
}

#[test]
fn lamp_power_is_proportional_to_opacity() {
    let power = |opacity| {
        let scene = floor_below(&[opacity]);
        scene.lights().iter().map(|light| light.power(1.0)).sum::<f64>()
    };
    let whole = power(1.0);
    assert!((power(0.25) / whole - 0.25).abs() < 1e-6);
    // A lamp of opacity 0 has no power. A scene without power gets the default light.
    let scene = floor_below(&[0.0]);
    assert!(scene.lights().iter().any(|light| matches!(light, Light::Constant(_))));
}

/// Walls that do not touch, and two lamps. One lamp has textures of opacity and emission. The other
/// has the opacity 0.4, and is in front of the first lamp and of the camera.
fn masked_lamps() -> (Scene, CameraParameters) {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write_png(
        &folder.path().join("mask.png"),
        4,
        &[0, 40, 255, 128, 255, 0, 90, 255, 20, 255, 200, 0, 255, 160, 0, 60].map(|grey: u8| [grey; 3]),
    );
    write_png(
        &folder.path().join("glow.png"),
        2,
        &[[255, 120, 60], [80, 255, 90], [200, 200, 255], [255, 255, 20]],
    );
    file(
        "lamps.mtl",
        "newmtl floor\nKd 0.6 0.5 0.4\nnewmtl wall\nKd 0.4 0.6 0.7\n\
         newmtl masked\nKd 0.3 0.3 0.3\nKe 3 3 3\nmap_Ke glow.png\nd 0.9\nmap_d mask.png\n\
         newmtl veil\nKd 0.5 0.5 0.5\nKe 0.6 0.8 1\nd 0.4\n",
    );
    file(
        "lamps.obj",
        "mtllib lamps.mtl\n\
         v -0.8 -1 0.8\nv 0.8 -1 0.8\nv 0.8 -1 -0.8\nv -0.8 -1 -0.8\n\
         v -0.8 -0.8 -1\nv 0.8 -0.8 -1\nv 0.8 0.8 -1\nv -0.8 0.8 -1\n\
         v -0.6 0.9 -0.6\nv 0.6 0.9 -0.6\nv 0.6 0.9 0.6\nv -0.6 0.9 0.6\n\
         v -0.5 -0.5 0.3\nv 0.4 -0.5 0.2\nv 0.4 0.3 0.2\nv -0.5 0.3 0.3\n\
         vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
         usemtl floor\nf 1/1 2/2 3/3 4/4\nusemtl wall\nf 5/1 6/2 7/3 8/4\n\
         usemtl masked\nf 9/1 10/2 11/3 12/4\nusemtl veil\nf 13 14 15 16\n",
    );
    let scene = load(&folder.path().join("lamps.obj"));
    (scene, pinhole(Vec3::new(0.1, 0.1, 3.2), Vec3::new(0.0, 0.0, 0.0), 42.0))
}

#[test]
fn integrators_agree_on_masked_lamps() {
    let (scene, camera) = masked_lamps();
    assert!(scene.has_alpha());
    let is_masked = |light: &&Light| matches!(light, Light::Area(AreaLight::Textured(_)));
    assert_eq!(scene.lights().iter().filter(is_masked).count(), 4);
    let mut wrong = Vec::new();
    let mut check = |backend: &str, found: Vec<(&'static str, f64)>| {
        for (name, t) in found {
            println!("{backend}, {name}: |t| = {t:.2}");
            if t > MAX_T {
                wrong.push(format!("{backend}, {name}: |t| = {t:.1}"));
            }
        }
    };
    check("embree", compare(&scene, &backend(&scene), camera));
    #[cfg(feature = "obvhs")]
    check(
        "obvhs",
        compare(&scene, &embrasure::accel::bvh::BvhAccel::new(&scene), camera),
    );
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn metropolis_agrees_on_masked_lamps() {
    let (scene, camera) = masked_lamps();
    mlt::agrees("mlt", &scene, camera, (4, MetropolisDirect::Metropolis), 48);
    metropolis::assert_agrees_with_paths("pssmlt", (&scene, camera, &Filter::BOX), (4, 400), |metropolis| {
        (metropolis.chains, metropolis.bootstrap) = (Some(64), Some(512));
    });
}

/// A shadow-catching ground compares the irradiance with and without the scene. The irradiance
/// without the scene is proportional to the opacity of the lamp.
#[test]
fn irradiance_is_proportional_to_opacity() {
    let irradiance = |opacity| {
        let scene = floor_below(&[opacity]);
        let at = |light: &Light| light.irradiance_at(Vec3::ZERO, Vec3::Y, 0.0).unwrap();
        scene
            .lights()
            .iter()
            .map(at)
            .fold(Spectrum::ZERO, |sum, e| sum + e)
            .mean()
    };
    assert!((irradiance(0.5) / irradiance(1.0) - 0.5).abs() < 1e-5);
}
