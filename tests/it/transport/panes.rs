//! Light through window panes and other thin glass: closed forms, straight light compared with
//! refracted light, noise, bit-identical renders, and messages.
#![cfg(feature = "embree")]

use crate::support::program::{done, folder, printed, read_json, refused, split, words};
use crate::support::statistics::{Mean, assert_all_means_within, assert_same_mean};
use crate::support::*;
use embrasure::accel::Accel;
use embrasure::accel::brute::BruteForce;
use embrasure::camera::CameraParameters;
use embrasure::color::Spectrum;
use embrasure::film::{Accumulator, Film, Rect};
use embrasure::geometry::Mesh;
use embrasure::integrator::*;
use embrasure::material::{Gloss, Material};
use embrasure::math::{Quat, UVec2, Vec3};
use embrasure::scene::{Panes, Scene, SceneBuilder};
use std::path::Path;

/// Angle of incidence in degrees, and transmittance of a pane of index 1.5 for unpolarised light:
/// (1 − F) / (1 + F).
const TRANSMITTANCES: [(f32, f64); 5] = [
    (0.0, 0.923077),
    (45.0, 0.904327),
    (60.0, 0.836232),
    (70.0, 0.707880),
    (80.0, 0.441229),
];

fn turned(mut mesh: Mesh, degrees: f32) -> Mesh {
    let turn = Quat::from_rotation_y(degrees.to_radians());
    mesh.positions.iter_mut().for_each(|p| *p = turn * *p);
    mesh
}

/// Window at the origin whose normal is at `degrees` from the z axis: a slab, or a thin dielectric.
fn pane(degrees: f32, is_slab: bool) -> Mesh {
    let half = Vec3::new(2.0, 1.0, 0.005);
    match is_slab {
        true => turned(slab(Vec3::ZERO, half), degrees),
        false => turned(panel(0.0, 1.5), degrees),
    }
}

/// A small lamp of radiance 1 behind panes, and a camera in front of them.
fn lamp_behind(panes: &[Mesh], glass: &Material) -> (Scene, CameraParameters) {
    let mut b = SceneBuilder::new();
    add(&mut b, panel(-3.0, 0.08), material(0.0, 1.0));
    for pane in panes {
        add(&mut b, pane.clone(), glass.clone());
    }
    (b.build().unwrap().0, pinhole(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, 1.0))
}

const SMALL: UVec2 = UVec2::splat(16);

/// Means of the image for different families of integrators.
fn means(scene: &Scene, camera: CameraParameters) -> Vec<(&'static str, [f64; 3])> {
    let rgb = |film: Film| [0, 1, 2].map(|c| film_mean(&film, c));
    with_world(scene, camera, SMALL, |world| {
        let path = path_tracer(world, Some(8));
        let naive = NaiveIntegrator::new(world, Some(8), Roulette::default());
        let bdpt = BidirectionalIntegrator {
            world,
            heuristic: Heuristic::Power,
            max_depth: Some(8),
            roulette: Roulette::default(),
        };
        vec![
            ("path", rgb(film_by(&sobol(1), &path, SMALL, 256))),
            ("naive", rgb(film_of(&naive, SMALL, budget(2048), 2))),
            ("bdpt", rgb(film_of_iterations(&bdpt, SMALL, budget(2048), 3))),
        ]
    })
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn a_pane_has_the_transmittance_of_a_slab() {
    for (degrees, expected) in TRANSMITTANCES {
        for is_slab in [false, true] {
            let (scene, camera) = lamp_behind(&[pane(degrees, is_slab)], &glass([1.0; 3], !is_slab));
            assert!(scene.has_thin_surfaces(), "{degrees}");
            for (name, [mean, ..]) in means(&scene, camera) {
                println!("{name}, {degrees}°, slab {is_slab}: {mean:.6}, exact {expected}");
                assert!(
                    (mean / expected - 1.0).abs() < 3e-3 * slack(),
                    "{name}, {degrees}°, slab {is_slab}: {mean} and not {expected}"
                );
            }
        }
    }
}

/// A surface lit by a directional light through a pane, with shadow rays only.
#[test]
fn shadow_rays_have_pane_transmittance() {
    for (degrees, expected) in TRANSMITTANCES {
        for is_slab in [false, true] {
            let mut b = SceneBuilder::new();
            add(&mut b, pane(degrees, is_slab), glass([1.0, 0.5, 0.25], !is_slab));
            add(&mut b, panel(-3.0, 0.05), material(0.5, 0.0));
            b.add_directional_light(Vec3::NEG_Z, Spectrum::ONE).unwrap();
            let scene = b.build().unwrap().0;
            assert!(scene.has_thin_surfaces());
            // View the surface from below the pane
            let camera = pinhole(Vec3::new(0.0, -2.0, -2.0), Vec3::new(0.0, 0.0, -3.0), 0.5);
            let film = render_film(&scene, camera, [4, 4], 64, Some(1));
            for (c, kt) in [1.0f64, 0.5, 0.25].into_iter().enumerate() {
                // Both faces of a body multiply the light by the colour.
                let kt = if is_slab { kt * kt } else { kt };
                let (mean, expected) = (film_mean(&film, c), 0.5 / std::f64::consts::PI * expected * kt);
                assert!(
                    (mean / expected - 1.0).abs() < 1e-4,
                    "{degrees}°, slab {is_slab}, {c}: {mean}, {expected}"
                );
            }
        }
    }
}

#[test]
fn panes_in_a_row_multiply() {
    let t = TRANSMITTANCES[1].1;
    let place = |z: f32| {
        let mut mesh = pane(45.0, true);
        mesh.positions.iter_mut().for_each(|p| p.z += z);
        mesh
    };
    let (scene, camera) = lamp_behind(&[place(0.0), place(-0.5), place(-1.0)], &glass([1.0, 0.8, 0.5], false));
    for (name, mean) in means(&scene, camera) {
        for (c, kt) in [1.0f64, 0.8, 0.5].into_iter().enumerate() {
            let expected = (t * kt * kt).powi(3);
            assert!(
                (mean[c] / expected - 1.0).abs() < 5e-3,
                "{name}, {c}: {} {expected}",
                mean[c]
            );
        }
    }
}

/// The camera sees a lamp in a mirror behind a pane. The light also goes through a second pane.
#[test]
fn mirror_behind_a_pane_shows_the_lamp() {
    let mut b = SceneBuilder::new();
    add(&mut b, pane(0.0, true), glass([0.9, 1.0, 1.0], false));
    let mirror = Material {
        specular: Spectrum::splat(0.8),
        gloss: Gloss::Mirror(embrasure::bsdf::Fresnel::Full),
        ..material(0.0, 0.0)
    };
    let mut behind = turned(panel(0.0, 2.0), 45.0);
    behind.positions.iter_mut().for_each(|p| p.z -= 3.0);
    add(&mut b, behind, mirror);
    // The second pane is to the right of the mirror
    let mut second = turned(slab(Vec3::ZERO, Vec3::new(1.0, 1.0, 0.005)), 90.0);
    second
        .positions
        .iter_mut()
        .for_each(|p| *p += Vec3::new(2.0, 0.0, -3.0));
    add(&mut b, second, glass([1.0, 1.0, 0.5], false));
    let mut lamp = turned(panel(0.0, 0.15), -90.0);
    lamp.positions.iter_mut().for_each(|p| *p += Vec3::new(3.0, 0.0, -3.0));
    add(&mut b, lamp, material(0.0, 1.0));
    let (scene, report) = b.build().unwrap();
    assert_eq!(report.panes, 2);
    let t = TRANSMITTANCES[0].1;
    for (name, mean) in means(&scene, pinhole(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, 1.0)) {
        for (c, kt) in [0.81, 1.0, 0.25].into_iter().enumerate() {
            let expected = t * t * 0.8 * kt;
            assert!(
                (mean[c] / expected - 1.0).abs() < 6e-3,
                "{name}, {c}: {} {expected}",
                mean[c]
            );
        }
    }
}

/// Energy is conserved: in uniform light, panes are invisible, both as bodies and as thin
/// dielectrics.
#[test]
fn panes_are_invisible_in_uniform_light() {
    for panes in [Panes::Straight, Panes::Refract] {
        let mut b = SceneBuilder::new();
        b.panes(panes);
        b.add_constant_light(Spectrum::ONE).unwrap();
        for degrees in [0.0, 50.0, 80.0] {
            add(&mut b, pane(degrees, true), glass([1.0; 3], false));
        }
        add(&mut b, sphere(0.2, Vec3::new(0.0, 0.0, -1.0), 3), material(1.0, 0.0));
        let scene = b.build().unwrap().0;
        assert_eq!(scene.has_thin_surfaces(), panes == Panes::Straight);
        let camera = pinhole(Vec3::new(0.5, 0.3, 4.0), Vec3::ZERO, 40.0);
        let film = render_film(&scene, camera, [32, 32], 512, None);
        let mean = film_mean(&film, 0);
        println!("mean {mean}");
        assert!((mean - 1.0).abs() < 4e-3, "{mean}");
    }
}

/// A room lit by a lamp behind two panes of thin glass and a filter.
fn lit_through_a_window(panes: Panes) -> Scene {
    let mut b = SceneBuilder::new();
    b.panes(panes);
    add(&mut b, room(), material(0.5, 0.0));
    let sheet = glass([0.9, 0.8, 0.9], true);
    let veil = Material {
        diffuse: Spectrum::splat(0.2),
        ior: 1.0,
        ..glass([0.3, 0.5, 0.6], true)
    };
    add(&mut b, panel(-0.5, 0.99), sheet.clone());
    add(&mut b, panel(-0.6, 0.99), sheet);
    add(&mut b, panel(-0.7, 0.5), veil);
    add(&mut b, panel(-0.9, 0.3), material(0.0, 5.0));
    b.build().unwrap().0
}

/// Straight and refracted light have the same mean, and straight light has less noise. The two
/// modes count scatterings differently, so long paths are allowed.
#[test]
fn straight_and_refracted_light_agree() {
    let camera = pinhole(Vec3::new(0.0, 0.2, 0.9), Vec3::new(0.2, -0.6, -0.3), 80.0);
    let [straight, refract] = [Panes::Straight, Panes::Refract].map(|panes| {
        let spp = if panes == Panes::Straight { 1024 } else { 8192 };
        render_film(&lit_through_a_window(panes), camera, [16, 16], budget(spp), Some(64))
    });
    for c in 0..3 {
        let [a, b] = [&straight, &refract].map(|film| Mean::of_film(film, c));
        assert_same_mean(format!("channel {c}"), a, b);
    }
    let pixels = |film: &Film| -> Vec<Mean> { film.pixels().map(|(_, sums)| Mean::of_pixel(&sums, 0)).collect() };
    let pairs: Vec<_> = pixels(&straight).into_iter().zip(pixels(&refract)).collect();
    assert_all_means_within("pixels", &pairs, |_| 0.0);
}

/// A small lamp behind a window lights a room. Scattered rays hardly ever find this light.
#[test]
fn light_behind_a_window_has_little_noise() {
    let scene = |panes| {
        let mut b = SceneBuilder::new();
        b.panes(panes);
        add(&mut b, room(), material(0.3, 0.0));
        add(
            &mut b,
            slab(Vec3::new(0.0, 0.0, -0.5), Vec3::new(0.99, 0.99, 0.005)),
            glass([1.0; 3], false),
        );
        add(&mut b, panel(-0.95, 0.05), material(0.0, 100.0));
        b.build().unwrap().0
    };
    let camera = pinhole(Vec3::new(0.0, 0.8, 0.9), Vec3::new(0.0, -1.0, 0.2), 60.0);
    let [straight, refract] = [Panes::Straight, Panes::Refract].map(|panes| {
        let film = render_film(&scene(panes), camera, [16, 16], 256, Some(8));
        let variance: f64 = film.pixels().map(|(_, a)| a.variance_of_mean(1)).sum();
        (film_mean(&film, 1), variance)
    });
    println!("mean and variance: straight {straight:?}, refract {refract:?}");
    assert!(straight.1 < 0.05 * refract.1, "{straight:?} {refract:?}");
}

/// Camera rays select transmission by a stratified random number. So in a window with a lamp behind
/// it, pixels differ little.
#[test]
fn windows_in_the_picture_are_stratified() {
    let (scene, camera) = lamp_behind(&[pane(45.0, false)], &glass([1.0; 3], true));
    with_world(&scene, camera, SMALL, |world| {
        let deviation = |film: Film| {
            let pixels: Vec<f64> = film.pixels().map(|(_, a)| a.mean(0)).collect();
            let squares = pixels.iter().map(|v| (v - TRANSMITTANCES[1].1).powi(2));
            (squares.sum::<f64>() / pixels.len() as f64).sqrt()
        };
        let path = path_tracer(world, Some(4));
        let sobol = deviation(film_by(&sobol(1), &path, SMALL, 64));
        let independent = deviation(film_of(&path, SMALL, 64, 1));
        println!("standard deviation of pixels: {sobol:.5}, by independent numbers {independent:.5}");
        assert!(sobol < 0.4 * independent, "{sobol} {independent}");
    });
}

/// Backends differ in the last bits of barycentrics, and secondary rays use these bits as random
/// numbers. Only the means of the images are the same.
#[test]
fn backends_agree_through_glass() {
    let scene = glazed_room();
    let size = UVec2::splat(8);
    let film = |accel: &dyn Accel| {
        with_world(&scene, in_glazed_room(), size, |world| {
            film_of(&path_tracer(world.with_accel(&accel), Some(4)), size, 256, 1)
        })
    };
    let films = [
        film(&backend(&scene)),
        film(&BruteForce::new(&scene)),
        #[cfg(feature = "obvhs")]
        film(&embrasure::accel::bvh::BvhAccel::new(&scene)),
    ];
    for other in &films[1..] {
        let (a, b) = (film_mean(&films[0], 1), film_mean(other, 1));
        let error = film_error(&films[0], 1);
        assert!((a - b).abs() < 2.0 * error, "{a} {b} ± {error}");
    }
}

/// A room with a window of solid glass and a lamp behind it.
fn house() -> [(&'static str, String); 3] {
    let cube = |low: [f32; 3], high: [f32; 3]| -> String {
        let corner = |i: usize| [0, 1, 2].map(|k| if i >> k & 1 == 0 { low[k] } else { high[k] });
        let line = |[x, y, z]: [f32; 3]| format!("v {x} {y} {z}\n");
        (0..8).map(corner).map(line).collect()
    };
    let faces = |first: usize, outwards: bool| -> String {
        let faces = [
            [1, 3, 4, 2],
            [5, 6, 8, 7],
            [1, 2, 6, 5],
            [3, 7, 8, 4],
            [1, 5, 7, 3],
            [2, 4, 8, 6],
        ];
        let line = |mut face: [usize; 4]| {
            if !outwards {
                face.reverse();
            }
            format!("f {}\n", face.map(|i| (i + first - 1).to_string()).join(" "))
        };
        faces.map(line).concat()
    };
    let obj = format!(
        "mtllib a.mtl\n{}{}v -0.2 -0.2 -0.95\nv 0.2 -0.2 -0.95\nv 0.2 0.2 -0.95\nv -0.2 0.2 -0.95\n\
         usemtl wall\n{}usemtl glass\n{}usemtl lamp\nf 17 18 19 20\n",
        cube([-1.0; 3], [1.0; 3]),
        cube([-0.99, -0.99, -0.505], [0.99, 0.99, -0.495]),
        faces(1, false),
        faces(9, true),
    );
    let mtl =
        "newmtl wall\nKd 0.5 0.5 0.5\nillum 1\nnewmtl glass\nTf 0.9 1 0.8\nNi 1.5\nillum 4\nnewmtl lamp\nKe 5 5 5\n";
    let scene = "version = 1\n[camera]\nposition = [0, 0.2, 0.9]\nlook_at = [0.2, -0.3, -0.9]\nvertical_fov = 80\n\
                 [image]\nwidth = 24\nheight = 16\n[[object]]\nobj = \"a.obj\"\n";
    [("a.obj", obj), ("a.mtl", mtl.into()), ("s.toml", scene.into())]
}

fn pixels(path: &Path) -> [Vec<u32>; 3] {
    read_rgb(path).map(|channel| channel.iter().map(|v| v.to_bits()).collect())
}

#[test]
fn threads_and_parts_change_no_bit_behind_glass() {
    let files = house();
    let folder = folder(&files.each_ref().map(|(name, text)| (*name, text.as_str())));
    let run = |args: &str| {
        done(
            folder.path(),
            &split(&format!("render s.toml -q --size 12x8 --spp 128 {args}")),
        )
    };
    for integrator in ["path", "path --reuse none", "bdpt", "mlt"] {
        let with = format!("--integrator {integrator}");
        run(&format!("{with} -o whole.exr --threads 1"));
        let whole = pixels(&folder.path().join("whole.exr"));
        run(&format!("{with} -o other.exr --threads 3"));
        assert_eq!(pixels(&folder.path().join("other.exr")), whole, "{integrator}: threads");
        run(&format!("{with} -o a.exr --samples 0..64"));
        run(&format!("{with} -o b.exr --samples 64..128 --threads 2"));
        done(folder.path(), &split("merge b.exr a.exr -o merged.exr -q"));
        assert_eq!(pixels(&folder.path().join("merged.exr")), whole, "{integrator}: parts");
    }
    // A scene with the other setting for panes is another scene.
    run("-o a.exr --samples 0..64");
    run("-o b.exr --samples 64..128 --panes refract");
    let said = refused(folder.path(), &split("merge a.exr b.exr -o merged.exr -q"), 1);
    assert!(said.contains("scene"), "{said}");
}

#[test]
fn crops_change_no_bit_behind_glass() {
    let (scene, size) = (glazed_room(), UVec2::splat(32));
    with_world(&scene, in_glazed_room(), size, |world| {
        let integrator = ReusingPathIntegrator {
            path: path_tracer(world, Some(5)),
        };
        let film = |rect| {
            let mut film = Film::new(size, rect);
            render_into(&mut film, &integrator, &sobol(3), 8);
            film
        };
        let crop = Rect {
            min: UVec2::new(5, 9),
            max: UVec2::new(27, 20),
        };
        let (whole, part) = (film(Rect::full(size)), film(crop));
        for (pixel, sums) in part.pixels() {
            let bits = |sums: &Accumulator| [0, 1, 2].map(|c| sums.mean(c).to_bits());
            assert_eq!(whole.sums(pixel).as_ref().map(bits), Some(bits(&sums)), "{pixel}");
        }
    });
}

#[test]
fn pane_message_is_printed_once() {
    let files = house();
    let folder = folder(&files.each_ref().map(|(name, text)| (*name, text.as_str())));
    const SAID: &str = "1 pane, light passes straight";
    let said = |args: &str| {
        let out = done(folder.path(), &split(args));
        (printed(&out) + &words(&out)).matches(SAID).count()
    };
    for command in ["info", "check", "render --spp 1 -o a.exr"] {
        assert_eq!(said(&format!("{command} s.toml")), 1, "{command}");
        assert_eq!(said(&format!("{command} s.toml --panes refract")), 0, "{command}");
    }
    let text = files[2].1.clone() + "[render]\npanes = \"refract\"\n";
    std::fs::write(folder.path().join("r.toml"), text).unwrap();
    assert_eq!(said("info r.toml"), 0);
    assert_eq!(said("info r.toml --panes straight"), 1);
    done(
        folder.path(),
        &split("render s.toml --spp 1 -q -o a.exr --stats s.json"),
    );
    let stats = read_json(&folder.path().join("s.json"));
    assert_eq!(stats["triangles"], 12 + 2 + 2);
}
