//! Shadow-catching ground: closed forms, and flags and keys through the real program. Tests of
//! invalid values are in `background.rs`.

use crate::lighting::background::stage;
use crate::support::program::{done, json, printed, split};
use crate::support::statistics::{Mean, assert_same_mean};
use crate::support::*;
use embrasure::camera::CameraParameters;
use embrasure::color::Spectrum;
use embrasure::film::{Backing, Film, Rect};
use embrasure::integrator::*;
use embrasure::light::LatLongImage;
use embrasure::light_sampling::SelectionMode;
use embrasure::math::{Quat, UVec2, Vec3};
use embrasure::scene::{GroundPlane, Scene, SceneBuilder};
use embrasure::scene_file::{SceneFile, load_scene};

const SIZE: UVec2 = UVec2::new(24, 24);

/// A ground at y = 0 of radius 20, and a tiny mesh so far above the ground that it casts no shadow.
fn empty_stage(light: impl FnOnce(&mut SceneBuilder)) -> Scene {
    let mut b = SceneBuilder::new();
    let speck = [
        Vec3::new(0.0, 900.0, 0.0),
        Vec3::new(0.0, 900.0, 0.01),
        Vec3::new(0.01, 900.0, 0.0),
    ];
    add(&mut b, polygon(&speck), material(0.5, 0.0));
    b.set_ground(GroundPlane {
        point: Some(Vec3::ZERO),
        radius: Some(20.0),
        ..GroundPlane::default()
    })
    .unwrap();
    light(&mut b);
    b.build().unwrap().0
}

/// Cameras that view the middle of the ground from above, and its rim.
fn cameras() -> [CameraParameters; 2] {
    [
        pinhole(Vec3::new(0.5, 3.0, 2.0), Vec3::ZERO, 60.0),
        pinhole(Vec3::new(10.0, 4.0, 0.0), Vec3::new(16.0, 0.0, 0.0), 50.0),
    ]
}

fn map() -> LatLongImage {
    let (width, height) = (16, 8);
    let texel = |i: usize| match (i % width, i / width) {
        (5, 2) => Spectrum::splat(30.0),
        (x, y) if y < 4 => Spectrum::rgb(0.1 * x as f32, 0.5, 1.0),
        _ => Spectrum::splat(0.2),
    };
    LatLongImage {
        width,
        height,
        texels: (0..width * height).map(texel).collect(),
    }
}

/// Renders `scene` with `background` by path tracing, with or without path reuse.
fn film_over<'a>(
    scene: impl Into<LitScene<'a>>,
    camera: CameraParameters,
    background: Background,
    reuse: bool,
    spp: u32,
) -> Film {
    with_world(scene, camera, SIZE, |world| {
        let world = World {
            backdrop: Backdrop {
                background,
                up: Vec3::Y,
            },
            ..world
        };
        let path = path_tracer(world, Some(3));
        let mut film = Film::new(SIZE, Rect::full(SIZE));
        if background == Background::Transparent {
            film = film.with_backing(Backing::Transparent);
        }
        render_into(&mut film, &PathTracer { path, reuse }, &independent(5), spp);
        film
    })
}

/// Without objects, the mean of the ground is the background, for all lights. This includes the
/// fading rim of the ground.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn ground_without_objects_is_the_background() {
    type Light = (&'static str, fn(&mut SceneBuilder));
    let lights: [Light; 5] = [
        ("constant", |b| {
            b.add_constant_light(Spectrum::rgb(0.5, 1.0, 2.0)).unwrap()
        }),
        ("environment", |b| {
            b.add_environment(map(), 1.5, Quat::from_rotation_z(0.5)).unwrap();
        }),
        ("sun and sky", |b| {
            b.add_directional_light(Vec3::new(1.0, -2.0, 0.3), Spectrum::splat(3.0))
                .unwrap();
            b.add_constant_light(Spectrum::splat(0.3)).unwrap();
        }),
        ("points", |b| {
            b.add_point_light(Vec3::new(0.0, 5.0, 1.0), Spectrum::splat(40.0))
                .unwrap();
            let down = Vec3::new(0.1, -1.0, 0.0);
            b.add_spot_light(Vec3::new(1.0, 8.0, 0.0), down, Spectrum::splat(90.0), 50.0, 30.0)
                .unwrap();
        }),
        ("lamp", |b| {
            let corner = |x: f32, z: f32| Vec3::new(2.0 * x, 6.0 - x, 2.0 * z - 3.0);
            let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
            add(b, polygon(&corners), material(0.0, 8.0));
        }),
    ];
    for (name, light) in lights {
        // The mode `Auto` computes the light that the scene blocks. The mode `All` samples all
        // lights, and computes the light that arrives.
        for selection in [SelectionMode::Auto, SelectionMode::All] {
            let scene = empty_stage(light);
            for (i, camera) in cameras().into_iter().enumerate() {
                for reuse in [false, true] {
                    let film = film_over(
                        (&scene, selection),
                        camera,
                        Background::Color(Spectrum::splat(0.75)),
                        reuse,
                        256,
                    );
                    let what = format!("{name}, {selection:?}, camera {i}, reuse {reuse}");
                    // If all lights are sampled and are delta lights, there is no noise except
                    // rounding.
                    let (mean, noise) = (film_mean(&film, 0), film_error(&film, 0));
                    match noise < 1e-7 {
                        true => assert!((mean - 0.75).abs() < 1e-5, "{what}: {mean}"),
                        false => assert_unbiased(&what, &film, 0.75),
                    }
                    // Without objects nearby no light is blocked, so there is no noise.
                    let is_exact = selection == SelectionMode::Auto && name != "lamp";
                    assert!(!is_exact || noise == 0.0, "{what}: {noise}");
                }
            }
        }
    }
}

/// Other integrators give the ground the same radiance as path tracing.
#[test]
fn all_estimators_agree_on_the_ground() {
    let scene = empty_stage(|b| b.add_environment(map(), 1.0, Quat::IDENTITY).unwrap());
    let background = Background::Color(Spectrum::splat(0.75));
    with_world(&scene, cameras()[0], SIZE, |world| {
        let backdrop = Backdrop {
            background,
            up: Vec3::Y,
        };
        let world = World { backdrop, ..world };
        let naive = NaiveIntegrator::new(world, Some(1), Roulette::default());
        assert_unbiased("naive", &film_of(&naive, SIZE, 1024, 1), 0.75);
        let whitted = WhittedIntegrator {
            world,
            max_depth: Some(1),
        };
        assert_unbiased("whitted", &film_of(&whitted, SIZE, 256, 1), 0.75);
        let distributed = DistributedIntegrator {
            world,
            strategy: Strategy::default(),
            max_depth: 1,
            branching: 4,
        };
        assert_unbiased("distributed", &film_of(&distributed, SIZE, 256, 1), 0.75);
    });
}

/// Estimates of blocked light and of arriving light have the same mean. This includes the shadow of
/// a ball, and light that the ball scatters.
#[test]
fn missing_and_arriving_light_agree_on_ground() {
    let scene = {
        let mut b = SceneBuilder::new();
        add(&mut b, sphere(1.0, Vec3::new(0.0, 1.0, 0.0), 3), material(0.8, 0.0));
        b.set_ground(GroundPlane::default()).unwrap();
        b.add_environment(map(), 1.0, Quat::IDENTITY).unwrap();
        b.add_directional_light(Vec3::new(1.0, -1.5, 0.0), Spectrum::splat(2.0))
            .unwrap();
        b.build().unwrap().0
    };
    let camera = pinhole(Vec3::new(1.0, 3.0, 4.0), Vec3::new(0.7, 0.2, 0.5), 50.0);
    for background in [Background::Color(Spectrum::rgb(0.3, 0.5, 1.0)), Background::Transparent] {
        for reuse in [false, true] {
            let [missing, arriving] = [SelectionMode::Auto, SelectionMode::All]
                .map(|selection| film_over((&scene, selection), camera, background, reuse, 512));
            if background == Background::Transparent {
                // Ratio of the light on the ground with the scene to the light without the scene,
                // before clamping
                let mean = |film: &Film| {
                    let sums = film.tiles().iter().flat_map(|tile| {
                        let pixels = tile.bounds().pixels();
                        pixels.map(|pixel| tile.background(pixel).unwrap().mean(512)[1])
                    });
                    sums.sum::<f64>() / (SIZE.x * SIZE.y) as f64
                };
                let [a, b] = [&missing, &arriving].map(mean);
                assert!((a - b).abs() < 0.03 && a > 0.2 && a < 0.95, "reuse {reuse}: {a}, {b}");
                continue;
            }
            for c in 0..3 {
                let [a, b] = [&missing, &arriving].map(|film| Mean::of_film(film, c));
                assert_same_mean(format!("reuse {reuse}, channel {c}"), a, b);
                let scores = missing.pixels().map(|(pixel, a)| {
                    let b = arriving.sums(pixel).unwrap();
                    let variance = a.variance_of_mean(c) + b.variance_of_mean(c);
                    (a.mean(c) - b.mean(c)) / variance.sqrt().max(1e-9)
                });
                let beyond = scores.filter(|z| z.abs() > 4.5).count();
                assert!(beyond <= 8, "reuse {reuse}: {beyond} of {}", SIZE.x * SIZE.y);
            }
        }
    }
}

/// With the background `light`, the ground shows the radiance of the constant environment behind
/// it.
#[test]
fn a_ground_shows_the_lights_behind_it() {
    let scene = empty_stage(|b| {
        b.add_constant_light(Spectrum::splat(0.4)).unwrap();
        b.add_directional_light(Vec3::NEG_Y, Spectrum::ONE).unwrap();
    });
    let film = film_over(&scene, cameras()[0], Background::Light, true, 64);
    assert_unbiased("lights", &film, 0.4f32.into());
}

/// A ball above the ground, under a directional light from straight above.
fn ball_and_sun() -> Scene {
    let mut b = SceneBuilder::new();
    add(&mut b, sphere(1.0, Vec3::new(0.0, 2.0, 0.0), 4), material(0.5, 0.0));
    b.set_ground(GroundPlane {
        point: Some(Vec3::ZERO),
        ..GroundPlane::default()
    })
    .unwrap();
    b.add_directional_light(Vec3::NEG_Y, Spectrum::splat(5.0)).unwrap();
    b.build().unwrap().0
}

/// Under a directional light, without scattering, the ratio of the light with and without the ball
/// is exactly 0 in the umbra and 1 outside.
#[test]
fn a_hard_shadow_is_all_or_nothing() {
    let scene = ball_and_sun();
    let blue = Spectrum::rgb(0.1, 0.2, 0.9);
    for (x, expected) in [(0.0, 0.0), (0.9, 0.0), (1.1, 1.0), (3.0, 1.0)] {
        // View the ground from the side, so that the ball does not hide it
        let camera = pinhole(Vec3::new(x, 0.5, 4.0), Vec3::new(x, 0.0, 0.0), 0.5);
        with_world(&scene, camera, SIZE, |world| {
            for background in [Background::Color(blue), Background::Transparent] {
                let backdrop = Backdrop {
                    background,
                    up: Vec3::Y,
                };
                let path = path_tracer(World { backdrop, ..world }, Some(1));
                let mut film = Film::new(SIZE, Rect::full(SIZE)).with_backing(Backing::Transparent);
                render_into(&mut film, &path, &independent(1), 16);
                for (pixel, sums) in film.pixels() {
                    let alpha = film.coverage(pixel).unwrap()[1] as f64;
                    let wanted = match background {
                        Background::Transparent => ([0.0; 3], 1.0 - expected),
                        _ => (blue.to_array().map(|v| v as f64 * expected), 1.0 - expected),
                    };
                    let close = |a: f64, b: f64| (a - b).abs() < 1e-5;
                    let is_right = (0..3).all(|c| close(sums.mean(c), wanted.0[c])) && close(alpha, wanted.1);
                    assert!(is_right, "{x}, {background:?}: {} {alpha}", sums.mean(2));
                }
            }
        });
    }
}

/// A camera below the ground sees the objects above it.
#[test]
fn the_ground_is_not_seen_from_below() {
    let scene = ball_and_sun();
    let camera = pinhole(Vec3::new(0.0, -5.0, 0.0), Vec3::ZERO, 60.0);
    let film = film_over(&scene, camera, Background::Transparent, true, 64);
    let alpha = |x: u32, y: u32| film.coverage(UVec2::new(x, y)).unwrap()[1];
    assert_eq!((alpha(12, 12), alpha(0, 0)), (1.0, 0.0));
}

/// Photon iterations that splat no light have alpha too.
#[test]
fn photon_iterations_have_alpha() {
    let scene = ball_and_sun();
    let camera = pinhole(Vec3::new(0.0, 2.0, 6.0), Vec3::new(0.0, 2.0, 0.0), 40.0);
    with_world(&scene, camera, SIZE, |world| {
        let integrator = ProgressivePhotonIntegrator {
            world: World {
                backdrop: Backdrop {
                    background: Background::Transparent,
                    up: Vec3::Y,
                },
                ..world
            },
            strategy: Strategy::default(),
            max_depth: Some(1),
            roulette: Roulette::default(),
            photons: Some(16),
            radius: ProgressiveRadius {
                first: SearchRadius::Pixels(2.0),
                alpha: 0.7,
            },
        };
        let mut film = Film::new(SIZE, Rect::full(SIZE)).with_backing(Backing::Transparent);
        render_into(&mut film, &integrator, &independent(3), 8);
        let alpha = |x: u32, y: u32| film.coverage(UVec2::new(x, y)).unwrap()[1];
        assert_eq!((alpha(12, 12), alpha(0, 0)), (1.0, 0.0));
    });
}

/// Both backends hit the ground and give the same shadow.
#[cfg(feature = "obvhs")]
#[test]
fn backends_agree_on_the_ground() {
    let scene = ball_and_sun();
    let camera = pinhole(Vec3::new(2.0, 3.0, 7.0), Vec3::new(0.0, 1.0, 0.0), 50.0);
    let film = film_over(&scene, camera, Background::Transparent, false, 64);
    let other = embrasure::accel::bvh::BvhAccel::new(&scene);
    let dynamic: &dyn embrasure::accel::Accel = &other;
    let second = with_world(&scene, camera, SIZE, |world| {
        let backdrop = Backdrop {
            background: Background::Transparent,
            up: Vec3::Y,
        };
        let path = path_tracer(World { backdrop, ..world }.with_accel(&dynamic), Some(3));
        let mut film = Film::new(SIZE, Rect::full(SIZE)).with_backing(Backing::Transparent);
        render_into(&mut film, &path, &independent(5), 64);
        film
    });
    for pixel in film.crop().pixels() {
        let [a, b] = [&film, &second].map(|film| film.coverage(pixel).unwrap()[1]);
        assert!((a - b).abs() < 0.02, "{pixel}: {a}, {b}");
    }
}

/// Each key of `[ground]` changes the plane of the scene.
#[test]
fn keys_place_the_ground() {
    let of = |ground: &str, set: &[&str]| {
        let folder = stage(ground);
        let set: Vec<String> = set.iter().map(|key| key.to_string()).collect();
        let file = SceneFile::load_with(folder.path().join("s.toml"), &set).unwrap();
        load_scene(&file, SceneBuilder::new()).unwrap().scene
    };
    let plane = |ground: &str| {
        let scene = of(ground, &[]);
        let ground = scene.ground().unwrap();
        (ground.point(), ground.normal(), ground.radius())
    };
    assert!(of("", &[]).ground().is_none());
    // The ground is below the lowest corner of the scene, at y = -2
    let (point, normal, radius) = plane("[ground]");
    assert!(
        point.y < -2.0 && point.y > -2.002 && normal == Vec3::Y,
        "{point} {normal}"
    );
    assert!(radius > 50.0);
    assert_eq!(plane("[ground]\npoint = [0, 0.5, 0]").0, Vec3::new(0.0, 0.5, 0.0));
    let along = plane("[ground]\npoint = [3, 0, 3]\nnormal = [0, 1, 1]").1;
    assert!((along.z - 0.5f32.sqrt()).abs() < 1e-6, "{along}");
    assert_eq!(plane("[ground]\npoint = [0, 0, 0]\nradius = 1.5").2, 1.5);
    // Up is -y: the ground is above the scene.
    assert!(plane("[ground]\nup = [0, -1, 0]").0.y > 0.0);
    let scene = of("[ground]", &["ground.point=[0,1,0]"]);
    assert_eq!(scene.ground().unwrap().point().y, 1.0);
    let albedo = |ground: &str| of(ground, &[]).materials().last().unwrap().diffuse.to_array();
    assert_eq!(albedo("[ground]"), [0.5; 3]);
    assert_eq!(albedo("[ground]\nalbedo = 0.25"), [0.25; 3]);
    assert_eq!(albedo("[ground]\nalbedo = [0.2, 0.8, 0.3]"), [0.2, 0.8, 0.3]);
}

#[test]
fn ground_does_not_change_the_bounds() {
    let folder = stage("[ground]");
    let run = |args: &str| done(folder.path(), &split(args));
    let info = json(&run("info s.toml --json"));
    assert_eq!(info["bounds"][0][1].as_f64(), Some(-2.0), "{info}");
    let plain = "render a.obj -q --spp 4 --size 31x31 --env white --background black --aov id,cryptomatte";
    run(&format!("{plain} -o a.exr"));
    run(&format!("{plain} --ground -o b.exr"));
    let [a, b] = ["a.exr", "b.exr"].map(|name| folder.path().join(name));
    // Ids of objects do not change, because the ground is not a surface of the scene.
    let [before, after] = [a, b].map(|path| read_channel(&path, "id.object"));
    assert!(before.contains(&1.0));
    assert_eq!(before, after);
    let traced = printed(&run("render s.toml --pixel 2,29 --sample 1"));
    assert!(
        traced.contains("sees the ground: the light of the sample times"),
        "{traced}"
    );
    let traced = printed(&run("render s.toml --pixel 2,15 --background transparent --no-ground"));
    assert!(traced.contains("share of the background [1, 1, 1]"), "{traced}");
}
