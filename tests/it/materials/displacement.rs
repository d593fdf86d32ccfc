//! Displacement by material textures, from scene files and libraries.

use crate::files::subdivision::{escaping, for_each_backend};
use crate::support::program::*;
use crate::support::{budget, load};
use embrasure::math::Vec3;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A square of one quad in the plane z = 0, from 0 to 2.
const SQUARE: &str = "mtllib a.mtl\nusemtl wall\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
    f 1/1 2/2 3/3 4/4\n";
const LIBRARY: &str = "newmtl wall\nKd 0.5 0.5 0.5\n";
const SCENE: &str = "version = 1\n[camera]\nposition = [3, 2, 5]\nlook_at = [1, 1, 0]\n\
    [image]\nwidth = 32\nheight = 32\n[render]\nsamples = 4\n[[object]]\nobj = \"a.obj\"\nsubdivision = 3\n\
    [[light]]\ntype = \"point\"\nposition = [0, 1, 2]\nintensity = 5\n";

/// A folder with an image of 9 × 9 grey codes. Its texels are at the vertices of 8 × 8 quads.
fn wall(obj: &str, library: &str, scene: &str) -> (TempDir, Vec<u8>) {
    let with = folder(&[("a.obj", obj), ("a.mtl", library), ("s.toml", scene)]);
    let codes: Vec<u8> = (0..81u32).map(|i| (i * i * 37 % 251) as u8).collect();
    write_grey_png(&with.path().join("h.png"), &codes);
    (with, codes)
}

/// Patch with a displacement map and the texture keys `more`.
fn map(more: &str) -> String {
    format!("[patch.wall]\ndisplacement_map = {{ file = \"h.png\", {more} }}\n")
}

fn heights(path: &Path) -> Vec<f32> {
    let scene = load(path);
    let mesh = scene.mesh(scene.geom_ids().next().unwrap());
    mesh.positions.iter().map(|p| p.z).collect()
}

/// A constant image moves a surface by height × (value − midlevel).
#[test]
fn keys_scale_heights() {
    let grey = |keys: &str, flags: &str| {
        let scene = SCENE.to_string() + &map(keys);
        let (with, _) = wall(SQUARE, LIBRARY, &scene);
        write_grey_png(&with.path().join("h.png"), &[51]);
        done(
            with.path(),
            &joined(
                &[
                    "render",
                    "s.toml",
                    "-q",
                    "--spp",
                    "1",
                    "-o",
                    "t.exr",
                    "--dump-scene",
                    "d.toml",
                ],
                &split(flags),
            ),
        );
        // The dumped scene has the same displacement.
        [
            heights(&with.path().join("s.toml")),
            heights(&with.path().join("d.toml")),
        ]
    };
    for (keys, expected) in [
        ("", 0.2),
        ("height = 0.5", 0.1),
        ("midlevel = 0.5, height = 2", -0.6),
        ("base = 1, gain = 2", 1.4),
    ] {
        let keys = if keys.is_empty() { "wrap = \"clamp\"" } else { keys };
        for heights in grey(keys, "") {
            assert_eq!(heights.len(), 81);
            assert!(
                heights.iter().all(|h| (h - expected).abs() < 1e-5),
                "{keys}: {heights:?}"
            );
        }
    }
    let [_, off] = grey("height = 1", "--displacement off");
    assert!(off.iter().all(|&h| h == 0.0));
}

/// A height map on a plane gives the same image as an OBJ mesh with these heights. Both are shaded
/// flat.
#[test]
fn height_map_equals_the_mesh() {
    let n = 16u32;
    let (mut flat, mut bumpy, mut faces) = (String::new(), String::new(), String::new());
    let code = |x: u32, y: u32| ((x * 71 + y * y * 13) % 256) as u8;
    for y in 0..n {
        for x in 0..n {
            let [u, v] = [x, y].map(|i| (i as f32 + 0.5) / n as f32);
            flat += &format!("v {u} {v} 0\nvt {u} {v}\n");
            bumpy += &format!("v {u} {v} {}\nvt {u} {v}\n", f32::from(code(x, y)) / 255.0 * 0.25);
            if x + 1 < n && y + 1 < n {
                let a = y * n + x + 1;
                let [b, c, d] = [a + 1, a + n + 1, a + n];
                faces += &format!("f {a}/{a} {b}/{b} {c}/{c}\nf {a}/{a} {c}/{c} {d}/{d}\n");
            }
        }
    }
    let scene = SCENE
        .replace("subdivision = 3\n", "")
        .replace("[1, 1, 0]", "[0.5, 0.5, 0]");
    let keys = "texture_filter = \"bilinear\"\nsamples = 4";
    let displaced = scene.replace("samples = 4", keys) + &map("height = 0.25");
    let obj = |vertices: &str| format!("mtllib a.mtl\n{vertices}usemtl wall\n{faces}");
    let (one, _) = wall(&obj(&flat), LIBRARY, &displaced);
    let (other, _) = wall(&obj(&bumpy), LIBRARY, &scene.replace("samples = 4", keys));
    // Rows of an image run from top to bottom.
    let codes: Vec<u8> = (0..n)
        .rev()
        .flat_map(|y| (0..n).map(move |x| (x, y)))
        .map(|(x, y)| code(x, y))
        .collect();
    write_square(&one.path().join("h.png"), n, &codes);
    for folder in [&one, &other] {
        done(folder.path(), &["render", "s.toml", "-q", "-o", "t.exr"]);
    }
    let [a, b] = [&one, &other].map(|folder| heights(&folder.path().join("s.toml")));
    let max = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(a.len() == (n * n) as usize && max < 1e-6, "{max}");
    let [a, b] = [&one, &other].map(|folder| crate::support::read_rgb(&folder.path().join("t.exr")));
    for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
        assert!((a - b).abs() <= 1e-3 * (a + b), "{a} {b}");
    }
}

fn write_square(path: &Path, width: u32, codes: &[u8]) {
    let texels: Vec<[u8; 3]> = codes.iter().map(|&code| [code; 3]).collect();
    crate::support::write_png(path, width, &texels);
}

/// `disp` of a library displaces an object if the object is subdivided or a flag requests it. `-mm`
/// scales the displacement.
#[test]
fn libraries_displace_subdivided_objects() {
    let library = LIBRARY.to_string() + "disp -mm 0.1 0.5 h.png\n";
    let coarse = SCENE.replace("subdivision = 3\n", "");
    let (with, _) = wall(SQUARE, &library, &coarse);
    write_grey_png(&with.path().join("h.png"), &[51]);
    let warnings = |flags: &str| {
        let out = run(with.path(), &joined(&["check", "s.toml", "--json"], &split(flags)));
        printed(&out)
    };
    let path = with.path().join("s.toml");
    assert!(heights(&path).iter().all(|&h| h == 0.0));
    let idle = warnings("");
    assert!(
        idle.contains("idle-displacement") && idle.contains("--subdivide"),
        "{idle}"
    );
    for flags in ["--displacement off", "--displacement on", "--subdivide 2"] {
        assert!(!warnings(flags).contains("idle-displacement"), "{flags}");
    }
    assert!(warnings("--subdivide 2").contains("vertices move by 0.2 to 0.2 units"));
    fs::write(&path, SCENE).unwrap();
    assert!(heights(&path).iter().all(|h| (h - 0.2).abs() < 1e-6));
    // A missing image gives the same warning as any missing texture.
    fs::remove_file(with.path().join("h.png")).unwrap();
    assert!(warnings("").contains("missing-texture"), "{}", warnings(""));
}

/// A closed box stays closed under displacement. This includes seams of texture coordinates,
/// borders of materials, and sharp edges.
#[test]
fn no_ray_escapes_a_displaced_box() {
    let scene = SCENE.replace("subdivision = 3", "subdivision = 5\ncrease_angle = 30")
        + "[patch.\"*\"]\ndisplacement_map = { file = \"h.png\", height = 0.4, midlevel = 0.5 }\n";
    let library = "newmtl red\nKd 0.8 0.1 0.1\nnewmtl blue\nKd 0.1 0.1 0.8\n";
    let (with, _) = wall(crate::files::subdivision::CUBE, library, &scene);
    let codes: Vec<u8> = (0..256u32).map(|i| (i * i * 37 % 251) as u8).collect();
    write_square(&with.path().join("h.png"), 16, &codes);
    let scene = load(&with.path().join("s.toml"));
    assert_eq!(scene.triangle_count(), 12 << 10);
    for_each_backend(&scene, |accel| {
        assert_eq!(escaping(accel, Vec3::new(0.1, -0.2, 0.05), budget(10_000_000)), 0);
    });
}
