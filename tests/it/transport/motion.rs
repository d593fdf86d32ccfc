//! Motion while the shutter is open: against closed forms and against means of still images.
#![cfg(any(feature = "embree", feature = "obvhs"))]

use crate::support::statistics::{Mean, assert_same_mean};
use crate::support::*;
use embrasure::camera::{Camera, CameraMotion, CameraParameters, Pose};
use embrasure::color::Spectrum;
use embrasure::film::Film;
use embrasure::geometry::{Mesh, Placement};
use embrasure::integrator::{DirectLight, NaiveIntegrator, PathIntegrator, Roulette, World};
use embrasure::math::{Affine3A, UVec2, Vec3, affine_from_trs};
use embrasure::scene::{Scene, SceneBuilder};
use std::fs;

const SIZE: UVec2 = UVec2::new(24, 24);

fn shift(x: f32, y: f32, z: f32) -> Affine3A {
    affine_from_trs(Vec3::new(x, y, z), Vec3::ZERO, Vec3::ONE)
}

/// The path tracer with path reuse and two light samples if `reuse` is true, else without path
/// reuse and with one light sample.
fn path<'a>(world: World<'a, Backend<'a>>, reuse: bool) -> PathTracer<'a> {
    let path = PathIntegrator {
        light_samples: if reuse { 2 } else { 1 },
        ..path_tracer(world, Some(4))
    };
    PathTracer { path, reuse }
}

fn shutter(parameters: CameraParameters, shutter: [f32; 2]) -> Camera {
    let motion = CameraMotion { close: None, shutter };
    Camera::moving(parameters, motion, SIZE).unwrap()
}

/// A panel that crosses the image covers each column for a known fraction of the time.
#[test]
fn moving_panel_has_the_exact_coverage() {
    for deforms in [false, true] {
        let mut b = SceneBuilder::new();
        // The panel is black, in front of a white sky, and 2 wide. Its middle moves from x = −1 to
        // 1.
        let id = b.add_material(material(0.0, 0.0)).unwrap();
        let mesh = panel(0.0, 1.0);
        if deforms {
            let at = |x: f32| mesh.positions.iter().map(|p| *p + Vec3::new(x, 0.0, 0.0)).collect();
            let moving = Mesh {
                positions: at(-1.0),
                positions_close: at(1.0),
                ..mesh
            };
            b.add_mesh(moving, id).unwrap();
        } else {
            let prototype = b.add_prototype(vec![(mesh, id)]).unwrap();
            let steps = [-1.0, 0.0, 1.0].map(|x| shift(x, 0.0, 0.0));
            b.add_instance(prototype, Placement::Moving(steps.into())).unwrap();
        }
        b.add_constant_light(Spectrum::ONE).unwrap();
        let scene = b.build().unwrap().0;
        assert!(scene.is_moving());
        for [open, close] in [[0.0, 1.0], [0.25, 0.5], [0.75, 0.75]] {
            let film = with_camera(&scene, shutter(from_front(), [open, close]), |world| {
                film_of(&path(world, true), SIZE, 512, 1)
            });
            for (column, x) in (0..24).map(|c| (c, (c as f64 + 0.5) / 12.0 - 1.0)) {
                // When the shutter opens and closes, the edges of the panel lie on pixel borders.
                // The mean of a pixel is then the coverage at its middle.
                let covered = |t: f64| f64::from(u8::from(x > 2.0 * t - 2.0 && x < 2.0 * t));
                const TIMES: u32 = 24_000;
                let time = |i: u32| open as f64 + (i as f64 + 0.5) / TIMES as f64 * (close - open) as f64;
                let share = (0..TIMES).map(|i| covered(time(i))).sum::<f64>() / TIMES as f64;
                let pixels: Vec<f64> = film
                    .pixels()
                    .filter(|(p, _)| p.x == column)
                    .map(|(_, a)| a.mean(0))
                    .collect();
                let mean = pixels.iter().sum::<f64>() / 24.0;
                // The count is binomial, with at most 24 · 512 samples
                let error = (share * (1.0 - share) / (24.0 * 512.0)).sqrt().max(1e-4);
                assert!(
                    (mean - (1.0 - share)).abs() < 4.5 * error,
                    "{deforms}, {open} to {close}, x {x}: {mean}, not {}",
                    1.0 - share
                );
            }
        }
    }
}

/// A room with a moving matte ball, a deforming ball, a moving lamp and a still lamp.
fn busy_room() -> Scene {
    let mut b = SceneBuilder::new();
    add(&mut b, room(), material(0.6, 0.0));
    let grey = b.add_material(material(0.7, 0.0)).unwrap();
    let lamp = b.add_material(material(0.0, 6.0)).unwrap();
    let ball = sphere(0.25, Vec3::ZERO, 1);
    let changed = ball.positions.iter().map(|p| *p * Vec3::new(1.6, 0.5, 1.0)).collect();
    let moving = Mesh {
        positions_close: changed,
        ..ball.clone()
    };
    let balls = b.add_prototype(vec![(ball, grey)]).unwrap();
    let changing = b.add_prototype(vec![(moving, grey)]).unwrap();
    let steps = [shift(-0.6, -0.6, 0.0), shift(0.0, 0.0, -0.3), shift(0.6, -0.6, 0.2)];
    b.add_instance(balls, Placement::Moving(steps.into())).unwrap();
    b.add_instance(changing, Placement::Still(shift(0.5, 0.4, -0.5)))
        .unwrap();
    // A lamp that faces down and moves along the ceiling
    let down = affine_from_trs(Vec3::ZERO, Vec3::new(90.0, 0.0, 0.0), Vec3::ONE);
    let lamps = b.add_prototype(vec![(panel(0.0, 0.2), lamp)]).unwrap();
    let steps = [shift(-0.5, 0.9, 0.0) * down, shift(0.5, 0.9, 0.0) * down];
    b.add_instance(lamps, Placement::Moving(steps.into())).unwrap();
    b.add_instance(lamps, Placement::Still(shift(0.0, 0.8, -0.7) * down))
        .unwrap();
    b.build().unwrap().0
}

fn inside() -> CameraParameters {
    pinhole(Vec3::new(0.0, 0.0, 0.95), Vec3::new(0.0, -0.1, 0.0), 80.0)
}

/// Means of the quarters of the image over `seeds` renders, with their errors.
fn quarters(seeds: std::ops::Range<u64>, render: impl Fn(u64) -> Film) -> Vec<Mean> {
    let films: Vec<Film> = seeds.map(render).collect();
    let quarter = |film: &Film, q: u32| {
        let inside = film.pixels().filter(|(p, _)| p.x / 12 + 2 * (p.y / 12) == q);
        inside.map(|(_, a)| a.mean(0)).sum::<f64>() / 144.0
    };
    (0..4)
        .map(|q| Mean::of(&films.iter().map(|film| quarter(film, q)).collect::<Vec<f64>>()))
        .collect()
}

fn assert_alike(what: &str, a: &[Mean], b: &[Mean]) {
    for (a, b) in a.iter().zip(b) {
        assert_same_mean(what, *a, *b);
        assert!(a.error() < 0.01 * a.value, "{what}: {a}: the error is too large");
    }
}

/// If lamps and surfaces move, naive paths, next-event estimation, path reuse and light samples
/// find the same light.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn estimators_agree_on_moving_scenes() {
    let scene = busy_room();
    let camera = || shutter(inside(), [0.0, 1.0]);
    let by = |render: &(dyn Fn(World<Backend>, u64) -> Film + Sync), seeds: u64| {
        quarters(0..seeds, |seed| {
            with_camera(&scene, camera(), |world| render(world, seed))
        })
    };
    let own = by(&|world, seed| film_of(&path(world, false), SIZE, 64, seed), 16);
    let shared = by(&|world, seed| film_of(&path(world, true), SIZE, 64, 100 + seed), 16);
    assert_alike("shared paths", &shared, &own);
    let naive = by(
        &|world, seed| {
            let naive = NaiveIntegrator::new(world, Some(4), Roulette::default());
            film_of(&naive, SIZE, 512, 200 + seed)
        },
        16,
    );
    assert_alike("naive paths", &naive, &own);
    let lights_alone = by(
        &|world, seed| {
            let mut integrator = path(world, false);
            integrator.path.strategy.direct = DirectLight::Light;
            film_of(&integrator, SIZE, 64, 300 + seed)
        },
        16,
    );
    assert_alike("light samples alone", &lights_alone, &own);
}

/// A black panel hides the left half of a room as long as the lamp is there. Path reuse between
/// pixels must not bring light of this time to the left half at a later time.
#[test]
fn path_reuse_keeps_light_in_its_time() {
    let mut b = SceneBuilder::new();
    add(&mut b, room(), material(0.8, 0.0));
    let black = b.add_material(material(0.0, 0.0)).unwrap();
    let lamp = b.add_material(material(0.0, 6.0)).unwrap();
    // Halfway through the shutter time, the lamp and the panel leave, within 1/128 of this time.
    let mut leaving = |mesh: Mesh, material, place: Affine3A| {
        let prototype = b.add_prototype(vec![(mesh, material)]).unwrap();
        let away = shift(0.0, 0.0, 90.0) * place;
        let steps = (0..129).map(|i| if i < 65 { place } else { away }).collect();
        b.add_instance(prototype, Placement::Moving(steps)).unwrap();
    };
    let down = affine_from_trs(Vec3::new(0.0, 0.9, 0.0), Vec3::new(90.0, 0.0, 0.0), Vec3::ONE);
    leaving(panel(0.0, 0.4), lamp, down);
    leaving(panel(0.0, 0.2), black, shift(-0.2, 0.0, 0.85));
    let scene = b.build().unwrap().0;
    let camera = shutter(pinhole(Vec3::new(0.0, 0.0, 0.95), Vec3::ZERO, 80.0), [0.0, 1.0]);
    for reuse in [false, true] {
        let film = with_camera(&scene, camera, |world| film_of(&path(world, reuse), SIZE, 256, 3));
        let mean = |left: bool| {
            let half = film.pixels().filter(|(p, _)| (p.x < 12) == left);
            half.map(|(_, a)| a.mean(0)).sum::<f64>() / 288.0
        };
        let (dark, light) = (mean(true), mean(false));
        assert!(
            light > 0.2 && dark < 0.02 * light,
            "sharing {reuse}: {dark} beside {light}"
        );
    }
}

/// A render with an open shutter is the mean of renders at single times, also with a moving camera.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn an_open_shutter_is_the_mean_of_stills() {
    let scene = busy_room();
    let parameters = inside();
    let close = Pose {
        position: Vec3::new(0.3, 0.2, 0.9),
        look_at: Vec3::new(-0.2, 0.0, 0.0),
        up: Vec3::new(0.2, 1.0, 0.0),
    };
    let camera = |shutter: [f32; 2]| {
        let motion = CameraMotion {
            close: Some(close),
            shutter,
        };
        Camera::moving(parameters, motion, SIZE).unwrap()
    };
    let open = quarters(0..8, |seed| {
        with_camera(&scene, camera([0.2, 0.8]), |world| {
            film_of(&path(world, true), SIZE, 128, seed)
        })
    });
    const STILLS: u64 = 128;
    let stills: Vec<Film> = (0..STILLS)
        .map(|i| {
            let time = 0.2 + 0.6 * (i as f32 + 0.5) / STILLS as f32;
            // Make a scene without motion, frozen at that time
            let still = frozen(&scene, time);
            let pose = |a: Vec3, b: Vec3| a.lerp(b, time);
            let parameters = CameraParameters {
                position: pose(parameters.position, close.position),
                look_at: pose(parameters.look_at, close.look_at),
                up: pose(parameters.up, close.up),
                ..parameters
            };
            let camera = Camera::new(parameters, SIZE).unwrap();
            with_camera(&still, camera, |world| film_of(&path(world, true), SIZE, 16, 500 + i))
        })
        .collect();
    // Compute eight means, each over sixteen stills that are evenly spread over the time
    let sums: Vec<Vec<Mean>> = (0..8)
        .map(|k| quarters(0..16, |i| stills[(8 * i + k) as usize].clone()))
        .collect();
    let means: Vec<Mean> = (0..4)
        .map(|q| Mean::of(&sums.iter().map(|s| s[q].value).collect::<Vec<f64>>()))
        .collect();
    assert_alike("stills", &open, &means);
}

/// The scene at `time`, with all objects placed in the world.
fn frozen(scene: &Scene, time: f32) -> Scene {
    let mut b = SceneBuilder::new();
    let ids: Vec<_> = scene
        .materials()
        .iter()
        .map(|m| b.add_material(m.clone()).unwrap())
        .collect();
    let mut put = |geom: u32, placement: Affine3A| {
        let geom = embrasure::geometry::GeomId(geom);
        let mesh = scene.mesh(geom);
        let positions = match mesh.deforms() {
            false => mesh.positions.clone(),
            true => mesh
                .positions
                .iter()
                .zip(&mesh.positions_close)
                .map(|(a, b)| a.lerp(*b, time))
                .collect(),
        };
        let still = Mesh {
            positions: positions.iter().map(|p| placement.transform_point3a(*p)).collect(),
            positions_close: Vec::new(),
            ..mesh.clone()
        };
        b.add_mesh(still, ids[scene.shape(geom).material.0 as usize]).unwrap();
    };
    for geom in scene.world_meshes() {
        put(geom, Affine3A::IDENTITY);
    }
    for instance in scene.instances() {
        for geom in scene.prototypes()[instance.prototype as usize].clone() {
            put(geom, instance.placement.at(time));
        }
    }
    b.build().unwrap().0
}

/// Emitting instances are the same lights as their triangles placed in the world, up to rounding.
#[test]
fn instanced_lamps_match_single_lamps() {
    let mut b = SceneBuilder::new();
    add(&mut b, room(), material(0.5, 0.0));
    let lamp = b.add_material(material(0.0, 4.0)).unwrap();
    let lamps = b.add_prototype(vec![(panel(0.0, 0.2), lamp)]).unwrap();
    let place = |x: f32, turn: f32, mirror: f32| {
        affine_from_trs(
            Vec3::new(x, 0.3, 0.1),
            Vec3::new(turn, 20.0, 0.0),
            Vec3::new(mirror, 1.0, 1.0),
        )
    };
    for placement in [place(-0.5, 90.0, 1.0), place(0.1, 40.0, 2.0), place(0.6, -30.0, -1.0)] {
        b.add_instance(lamps, Placement::Still(placement)).unwrap();
    }
    let scene = b.build().unwrap().0;
    assert_eq!(scene.lights().len(), 6);
    // Mirrored triangles get a reversed winding, so the front stays the front.
    let mut single = SceneBuilder::new();
    add(&mut single, room(), material(0.5, 0.0));
    for instance in scene.instances() {
        let placement = instance.placement.at(0.0);
        let mut mesh = panel(0.0, 0.2);
        mesh.positions
            .iter_mut()
            .for_each(|p| *p = placement.transform_point3a(*p));
        if placement.matrix3.determinant() < 0.0 {
            mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        add(&mut single, mesh, material(0.0, 4.0));
    }
    let single = single.build().unwrap().0;
    let power = |scene: &Scene| scene.lights().iter().map(|l| l.power(1.0)).sum::<f64>();
    assert!((power(&scene) / power(&single) - 1.0).abs() < 1e-5);
    let by = |scene: &Scene, first: u64| {
        quarters(first..first + 16, |seed| {
            with_world(scene, inside(), SIZE, |world| {
                film_of(&path(world, true), SIZE, 32, seed)
            })
        })
    };
    assert_alike("lamps", &by(&scene, 0), &by(&single, 50));
}

/// Scene files define placement, motion and copies of objects.
#[test]
fn scene_files_place_and_move_objects() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("tri.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write("late.obj", "v 0 0 1\nv 1 0 1\nv 0 2 1\nf 1 2 3\n");
    write("other.obj", "v 0 0 1\nv 1 0 1\nv 0 2 1\nv 1 1 1\nf 1 2 3\nf 2 4 3\n");
    write(
        "list.txt",
        "# two copies\n1 0 0 5  0 1 0 0  0 0 1 0\n\n1,0,0,0, 0,2,0,0, 0,0,1,-3, 0,0,0,1 # taller\n",
    );
    let read = |text: &str| {
        write("s.toml", &format!("version = 1\n{text}"));
        load_result(&folder.path().join("s.toml"))
    };
    let places = |scene: &Scene, time: f32| -> Vec<Vec3> {
        let at = |i: &embrasure::scene::Instance| i.placement.at(time).transform_point3a(Vec3::Y);
        scene.instances().iter().map(at).collect()
    };

    // A single still object is placed in the world.
    let scene = read("[[object]]\nobj = \"tri.obj\"\ntransform = { translate = [0, 0, 2] }\n").unwrap();
    assert_eq!((scene.instances().len(), scene.meshes()[0].positions[0].z), (0, 2.0));

    // Two objects with the same file store it once.
    let scene =
        read("[[object]]\nobj = \"tri.obj\"\n[[object]]\nobj = \"tri.obj\"\ntransform = { scale = 2 }\n").unwrap();
    assert_eq!((scene.triangle_count(), scene.placed_triangle_count()), (1, 2));
    assert_eq!(places(&scene, 0.0), [Vec3::Y, 2.0 * Vec3::Y]);

    // Read a list of copies; the placement of the object moves all copies
    let scene = read("[[object]]\nobj = \"tri.obj\"\ninstances = \"list.txt\"\ntransform = { scale = 10 }\n").unwrap();
    assert_eq!(
        places(&scene, 0.0),
        [Vec3::new(50.0, 10.0, 0.0), Vec3::new(0.0, 20.0, -30.0)]
    );
    let rows = |x: u32| format!("[[1, 0, 0, {x}], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]");
    let (one, two) = (rows(1), rows(2));
    let scene = read(&format!("[[object]]\nobj = \"tri.obj\"\ninstances = [{one}, {two}]\n")).unwrap();
    assert_eq!(places(&scene, 0.0), [1.0, 2.0].map(|x| Vec3::new(x, 1.0, 0.0)));

    // The components of a transform, including angles, change linearly. So a full turn passes
    // through all angles.
    let scene =
        read("[[object]]\nobj = \"tri.obj\"\ntransform_close = { rotate = [0, 0, 360], translate = [4, 0, 0] }\n")
            .unwrap();
    assert!(scene.is_moving());
    for (time, place) in [
        (0.0, Vec3::Y),
        (0.25, Vec3::new(0.0, 0.0, 0.0)),
        (0.5, Vec3::new(2.0, -1.0, 0.0)),
        (1.0, Vec3::new(4.0, 1.0, 0.0)),
    ] {
        assert!(
            places(&scene, time)[0].distance(place) < 1e-3,
            "{time}: {:?}",
            places(&scene, time)
        );
    }
    // The radius is also right between two steps
    let radius = |time: f32| (places(&scene, time)[0] - Vec3::new(4.0 * time, 0.0, 0.0)).length();
    assert!((0..1000).all(|i| (radius(i as f32 / 1000.0) - 1.0).abs() < 1e-3));

    // Matrices rotate the shorter way.
    let quarter = "[[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]";
    let scene = read(&format!("[[object]]\nobj = \"tri.obj\"\nmatrix_close = {quarter}\n")).unwrap();
    let half = std::f32::consts::FRAC_1_SQRT_2;
    assert!(places(&scene, 0.5)[0].distance(Vec3::new(-half, half, 0.0)) < 1e-3);

    // Read a deforming shape
    let scene =
        read("[[object]]\nobj = \"tri.obj\"\nobj_close = \"late.obj\"\ntransform = { translate = [1, 0, 0] }\n")
            .unwrap();
    let corners = scene.meshes()[0].corners_at(embrasure::geometry::PrimId(0), 0.5);
    assert_eq!((corners[2], scene.is_moving()), (Vec3::new(1.0, 1.5, 0.5), true));
    assert_eq!(scene.bounds().max, Vec3::new(2.0, 2.0, 1.0));

    // Errors name the file and the line.
    write("bad.txt", "1 0 0 0  0 1 0 0  0 0 1\n");
    write("flat.txt", "1 0 0 0  0 1 0 0  0 0 1 0\n1 0 0 0  0 0 0 0  0 0 1 0\n");
    write("word.txt", "\n1 0 0 0  0 1 0 0  0 0 one 0\n");
    for (text, place, word) in [
        ("obj_close = \"other.obj\"", "s.toml:4:", "differ from those"),
        ("obj_close = \"missing.obj\"", "s.toml:4:", "missing.obj"),
        ("instances = \"bad.txt\"", "bad.txt:1:", "11 numbers"),
        ("instances = \"flat.txt\"", "flat.txt:2:", "flattens"),
        ("instances = \"word.txt\"", "word.txt:2:", "one"),
        ("instances = \"none.txt\"", "none.txt:", "instances"),
        ("instances = 3", "s.toml:4:", "instances"),
        ("transform_close = { scale = 0 }", "s.toml:4:", "flattens"),
        ("transform_close = { scale = -1 }", "s.toml:3:", "inside out"),
    ] {
        let error = read(&format!("[[object]]\nobj = \"tri.obj\"\n{text}\n")).unwrap_err();
        assert!(error.contains(place) && error.contains(word), "{text}: {error}");
    }
}

fn load_result(path: &std::path::Path) -> Result<Scene, String> {
    let file = embrasure::scene_file::SceneFile::load(path).map_err(|e| e.to_string())?;
    let loaded = embrasure::scene_file::load_scene(&file, SceneBuilder::new()).map_err(|e| e.to_string())?;
    Ok(loaded.scene)
}
