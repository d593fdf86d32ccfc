//! Subdivision of OBJ faces by the program. The surfaces themselves are tested beside their code
//! (`geometry/subdivision`).

use crate::support::program::*;
use crate::support::{budget, load, matte, read_channel};
use embrasure::accel::Accel;
use embrasure::geometry::Mesh;
use embrasure::math::{Ray, Vec2, Vec3};
use embrasure::sampler::{Bounce, Dimension, Independent, SampleKey, Sampler};
use embrasure::sampling::warp::uniform_sphere;
use embrasure::scene::Scene;
use tempfile::TempDir;

/// Cube of six quads with two materials and six parts. Its texture coordinates have seams at all
/// edges.
pub const CUBE: &str = "mtllib a.mtl\nv -1 -1 -1\nv 1 -1 -1\nv -1 1 -1\nv 1 1 -1\nv -1 -1 1\nv 1 -1 1\nv -1 1 1\nv 1 1 1\n\
    vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
    usemtl red\no back\nf 1/1 3/2 4/3 2/4\no front\nf 5/1 6/2 8/3 7/4\n\
    usemtl blue\no bottom\nf 1/1 2/2 6/3 5/4\no top\nf 3/1 7/2 8/3 4/4\no left\nf 1/1 5/2 7/3 3/4\no right\nf 2/1 4/2 8/3 6/4\n";
const LIBRARY: &str = "newmtl red\nKd 0.8 0.1 0.1\nnewmtl blue\nKd 0.1 0.1 0.8\n";
const SCENE: &str = "version = 1\n[camera]\nposition = [3, 2, 5]\nlook_at = [0, 0, 0]\n\
    [image]\nwidth = 32\nheight = 32\n[render]\nsamples = 4\n[[object]]\nobj = \"a.obj\"\n\
    [[light]]\ntype = \"constant\"\nradiance = 1\n";

fn cube(scene: &str) -> TempDir {
    folder(&[("a.obj", CUBE), ("a.mtl", LIBRARY), ("s.toml", scene)])
}

/// The scene with additional keys of its object.
fn with_keys(keys: &str) -> String {
    SCENE.replace("obj = \"a.obj\"\n", &format!("obj = \"a.obj\"\n{keys}\n"))
}

fn meshes(scene: &Scene) -> Vec<&Mesh> {
    scene.geom_ids().map(|geom| scene.mesh(geom)).collect()
}

/// Number of `count` random rays from `origin` that hit nothing.
pub fn escaping(accel: &dyn Accel, origin: Vec3, count: u32) -> usize {
    let direction = |i: u32| {
        let mut sampler = Independent::new(7);
        sampler.start(SampleKey::new(i, 0, 0));
        let u: Vec2 = sampler.get_2d(Dimension::bounce(0, Bounce::Direction));
        uniform_sphere(u)
    };
    let escapes = |i: &u32| accel.intersect(&Ray::new(origin, direction(*i))).is_none();
    (0..count).filter(escapes).count()
}

/// Calls `check` with each backend of this build.
#[cfg_attr(not(any(feature = "embree", feature = "obvhs")), expect(unused_variables))]
pub fn for_each_backend(scene: &Scene, check: impl Fn(&dyn Accel)) {
    #[cfg(feature = "embree")]
    check(&embrasure::accel::embree::EmbreeAccel::new(scene, 1).unwrap());
    #[cfg(feature = "obvhs")]
    check(&embrasure::accel::bvh::BvhAccel::new(scene));
}

/// A closed mesh stays closed across seams of texture coordinates, materials and parts.
#[test]
fn no_ray_escapes_a_closed_mesh() {
    let with = cube(&with_keys("subdivision = 4"));
    let scene = load(&with.path().join("s.toml"));
    assert_eq!(scene.triangle_count(), 6 * 2 * 256);
    for mesh in meshes(&scene) {
        assert!(!mesh.uvs.is_empty() && mesh.normals.iter().all(|n| n.is_normalized()));
    }
    for_each_backend(&scene, |accel| {
        assert_eq!(escaping(accel, Vec3::new(0.1, -0.2, 0.05), budget(10_000_000)), 0);
    });
}

/// Flags override keys. Triangles of hidden parts are not counted.
#[test]
fn flags_override_keys() {
    let triangles = |scene: &str, flags: &str| {
        let with = cube(scene);
        let out = done(with.path(), &joined(&["info", "s.toml", "--json"], &split(flags)));
        json(&out)["triangles"].as_u64().unwrap()
    };
    let of_file = SCENE.replace("samples = 4", "samples = 4\nsubdivision = 2");
    assert_eq!(triangles(SCENE, ""), 12);
    assert_eq!(triangles(&of_file, ""), 12 * 16);
    assert_eq!(
        triangles(&of_file.replace("a.obj\"\n", "a.obj\"\nsubdivision = 1\n"), ""),
        12 * 4
    );
    assert_eq!(triangles(&with_keys("subdivision = 3"), "--subdivide 0"), 12);
    assert_eq!(triangles(SCENE, "--subdivide 1"), 12 * 4);
    assert_eq!(triangles(SCENE, "--subdivide 1 --hide top"), 10 * 4);

    // Two objects use the same file with different steps
    let both =
        SCENE.to_string() + "[[object]]\nobj = \"a.obj\"\nsubdivision = 2\ntransform = { translate = [3, 0, 0] }\n";
    assert_eq!(triangles(&both, ""), 12 + 12 * 16);
    let error = refused(cube(&with_keys("subdivision = 40")).path(), &["render", "s.toml"], 1);
    assert!(
        error.contains("s.toml:12:15") && error.contains("from 0 to 12"),
        "{error}"
    );
    let error = refused(
        cube(SCENE).path(),
        &["render", "s.toml", "--subdivide", "2", "--obj-reader", "tobj"],
        2,
    );
    assert!(error.contains("--obj-reader own"), "{error}");
}

/// Faces keep their materials and parts.
#[test]
fn subdivision_keeps_materials_and_parts() {
    let with = cube(&with_keys("subdivision = 3\ncrease_angle = 30"));
    let sharp = cube(SCENE);
    for folder in [&with, &sharp] {
        done(
            folder.path(),
            &["render", "s.toml", "-q", "--aov", "cryptomatte", "-o", "t.exr"],
        );
    }
    let [fine, coarse] = [&with, &sharp].map(|folder| folder.path().join("t.exr"));
    // Sharp edges keep the cube: the same faces are visible.
    for channel in ["albedo.R", "albedo.B"] {
        let [a, b] = [&fine, &coarse].map(|path| read_channel(path, channel));
        let max = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(max < 0.05, "{channel}: {max}");
    }
    for part in ["top", "front", "right"] {
        let [a, b] = [&fine, &coarse].map(|path| matte(path, "CryptoPart", part));
        assert!(a.iter().sum::<f32>() > 20.0, "{part}");
        let differ = a.iter().zip(&b).filter(|(a, b)| (*a - *b).abs() > 0.01).count();
        assert!(differ < 8, "{part}: {differ}");
    }
}

/// If the steps need more memory than allowed, an error comes before any allocation. It names the
/// needed memory and a number of steps that fits.
#[test]
fn too_many_steps_suggest_a_fitting_number() {
    let with = cube(SCENE);
    let error = refused(
        with.path(),
        &["render", "s.toml", "--subdivide", "10", "--max-memory", "1G"],
        1,
    );
    assert!(
        error.contains("subdivision 10 makes 12582912 triangles from 6 faces"),
        "{error}"
    );
    assert!(error.contains("GB") && error.contains("--max-memory"), "{error}");
    let steps = error.split("--subdivide ").nth(1).unwrap();
    let steps = steps.split(',').next().unwrap();
    assert!(["7", "8"].contains(&steps), "{error}");
    done(
        with.path(),
        &[
            "render",
            "s.toml",
            "--subdivide",
            steps,
            "--max-memory",
            "1G",
            "--spp",
            "1",
            "-q",
            "-o",
            "t.exr",
        ],
    );
}

/// The two files of a deforming mesh, for the opening and the closing of the shutter, have the same
/// triangles after all steps.
#[test]
fn subdivision_keeps_moving_vertices() {
    let close = CUBE.replace("v 1 1 1", "v 2 2 2");
    let with = folder(&[
        ("a.obj", CUBE),
        ("b.obj", &close),
        ("a.mtl", LIBRARY),
        ("s.toml", &with_keys("obj_close = \"b.obj\"\nsubdivision = 2")),
    ]);
    let scene = load(&with.path().join("s.toml"));
    let meshes = meshes(&scene);
    assert!(
        meshes
            .iter()
            .all(|mesh| mesh.deforms() && !mesh.normals_close.is_empty())
    );
    let moves = |mesh: &&&Mesh| mesh.positions.iter().zip(&mesh.positions_close).any(|(a, b)| a != b);
    assert_eq!(meshes.iter().filter(moves).count(), 2);
}

/// Edges with three faces are counted, and stay sharp.
#[test]
fn non_manifold_edges_are_reported() {
    let fin = CUBE.replace("usemtl blue\n", "v 0 3 0\nv 0 3 1\nf 3 4 9 10\nusemtl blue\n");
    let with = folder(&[("a.obj", &fin), ("a.mtl", LIBRARY), ("s.toml", SCENE)]);
    let out = done(with.path(), &["check", "s.toml", "--subdivide", "2", "--json"]);
    let report = json(&out);
    let finding = report["findings"]
        .as_array()
        .unwrap()
        .iter()
        .find(|f| f["code"] == "sharp-edges");
    assert!(
        finding.unwrap()["message"]
            .as_str()
            .unwrap()
            .contains("1 edge of three faces or more stays sharp")
    );
    let plain = done(with.path(), &["check", "s.toml", "--json"]);
    assert!(!printed(&plain).contains("sharp-edges"));
}

/// Vertex colours stay at the vertices of the file, and are averaged between them.
#[test]
fn subdivision_interpolates_colors() {
    let square = "v 0 0 0 1 0 0\nv 2 0 0 1 0 0\nv 2 2 0 1 1 1\nv 0 2 0 1 1 1\nf 1 2 3 4\n";
    let scene = SCENE.replace(
        "position = [3, 2, 5]\nlook_at = [0, 0, 0]",
        "position = [1, 1, 5]\nlook_at = [1, 1, 0]",
    );
    let with = folder(&[("a.obj", square), ("s.toml", &scene)]);
    let picture = |flags: &str| {
        done(
            with.path(),
            &joined(&["render", "s.toml", "-q", "-o", "t.exr"], &split(flags)),
        );
        read_channel(&with.path().join("t.exr"), "albedo.G")
    };
    let (coarse, fine) = (picture(""), picture("--subdivide 3"));
    let max = coarse.iter().zip(&fine).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(max < 2e-3, "{max}");
}

/// Grid of 4 × 4 unit squares in the plane z = 0, around the origin. One vertex is raised, so that
/// each step changes the picture.
fn grid() -> String {
    let mut text = String::new();
    for i in 0..25 {
        let height = if i == 12 { 1 } else { 0 };
        text += &format!("v {} {} {height}\n", i % 5 - 2, i / 5 - 2);
    }
    for i in (0..20).filter(|i| i % 5 < 4) {
        text += &format!("f {} {} {} {}\n", i + 1, i + 2, i + 7, i + 6);
    }
    text
}

/// Scene of the grid, with 16 pixels per unit.
const FROM_ABOVE: &str = "version = 1\n[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\n\
    projection = \"orthographic\"\northo_height = 4\n[image]\nwidth = 64\nheight = 64\n[render]\nsamples = 4\n\
    [[object]]\nobj = \"a.obj\"\n[[light]]\ntype = \"directional\"\ndirection = [1, 1, -1]\nirradiance = 1\n";

fn grid_with(scene: &str) -> TempDir {
    folder(&[("a.obj", &grid()), ("s.toml", scene)])
}

/// Renders `s.toml` in the folder `with` with `flags`, and returns the path of the picture.
fn rendered(with: &TempDir, flags: &str, out: &str) -> std::path::PathBuf {
    done(
        with.path(),
        &joined(&["render", "s.toml", "-q", "-o", out], &split(flags)),
    );
    with.path().join(out)
}

/// Number of subdivision steps in the note of a render.
fn steps_of(with: &TempDir, flags: &str) -> u32 {
    let args = ["render", "s.toml", "--spp", "1", "-o", "n.exr"];
    let text = words(&done(with.path(), &joined(&args, &split(flags))));
    let steps = text.split("steps ").nth(1).unwrap_or_else(|| panic!("{text}"));
    steps.split(' ').next().unwrap().parse().unwrap()
}

/// The longest edge of the grid ends at the raised vertex. Its length is √2 · 16 = 22.6 pixels.
/// Each step halves the edges, until no edge is longer than the given number of pixels. The number
/// of steps depends on the image size and the camera, but not on crop and samples.
#[test]
fn steps_by_pixels_are_the_smallest_that_suffice() {
    let with = grid_with(FROM_ABOVE);
    for (pixels, steps) in [(23.0, 0), (22.0, 1), (12.0, 1), (11.0, 2), (5.7, 2), (5.6, 3), (1.5, 4)] {
        let flags = format!("--subdivide pixels:{pixels}");
        assert_eq!(steps_of(&with, &flags), steps, "{pixels}");
        assert_eq!(steps_of(&with, &format!("{flags} --size 128x128")), steps + 1);
    }
    let by_pixels = rendered(&with, "--subdivide pixels:5", "a.exr");
    assert_same_bits(&by_pixels, &rendered(&with, "--subdivide 3", "b.exr"));
    assert_eq!(steps_of(&with, "--subdivide pixels:5 --crop 0,0,8,8"), 3);
    assert_eq!(steps_of(&with, "--subdivide pixels:5 --set camera.ortho_height=16"), 1);

    // Set the steps by the key of an object, and by the key of `[render]`
    let key = FROM_ABOVE.replace("a.obj\"\n", "a.obj\"\nsubdivision = \"pixels:5\"\n");
    assert_same_bits(&by_pixels, &rendered(&grid_with(&key), "", "a.exr"));
    assert_same_bits(&by_pixels, &rendered(&grid_with(&key), "--subdivide 3", "a.exr"));
    let of_all = FROM_ABOVE.replace("samples = 4", "samples = 4\nsubdivision = \"pixels:5\"");
    assert_same_bits(&by_pixels, &rendered(&grid_with(&of_all), "", "a.exr"));
}

/// The number of steps is the maximum over all copies and both ends of their motion. A distant
/// camera needs fewer steps.
#[test]
fn steps_by_pixels_follow_the_nearest_placement() {
    let far = FROM_ABOVE.replace(
        "projection = \"orthographic\"\northo_height = 4\n",
        "vertical_fov = 40\n",
    );
    let far = far.replace("[0, 0, 5]", "[0, 0, 41]");
    let at = |z: u32| format!("[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, {z}], [0, 0, 0, 1]]");
    let with_key = |key: String| grid_with(&far.replace("a.obj\"\n", &format!("a.obj\"\n{key}\n")));
    let steps = |key: String| steps_of(&with_key(key), "--subdivide pixels:0.5");
    let alone = steps(String::new());
    // The camera has a quarter of its former distance to the raised vertex of the nearest copy, so
    // two more steps are necessary.
    let near = steps(format!("instances = [{}, {}]", at(0), at(30)));
    assert_eq!([alone, near], [3, 5]);
    assert_eq!(steps("transform_close = { translate = [0, 0, 30] }".into()), near);
    assert_eq!(steps("transform_close = { translate = [0, 0, -30] }".into()), alone);
    assert_eq!(steps("transform = { scale = 0.25 }".into()), alone - 2);
    let panorama = steps_of(
        &with_key(String::new()),
        "--subdivide pixels:0.5 --projection panorama --size 128x64",
    );
    assert!((1..=alone).contains(&panorama), "{panorama}");
    // If the camera is inside the object, the distance of an edge can be 0. A minimum distance
    // keeps the number of steps finite.
    let inside = far
        .replace("[0, 0, 41]", "[0.1, 0.2, 0]")
        .replace("look_at = [0, 0, 0]", "look_at = [1, 0, 0]");
    let text = words(&done(
        grid_with(&inside).path(),
        &[
            "render",
            "s.toml",
            "--spp",
            "1",
            "-o",
            "n.exr",
            "--subdivide",
            "pixels:64",
        ],
    ));
    assert!(text.contains("steps "), "{text}");
}

/// The guess of a camera uses the scene without subdivision. A dumped scene file has the number of
/// steps.
#[test]
fn steps_by_pixels_work_with_a_guessed_camera() {
    let with = grid_with(FROM_ABOVE);
    let args = |out| {
        [
            "render",
            "a.obj",
            "--size",
            "64x48",
            "--spp",
            "2",
            "--denoise=off",
            "-o",
            out,
        ]
    };
    let by_pixels = joined(&args("a.exr"), &["--subdivide", "pixels:2", "--dump-scene", "d.toml"]);
    let text = words(&done(with.path(), &by_pixels));
    assert!(
        text.contains("camera: ") && text.contains("light: ") && text.contains("steps 3 for a.obj"),
        "{text}"
    );
    let dumped = std::fs::read_to_string(with.path().join("d.toml")).unwrap();
    assert!(
        dumped.contains("subdivision = 3") && !dumped.contains("pixels"),
        "{dumped}"
    );
    done(
        with.path(),
        &["render", "d.toml", "--spp", "2", "--denoise=off", "-q", "-o", "b.exr"],
    );
    assert_same_bits(&with.path().join("a.exr"), &with.path().join("b.exr"));
    let twice = joined(&args("c.exr"), &["--subdivide", "pixels:2", "--threads", "1"]);
    done(with.path(), &twice);
    assert_same_bits(&with.path().join("a.exr"), &with.path().join("c.exr"));
}

/// Renders of ranges of the samples have the same number of steps, so the merged picture is
/// bit-identical to the whole picture. A resumed render is bit-identical too. Both hold for a given
/// and for a guessed camera.
#[test]
fn parts_with_steps_by_pixels_merge_to_one_picture() {
    let with = grid_with(FROM_ABOVE);
    let path = |name: &str| with.path().join(name);
    for scene in ["s.toml", "a.obj"] {
        let usual = ["render", scene, "-q", "--size", "32x32", "--denoise=off"];
        let render = |flags: &str| {
            done(with.path(), &joined(&usual, &split(flags)));
        };
        render("--spp 128 -o whole.exr --subdivide pixels:3");
        render("--spp 128 -o a.exr --subdivide pixels:3 --samples 0..64");
        render("--spp 128 -o b.exr --subdivide pixels:3 --samples 64..128 --threads 1");
        done(with.path(), &["merge", "-q", "a.exr", "b.exr", "-o", "merged.exr"]);
        assert_same_bits(&path("whole.exr"), &path("merged.exr"));
        let _ = std::fs::remove_file(path("c.exr"));
        render("--spp 64 --subdivide pixels:3 --checkpoint c.exr -o part.exr");
        render("--spp 128 --subdivide pixels:3 --checkpoint c.exr --resume -o resumed.exr");
        assert_same_bits(&path("whole.exr"), &path("resumed.exr"));
        // Parts with different numbers of steps belong to different scenes
        render("--spp 128 -o d.exr --subdivide pixels:40 --samples 64..128");
        refused(with.path(), &["merge", "-q", "a.exr", "d.exr", "-o", "merged.exr"], 1);
    }
}

/// The error of an invalid value has the value, and an example of a valid value. `check` reports
/// that it does not subdivide.
#[test]
fn invalid_steps_by_pixels_are_errors() {
    let with = grid_with(FROM_ABOVE);
    for value in [
        "pixels:0",
        "pixels:-1",
        "pixels:nan",
        "pixels:inf",
        "pixels:",
        "pixels:wide",
        "wide",
        "13",
    ] {
        let error = refused(with.path(), &["render", "s.toml", "--subdivide", value], 2);
        assert!(
            error.contains(&format!("--subdivide {value}")) && error.contains("pixels:1.5"),
            "{error}"
        );
        let key = FROM_ABOVE.replace("a.obj\"\n", &format!("a.obj\"\nsubdivision = \"{value}\"\n"));
        let error = refused(grid_with(&key).path(), &["render", "s.toml"], 1);
        assert!(
            error.contains(&format!("\"{value}\"")) && error.contains("pixels:1.5"),
            "{error}"
        );
    }
    let text = printed(&done(with.path(), &["check", "s.toml", "--subdivide", "pixels:2"]));
    assert!(text.contains("subdivision pixels:2 is not applied here"), "{text}");
    let tobj = ["render", "s.toml", "--subdivide", "pixels:2", "--obj-reader", "tobj"];
    assert!(refused(with.path(), &tobj, 2).contains("--obj-reader own"));
}
