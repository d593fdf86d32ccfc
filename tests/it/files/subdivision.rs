//! Subdivision of OBJ faces by the program. The surfaces themselves are tested beside their code
//! (`geometry/subdivision`).

use crate::support::program::*;
use crate::support::{load, matte, read_channel};
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
        assert_eq!(escaping(accel, Vec3::new(0.1, -0.2, 0.05), 1_000_000), 0);
    });
}

/// Flags override keys. Faces of hidden parts do not count.
#[test]
fn flags_win_over_keys() {
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
        error.contains("subdivision 10 makes 12582912 triangles of 6 faces"),
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

/// Two files of one mesh at two times have the same triangles after all steps.
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
