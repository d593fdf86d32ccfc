//! Backgrounds, alpha and the ground: closed forms, the identity of compositing, and every flag and key by the real program.

use crate::support::program::{INTEGRATORS, assert_same_bits, done, folder, joined, json, printed, refused, split};
use crate::support::*;
use embrasure::accel::Accel;
use embrasure::camera::CameraParameters;
use embrasure::color::Spectrum;
use embrasure::film::{Film, Rect};
use embrasure::integrator::*;
use embrasure::light::{LatLongImage, SelectionMode};
use embrasure::math::{Quat, UVec2, Vec3};
use embrasure::render::{Outcome, render, render_iterations};
use embrasure::sampler::Independent;
use embrasure::scene::{GroundPlane, Scene, SceneBuilder};
use std::path::Path;
use tempfile::TempDir;

const SIZE: UVec2 = UVec2::new(24, 24);

/// A ground at y = 0 of the radius 20, with a speck far above it, which makes no shadow.
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

/// Looks down on the middle of the ground, and at its rim.
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

/// Renders what `background` and the ground of `scene` show, by path tracing with path reuse or without.
fn film_over(scene: &Scene, camera: CameraParameters, background: Background, reuse: bool, spp: u32) -> Film {
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
            film = film.with_alpha();
        }
        let (outcome, statistics) = render(&MaybeReusing { path, reuse }, &Independent::new(5), &mut film, spp, &());
        assert_eq!((outcome, statistics.dropped), (Outcome::Complete, 0));
        film
    })
}

/// Without anything on it, the ground is the background in expectation, whatever the lights and in its fading rim too.
#[test]
fn a_ground_without_objects_is_the_background() {
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
        // The light that is missing is counted, and, where all lights are sampled, that which arrives.
        for selection in [SelectionMode::Auto, SelectionMode::All] {
            let scene = empty_stage(|b| {
                b.light_selection(selection);
                light(b);
            });
            for (i, camera) in cameras().into_iter().enumerate() {
                for reuse in [false, true] {
                    let film = film_over(&scene, camera, Background::Color(Spectrum::splat(0.75)), reuse, 256);
                    let what = format!("{name}, {selection:?}, camera {i}, reuse {reuse}");
                    assert_unbiased(&what, &film, 0.75);
                    // Without anything near, nothing is missing, and there is no noise.
                    let noise = film_error(&film, 0);
                    let is_exact = selection == SelectionMode::Auto && name != "lamp";
                    assert!(!is_exact || noise == 0.0, "{what}: {noise}");
                }
            }
        }
    }
}

/// The other estimators find the same ground.
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
        let naive = NaiveIntegrator {
            world,
            max_depth: Some(1),
            roulette: Roulette::default(),
        };
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

/// Counting what is missing and counting what arrives have one mean, in the shadow of a ball too, with light that the ball scatters.
#[test]
fn missing_light_is_what_does_not_arrive() {
    let stage = |selection| {
        let mut b = SceneBuilder::new();
        b.light_selection(selection);
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
                .map(|selection| film_over(&stage(selection), camera, background, reuse, 512));
            let (mut beyond, mut count) = (0, 0);
            let mut mean = 0.0;
            for (pixel, a) in missing.pixels() {
                let b = arriving.sums(pixel).unwrap();
                if background == Background::Transparent {
                    let [a, b] = [&missing, &arriving].map(|film| film.alpha(pixel).unwrap() as f64);
                    mean += a - b;
                    count += 1;
                    beyond += usize::from((a - b).abs() > 0.25);
                    continue;
                }
                for c in 0..3 {
                    let variance = a.variance_of_mean(c) + b.variance_of_mean(c);
                    let z = (a.mean(c) - b.mean(c)) / variance.sqrt().max(1e-9);
                    beyond += usize::from(z.abs() > 3.5);
                    mean += z;
                    count += 1;
                }
            }
            // The three channels of a pixel go together, so that the mean of z has some 1.7 times the error of independent ones.
            let mean = mean / count as f64;
            let most = if background == Background::Transparent {
                0.01
            } else {
                3.5 * (3.0 / count as f64).sqrt()
            };
            assert!(
                beyond as f64 <= 0.006 * count as f64,
                "reuse {reuse}: {beyond} of {count}"
            );
            assert!(mean.abs() < most, "reuse {reuse}: {mean}, {most}");
        }
    }
}

/// The lights as a background: a constant environment stays the constant that it is.
#[test]
fn a_ground_shows_the_lights_behind_it() {
    let scene = empty_stage(|b| {
        b.add_constant_light(Spectrum::splat(0.4)).unwrap();
        b.add_directional_light(Vec3::NEG_Y, Spectrum::ONE).unwrap();
    });
    let film = film_over(&scene, cameras()[0], Background::Light, true, 64);
    assert_unbiased("lights", &film, 0.4f32.into());
}

/// A ball above the ground, under parallel light from straight above.
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

/// Under parallel light the ratio is 0 in the umbra and 1 outside of it, exactly, if no light is scattered on.
#[test]
fn a_hard_shadow_is_all_or_nothing() {
    let scene = ball_and_sun();
    let blue = Spectrum::rgb(0.1, 0.2, 0.9);
    for (x, expected) in [(0.0, 0.0), (0.9, 0.0), (1.1, 1.0), (3.0, 1.0)] {
        // From the side, so that the ball is not in the way
        let camera = pinhole(Vec3::new(x, 0.5, 4.0), Vec3::new(x, 0.0, 0.0), 0.5);
        with_world(&scene, camera, SIZE, |world| {
            for background in [Background::Color(blue), Background::Transparent] {
                let backdrop = Backdrop {
                    background,
                    up: Vec3::Y,
                };
                let path = path_tracer(World { backdrop, ..world }, Some(1));
                let mut film = Film::new(SIZE, Rect::full(SIZE)).with_alpha();
                let (_, statistics) = render(&path, &Independent::new(1), &mut film, 16, &());
                assert_eq!(statistics.dropped, 0);
                for (pixel, sums) in film.pixels() {
                    let alpha = film.alpha(pixel).unwrap() as f64;
                    let wanted = match background {
                        Background::Transparent => ([0.0; 3], 1.0 - expected),
                        _ => (blue.to_array().map(|v| v as f64 * expected), 1.0),
                    };
                    let close = |a: f64, b: f64| (a - b).abs() < 1e-5;
                    let is_right = (0..3).all(|c| close(sums.mean(c), wanted.0[c])) && close(alpha, wanted.1);
                    assert!(is_right, "{x}, {background:?}: {} {alpha}", sums.mean(2));
                }
            }
        });
    }
}

/// A camera below the ground sees what stands on it.
#[test]
fn the_ground_is_not_seen_from_below() {
    let scene = ball_and_sun();
    let camera = pinhole(Vec3::new(0.0, -5.0, 0.0), Vec3::ZERO, 60.0);
    let film = film_over(&scene, camera, Background::Transparent, true, 64);
    let alpha = |x: u32, y: u32| film.alpha(UVec2::new(x, y)).unwrap();
    assert_eq!((alpha(12, 12), alpha(0, 0)), (1.0, 0.0));
}

/// Iterations that start no light elsewhere have alpha too.
#[test]
fn iterations_have_alpha() {
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
            radius: SearchRadius::Pixels(2.0),
            alpha: 0.7,
        };
        let mut film = Film::new(SIZE, Rect::full(SIZE)).with_alpha();
        let numbers = (&Independent::new(3), &embrasure::film::Filter::BOX);
        render_iterations(&integrator, numbers, &mut film, (8, None), &());
        let alpha = |x: u32, y: u32| film.alpha(UVec2::new(x, y)).unwrap();
        assert_eq!((alpha(12, 12), alpha(0, 0)), (1.0, 0.0));
    });
}

/// Both backends meet the ground, and show the same shadow.
#[cfg(feature = "obvhs")]
#[test]
fn backends_agree_on_the_ground() {
    let scene = ball_and_sun();
    let camera = pinhole(Vec3::new(2.0, 3.0, 7.0), Vec3::new(0.0, 1.0, 0.0), 50.0);
    let film = film_over(&scene, camera, Background::Transparent, false, 64);
    let other = embrasure::accel::bvh::BvhAccel::new(&scene);
    let dynamic: &dyn Accel = &other;
    let second = with_world(&scene, camera, SIZE, |world| {
        let backdrop = Backdrop {
            background: Background::Transparent,
            up: Vec3::Y,
        };
        let path = path_tracer(World { backdrop, ..world }.with_accel(&dynamic), Some(3));
        let mut film = Film::new(SIZE, Rect::full(SIZE)).with_alpha();
        render(&path, &Independent::new(5), &mut film, 64, &());
        film
    });
    for pixel in film.crop().pixels() {
        let [a, b] = [&film, &second].map(|film| film.alpha(pixel).unwrap());
        assert!((a - b).abs() < 0.02, "{pixel}: {a}, {b}");
    }
}

/// A card whose left edge is the middle of the image, a half-transparent one below it, a glass ball and a lamp.
fn stage(more: &str) -> TempDir {
    let fov = 2.0 * (1.0f64 / 10.0).atan().to_degrees();
    folder(&[
        (
            "a.mtl",
            "newmtl paper\nKd 0.5 0.5 0.5\nnewmtl veil\nKd 0.5 0.5 0.5\nd 0.25\nnewmtl glass\nTf 1 1 1\nNi 1.5\nillum 4\n\
             newmtl lamp\nKe 2 2 2\n",
        ),
        (
            "a.obj",
            "mtllib a.mtl\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nusemtl paper\nf 1 2 3 4\n\
             v 0 -2 0\nv 2 -2 0\nusemtl veil\nf 5 6 2 1\n\
             v -0.8 0.2 0\nv -0.2 0.2 0\nv -0.2 0.8 0\nv -0.8 0.8 0\nusemtl glass\nf 7 8 9 10\n\
             v -0.8 -0.8 0\nv -0.5 -0.8 0\nv -0.5 -0.5 0\nusemtl lamp\nf 11 12 13\n",
        ),
        (
            "s.toml",
            &format!(
                "version = 1\n[camera]\nposition = [0, 0, 10]\nlook_at = [0, 0, 0]\nvertical_fov = {fov}\n\
                 [image]\nwidth = 31\nheight = 31\n{more}\n[[light]]\ntype = \"constant\"\nradiance = [0.6, 0.6, 0.6]\n\
                 [[object]]\nobj = \"a.obj\"\n"
            ),
        ),
    ])
}

/// The value of a channel in this column and row of the stage's picture.
fn at(path: &Path, channel: &str, x: usize, y: usize) -> f32 {
    read_channel(path, channel)[y * 31 + x]
}

#[test]
fn alpha_is_coverage() {
    let folder = stage("background = \"transparent\"");
    let path = folder.path().join("o.exr");
    done(folder.path(), &split("render s.toml -q --spp 256 -o o.exr -o o.png"));
    let alpha = |x, y| at(&path, "A", x, y);
    // Covered, not covered, half covered, a quarter opaque, half of that; glass and lamps are surfaces.
    assert_eq!((alpha(25, 5), alpha(2, 15), alpha(8, 8)), (1.0, 0.0, 1.0));
    assert!((alpha(15, 5) - 0.5).abs() < 0.01, "{}", alpha(15, 5));
    assert!((alpha(25, 25) - 0.25).abs() < 0.06, "{}", alpha(25, 25));
    assert!((alpha(15, 25) - 0.125).abs() < 0.05, "{}", alpha(15, 25));
    // Premultiplied: the paper's radiance is 0.3 where it covers all.
    let red = |x, y| at(&path, "R", x, y);
    assert!((red(25, 5) - 0.3).abs() < 0.02 && (red(15, 5) - 0.3 * alpha(15, 5)).abs() < 0.02);
    assert_eq!(red(2, 15), 0.0);

    // A PNG has straight colours: the rim has those of the paper, and no darker ones.
    let decoder = png::Decoder::new(std::io::BufReader::new(
        std::fs::File::open(folder.path().join("o.png")).unwrap(),
    ));
    let mut reader = decoder.read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    assert_eq!(info.color_type, png::ColorType::Rgba);
    let pixel = |x: usize, y: usize| &bytes[4 * (y * 31 + x)..][..4];
    assert_eq!(
        (pixel(2, 15), pixel(25, 5)[3], pixel(15, 5)[3]),
        (&[0, 0, 0, 0][..], 255, 128)
    );
    assert!(
        pixel(25, 5)[0].abs_diff(pixel(15, 5)[0]) <= 4,
        "{:?}, {:?}",
        pixel(25, 5),
        pixel(15, 5)
    );
    // Nothing else has an alpha channel.
    done(
        folder.path(),
        &split("render s.toml -q --spp 4 --background light -o l.exr"),
    );
    let said = std::fs::read(folder.path().join("l.exr")).unwrap();
    assert!(!String::from_utf8_lossy(&said[..2000]).contains("background=transparent"));
}

/// What a transparent picture is over a constant background is the opaque picture, for all integrators and filters that have one.
#[test]
fn over_a_background_it_is_the_opaque_picture() {
    let color = [0.3f32, 0.5, 0.7];
    let folder = stage("[ground]\npoint = [0, -0.3, 0]");
    let mut kinds = 0;
    let ways = INTEGRATORS.iter().map(|name| format!("--integrator {name}"));
    let filters = ["tent", "gaussian", "mitchell", "blackman-harris"].map(|name| format!("--filter {name}"));
    let more = [
        "--reuse none",
        "--backend brute",
        "--sampler independent",
        "--spp 3",
        "--aov lights",
    ]
    .map(String::from);
    for way in ways.chain(filters).chain(more) {
        let has_background = !["light", "bdpt", "pssmlt", "mlt", "vcm"]
            .iter()
            .any(|name| way.ends_with(name));
        if !has_background || way.ends_with("lights") {
            continue;
        }
        // Emission and one scattering, in which no light arrives twice at the ground
        let has_ground = !["ao", "debug", "sppm", "photon-map", "irradiance-cache"]
            .iter()
            .any(|name| way.ends_with(name));
        let ground = if has_ground { "--ground" } else { "--no-ground" };
        let render = |background: &str, name: &str| {
            let line = format!("render s.toml -q --spp 8 {ground} {way} --background {background} -o {name}");
            let line = if way.starts_with("--spp") {
                line.replacen("--spp 8 ", "", 1)
            } else {
                line
            };
            done(folder.path(), &split(&line));
            folder.path().join(name)
        };
        let (clear, opaque) = (render("transparent", "t.exr"), render("0.3,0.5,0.7", "c.exr"));
        let alpha = read_channel(&clear, "A");
        let [clear, opaque] = [clear, opaque].map(|path| read_rgb(&path));
        let mut compared = 0;
        for (i, &a) in alpha.iter().enumerate() {
            // Where it was clamped, the picture is brighter than its background, or no filter's weights sum to 1.
            if (a == 0.0 || a == 1.0) && (has_ground || way.starts_with("--filter")) {
                continue;
            }
            for c in 0..3 {
                let over = clear[c][i] + (1.0 - a) * color[c];
                assert!(
                    (over - opaque[c][i]).abs() < 3e-6,
                    "{way}: pixel {i} is {over}, not {}",
                    opaque[c][i]
                );
            }
            compared += 1;
        }
        assert!(compared > 100, "{way}: {compared}");
        kinds += 1;
    }
    assert_eq!(kinds, 18);
}

/// Crops, resumed and merged renders have the bits of a single one, in `A` too.
#[test]
fn alpha_does_not_depend_on_how_a_render_was_made() {
    let folder = stage("background = \"transparent\"\n[ground]\npoint = [0, -0.5, 0]");
    let run = |line: &str| done(folder.path(), &split(&format!("render s.toml -q {line}")));
    let file = |name: &str| folder.path().join(name);
    run("--spp 128 -o whole.exr --threads 1");
    run("--spp 128 -o again.exr --threads 2 --background transparent");
    assert_same_bits(&file("whole.exr"), &file("again.exr"));

    run("--spp 40 --checkpoint c.exr -o part.exr");
    run("--spp 128 --checkpoint c.exr --resume -o resumed.exr");
    assert_same_bits(&file("whole.exr"), &file("resumed.exr"));

    run("--spp 128 --samples 0..64 -o a.exr");
    run("--spp 128 --samples 64..128 --crop 0,0,31,17 -o b.exr");
    run("--spp 128 --samples 64..128 --crop 0,17,31,31 -o c.exr");
    done(
        folder.path(),
        &split("merge a.exr b.exr c.exr -q -o merged.exr -o merged.png"),
    );
    assert_same_bits(&file("whole.exr"), &file("merged.exr"));

    // Parts of another background are strangers.
    run("--spp 128 --samples 64..128 --background white -o d.exr");
    let said = refused(folder.path(), &split("merge a.exr d.exr -q -o no.exr"), 1);
    assert!(said.contains("background=transparent"), "{said}");
    run("--spp 40 --checkpoint e.exr -o part.exr");
    let said = refused(
        folder.path(),
        &split("render s.toml -q --spp 64 --checkpoint e.exr --resume --no-ground -o no.exr"),
        1,
    );
    assert!(said.contains("scene hash"), "{said}");

    // Denoisers leave alpha as it is; noise levels, half floats and the readers take such pictures.
    run("--spp 128 --denoise gaussian -o soft.exr");
    assert_eq!(
        read_channel(&file("soft.exr"), "A"),
        read_channel(&file("whole.exr"), "A")
    );
    run("--noise 50% --half picture -o n.exr");
    assert!(read_channel(&file("n.exr"), "A").iter().any(|&a| a == 1.0));
    let compared = json(&done(folder.path(), &split("compare whole.exr merged.exr --json")));
    assert_eq!(compared["mse"].as_f64(), Some(0.0), "{compared}");
    done(folder.path(), &split("compare merged.png merged.png"));
}

/// The default is the light, to the bit, with and without the flag.
#[test]
fn light_is_the_default() {
    let folder = stage("");
    done(folder.path(), &split("render s.toml -q --spp 16 -o a.exr"));
    done(
        folder.path(),
        &split("render s.toml -q --spp 16 --background light --no-ground -o b.exr"),
    );
    let [a, b] = ["a.exr", "b.exr"].map(|name| folder.path().join(name));
    assert_same_bits(&a, &b);
    assert_eq!(at(&a, "R", 2, 15), 0.6);
}

/// Flags, keys and `--set` take the same backgrounds, and what is not seen by the camera directly does not change.
#[test]
fn backgrounds_are_seen_by_the_camera_alone() {
    let folder = stage("background = [0.1, 0.2, 0.3]");
    let shown = |flags: &str| {
        done(
            folder.path(),
            &joined(&split("render s.toml -q --spp 16 -o o.exr"), &split(flags)),
        );
        let path = folder.path().join("o.exr");
        ["R", "G", "B"].map(|name| at(&path, name, 2, 15))
    };
    assert_eq!(shown(""), [0.1, 0.2, 0.3]);
    assert_eq!(shown("--background white"), [1.0; 3]);
    assert_eq!(shown("--background black"), [0.0; 3]);
    assert_eq!(shown("--background 0.25"), [0.25; 3]);
    assert_eq!(shown("--background 1,2,3"), [1.0, 2.0, 3.0]);
    assert_eq!(shown("--background light"), [0.6; 3]);
    assert_eq!(shown("--background transparent"), [0.0; 3]);
    assert_eq!(shown("--set image.background=[0,1,0]"), [0.0, 1.0, 0.0]);
    assert_eq!(shown("--set image.background=0.5"), [0.5; 3]);
    let sixth = shown("--background #ff8000");
    assert!(
        sixth[0] == 1.0 && (sixth[1] - 0.215_86).abs() < 1e-4 && sixth[2] == 0.0,
        "{sixth:?}"
    );
    // The glass, a sheet that reflects and refracts, shows the light of 0.6 before each of them.
    let path = folder.path().join("o.exr");
    let glass = at(&path, "R", 8, 8);
    shown("--background white");
    assert_eq!(at(&path, "R", 8, 8), glass);
    shown("--background light");
    assert_eq!(at(&path, "R", 8, 8), glass);

    // A gradient is brighter below than above.
    let wide = split("--background gradient --position 0,0,100 --look-at 0,0,200 --fov 100");
    let gradient = |flags: &[&str]| {
        let all = [&split("render s.toml -q --spp 4 -o o.exr")[..], flags].concat();
        done(folder.path(), &all);
        [0, 15, 30].map(|y| at(&path, "R", 15, y))
    };
    let [top, middle, bottom] = gradient(&wide);
    assert!(
        top < 0.5 * middle && middle < bottom && bottom == 0.8,
        "{top} {middle} {bottom}"
    );
    let [top, _, bottom] = gradient(&joined(&wide, &["--up", "0,-1,0"]));
    assert!(bottom == 0.8 && top < 0.4, "{top} {bottom}");
    let dark = joined(&wide, &["--background", "gradient:0.1"]);
    assert_eq!(gradient(&dark[2..])[2], 0.1);
}

#[test]
fn wrong_backgrounds_and_grounds_are_refused() {
    let run = |more: &str, flags: &str, expected: i32| {
        let folder = stage(more);
        refused(
            folder.path(),
            &joined(&split("render s.toml -q -o o.exr"), &split(flags)),
            expected,
        )
    };
    for value in ["grey", "-1", "1,2", "#12345", "gradient:x", "nan"] {
        let said = run("", &format!("--background {value}"), 2);
        assert!(
            said.contains(&format!("--background {value}")) && said.contains("transparent, gradient"),
            "{said}"
        );
    }
    for value in ["\"grey\"", "[1, 2]", "[1, -2, 3]", "true", "[[1]]", "{}"] {
        let said = run(&format!("background = {value}"), "", 1);
        assert!(
            said.contains("s.toml:9:14: background = ") && said.contains("transparent, gradient"),
            "{said}"
        );
    }
    let said = run("filter_radius = [1, 2]", "", 1);
    assert!(
        said.contains("filter_radius = [1, 2]") && said.contains("use a number"),
        "{said}"
    );

    // Integrators whose light falls on any pixel
    for name in ["light", "bdpt", "pssmlt", "vcm", "mlt"] {
        let said = run("", &format!("--integrator {name} --background white"), 2);
        assert!(
            said.contains("shows the lights alone") && said.contains("path, naive, whitted"),
            "{said}"
        );
        let said = run("", &format!("--integrator {name} --ground"), 1);
        assert!(said.contains("--no-ground") && said.contains("path, naive"), "{said}");
    }
    for flags in [
        "--integrator photon-map",
        "--integrator sppm",
        "--integrator irradiance-cache",
        "--max-depth 0",
    ] {
        let said = run("[ground]", flags, 1);
        assert!(
            said.contains("ground") && said.contains("help: use --no-ground"),
            "{said}"
        );
    }
    let said = run(
        "[[light]]\ntype = \"point\"\nposition = [0, 5, 0]\nintensity = [1, 1, 1]",
        "--ground --integrator naive",
        1,
    );
    assert!(said.contains("point light") && said.contains("--no-ground"), "{said}");

    for (key, rule) in [
        ("point = [0, nan, 0]", "finite"),
        ("point = [0, 2e10, 0]", "1e10"),
        ("normal = [0, 0, 0]", "not zero"),
        ("up = [0, inf, 0]", "finite"),
        ("radius = 0", "above 0"),
        ("radius = -1", "above 0"),
        ("radius = 1e-30", "corners"),
        ("albedo = 0", "from 0.01 to 1"),
        ("albedo = [0.5, 0.5, 1.5]", "from 0.01 to 1"),
        ("albedo = \"white\"", "a number or three numbers"),
        ("radios = 3", "did you mean `radius`"),
    ] {
        let more = format!("[ground]\npoint = [0, 1, 0]\n{key}");
        let more = if key.starts_with("point") {
            format!("[ground]\n{key}")
        } else {
            more
        };
        let said = run(&more, "", 1);
        assert!(said.contains("s.toml:") && said.contains(rule), "{key}: {said}");
    }
    let said = run("", "--ground --no-ground", 2);
    assert!(said.contains("--no-ground"), "{said}");

    // A lamp whose emission is a picture
    let folder = stage("");
    std::fs::write(folder.path().join("a.mtl"), "newmtl lamp\nKe 2 2 2\nmap_Ke t.png\n").unwrap();
    crate::support::program::write_grey_png(&folder.path().join("t.png"), &[0, 200]);
    let said = refused(folder.path(), &split("render s.toml -q --ground -o o.exr"), 1);
    assert!(said.contains("texture") && said.contains("--no-ground"), "{said}");
}

/// Each key of `[ground]`, by what the first surface is.
#[test]
fn keys_place_the_ground() {
    let look = |ground: &str, flags: &str| {
        let folder = stage(ground);
        let camera = "--position 3,6,3 --look-at 3,0,3 --up 0,0,-1 --fov 20 --size 31x31";
        let line = format!("render s.toml -q --spp 4 --aov P -o o.exr {camera} {flags}");
        done(folder.path(), &split(&line));
        let path = folder.path().join("o.exr");
        ["P.Y", "N.Y", "N.Z", "albedo.G", "Z"].map(|name| at(&path, name, 15, 15))
    };
    let near = |a: f32, b: f32| (a - b).abs() < 2e-3;
    // Below the lowest corner of the scene, at y = -2
    let [y, up, _, albedo, _] = look("", "--ground");
    assert!(
        near(y, -2.0) && y < -2.0 && up == 1.0 && near(albedo, 0.5),
        "{y} {up} {albedo}"
    );
    let [y, ..] = look("[ground]", "");
    assert!(near(y, -2.0));
    assert_eq!(look("[ground]", "--no-ground")[4], 1e10);
    let [y, _, _, albedo, _] = look("[ground]\npoint = [0, 0.5, 0]\nalbedo = 0.25", "");
    assert!(near(y, 0.5) && near(albedo, 0.25), "{y} {albedo}");
    let [_, _, _, albedo, _] = look("[ground]\nalbedo = [0.2, 0.8, 0.3]", "");
    assert!(near(albedo, 0.8), "{albedo}");
    let [_, _, along, _, _] = look("[ground]\npoint = [3, 0, 3]\nnormal = [0, 1, 1]", "");
    assert!(near(along, 0.5f32.sqrt()), "{along}");
    // Too small to be seen from there
    assert_eq!(look("[ground]\npoint = [0, 0, 0]\nradius = 1.5", "")[4], 1e10);
    // Up is -y: the ground is above the scene, and is not seen from its back.
    assert_eq!(look("[ground]\nup = [0, -1, 0]", "")[4], 1e10);
    let [y, ..] = look("[ground]", "--set ground.point=[0,1,0]");
    assert!(near(y, 1.0), "{y}");
}

/// The ground frames nothing, counts as a mesh, and has a name in mattes.
#[test]
fn the_ground_is_no_part_of_the_bounds() {
    let folder = stage("[ground]");
    let run = |args: &str| done(folder.path(), &split(args));
    let info = json(&run("info s.toml --json"));
    assert_eq!(info["bounds"][0][1].as_f64(), Some(-2.0), "{info}");
    run("render a.obj -q --spp 4 --size 31x31 --background black --aov id,cryptomatte -o a.exr");
    run("render a.obj -q --spp 4 --size 31x31 --background black --aov id,cryptomatte --ground -o b.exr");
    let [a, b] = ["a.exr", "b.exr"].map(|name| folder.path().join(name));
    // The same camera: surfaces of the scene are where they were.
    let [before, after] = [a, b].map(|path| read_channel(&path, "id.object"));
    assert!(before.iter().any(|&id| id == 1.0) && after.iter().any(|&id| id == 2.0));
    assert!(before.iter().zip(&after).all(|(&a, &b)| a == 0.0 || a == b));
    let traced = printed(&run("render s.toml --pixel 2,29 --sample 1"));
    assert!(traced.contains("sees the ground: its light times"), "{traced}");
    let traced = printed(&run("render s.toml --pixel 2,15 --background transparent --no-ground"));
    assert!(traced.contains("share of a transparent background 1"), "{traced}");
}
