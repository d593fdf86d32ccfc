//! Cuts: planes that cut the scene, and surfaces that the camera does not see.

use crate::support::program::*;
use crate::support::read_channel;
use crate::support::statistics::{Mean, assert_all_means_within};
use std::f64::consts::{PI, TAU};
use std::fs;
use tempfile::TempDir;

/// OBJ file of a sphere of radius 2 around the origin, with 96 segments.
fn sphere() -> String {
    const SEGMENTS: usize = 96;
    let rings = SEGMENTS / 2;
    let mut obj = String::from("o Ball\n");
    for ring in 1..rings {
        let (sin, cos) = (PI * ring as f64 / rings as f64).sin_cos();
        for i in 0..SEGMENTS {
            let (s, c) = (TAU * i as f64 / SEGMENTS as f64).sin_cos();
            obj += &format!("v {} {} {}\n", 2.0 * sin * c, 2.0 * cos, -2.0 * sin * s);
        }
    }
    obj += "v 0 2 0\nv 0 -2 0\n";
    let at = |ring: usize, i: usize| (ring - 1) * SEGMENTS + i % SEGMENTS + 1;
    let poles = [(rings - 1) * SEGMENTS + 1, (rings - 1) * SEGMENTS + 2];
    for i in 0..SEGMENTS {
        obj += &format!("f {} {} {}\n", poles[0], at(1, i), at(1, i + 1));
        obj += &format!("f {} {} {}\n", poles[1], at(rings - 1, i + 1), at(rings - 1, i));
        for ring in 1..rings - 1 {
            let corners = [at(ring, i), at(ring + 1, i), at(ring + 1, i + 1), at(ring, i + 1)];
            obj += &format!("f {} {} {} {}\n", corners[0], corners[1], corners[2], corners[3]);
        }
    }
    obj
}

/// Faces of an axis-aligned box, facing inwards if `is_room`. Adds the number of its vertices to
/// `vertices`.
fn cuboid(min: [f64; 3], max: [f64; 3], is_room: bool, vertices: &mut usize) -> String {
    let mut obj = String::new();
    for i in 0..8 {
        let side = |bit: usize| if i >> bit & 1 == 0 { min[bit] } else { max[bit] };
        obj += &format!("v {} {} {}\n", side(0), side(1), side(2));
    }
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    for mut quad in quads {
        if is_room {
            quad.reverse();
        }
        let [a, b, c, d] = quad.map(|i| i + *vertices + 1);
        obj += &format!("f {a} {b} {c} {d}\n");
    }
    *vertices += 8;
    obj
}

const ABOVE: &str = "--projection orthographic --position 0,9,0 --look-at 0,0,0 --up 0,0,-1";

#[test]
fn cap_area_matches_the_circle() {
    let folder = folder(&[("a.obj", &sphere())]);
    for backend in ["embree", "obvhs"] {
        for h in [0.5f64, -1.2] {
            let args = format!(
                "render a.obj -q -o t.exr --backend {backend} --cut y={h} {ABOVE} --ortho-height 5 \
                 --size 200x200 --spp 1 --aov P --no-ground --filter box --filter-radius 1e-5"
            );
            done(folder.path(), &split(&args));
            let y = read_channel(&folder.path().join("t.exr"), "P.Y");
            let pixels = y.iter().filter(|&&y| (f64::from(y) - h).abs() < 1e-5).count();
            let area = pixels as f64 * (5.0f64 / 200.0).powi(2);
            let circle = PI * (4.0 - h * h);
            assert!(
                (area / circle - 1.0).abs() < 0.01,
                "{backend}, {h}: {area}, not {circle}"
            );
            // Rays that miss have the position 0.
            let above = y.iter().filter(|&&y| f64::from(y) > h.max(0.0) + 1e-5).count();
            assert_eq!(above, 0);
        }
    }
}

/// The volumes of both halves of a cut sphere add up to the volume of the sphere, and are those of
/// spherical segments. The caps close both halves: parallel rays from above and from below measure
/// the thickness.
#[test]
fn volumes_of_both_halves_add_up() {
    const SIDE: f64 = 200.0;
    let folder = folder(&[("a.obj", &sphere())]);
    let volume = |cut: &str| {
        let heights = [("0,9,0", "0,0,-1"), ("0,-9,0", "0,0,1")].map(|(place, up)| {
            let args = format!(
                "render a.obj -q -o t.exr {cut} --projection orthographic --position {place} --look-at 0,0,0 --up {up} \
                 --ortho-height 5 --size {SIDE}x{SIDE} --spp 1 --no-ground --filter box --filter-radius 1e-5"
            );
            done(folder.path(), &split(&args));
            let depths = read_channel(&folder.path().join("t.exr"), "Z");
            let seen = depths.iter().filter(|&&depth| depth < 1e9);
            seen.map(|&depth| 9.0 - f64::from(depth)).sum::<f64>()
        });
        (heights[0] + heights[1]) * (5.0 / SIDE).powi(2)
    };
    let whole = volume("");
    let exact = 4.0 / 3.0 * PI * 8.0;
    assert!((whole / exact - 1.0).abs() < 0.01, "{whole}, not {exact}");
    for h in [0.5f64, -1.2] {
        let (below, above) = (volume(&format!("--cut y={h}")), volume(&format!("--cut=-y={h}")));
        assert!((below + above - whole).abs() < 2e-3 * whole, "{h}: {below} and {above}");
        let segment = PI * (2.0 - h).powi(2) * (4.0 + h) / 3.0;
        assert!((above / segment - 1.0).abs() < 0.02, "{h}: {above}, not {segment}");
    }
}

/// A cut has the same effect in its three forms: a section of a scene file, a flag, and a scene
/// file that `--dump-scene` wrote.
#[test]
fn sections_in_files_and_flags_are_equal() {
    let scene = |section: &str| {
        format!(
            "version = 1\n[image]\nwidth = 32\nheight = 24\n[render]\nsamples = 2\n[camera]\nposition = [3, 5, 6]\n\
             look_at = [0, 0, 0]\n[[object]]\nobj = \"a.obj\"\n{section}"
        )
    };
    let folder = folder(&[
        ("a.obj", &sphere()),
        ("plain.toml", &scene("")),
        ("axis.toml", &scene("[[section]]\naxis = \"-z\"\nvalue = 0.25\n")),
        (
            "normal.toml",
            &scene(
                "[[section]]\nnormal = [0, 0, -2]\npoint = [7, 7, 0.25]\nmaterial = \"red\"\n[material.red]\ndiffuse = [0.05, 0.05, 0.05]\n",
            ),
        ),
    ]);
    let path = |name: &str| folder.path().join(name);
    let flags = "--cut -z=0.25 --dump-scene dumped.toml";
    for (scene, name) in [("axis", "a"), ("normal", "b")] {
        done(folder.path(), &split(&format!("render {scene}.toml -q -o {name}.exr")));
    }
    done(folder.path(), &split(&format!("render plain.toml -q -o c.exr {flags}")));
    done(folder.path(), &split("render dumped.toml -q -o d.exr"));
    done(folder.path(), &split("render plain.toml -q -o e.exr"));
    for other in ["b.exr", "c.exr", "d.exr"] {
        assert_same_bits(&path("a.exr"), &path(other));
    }
    assert_ne!(read_channel(&path("a.exr"), "R"), read_channel(&path("e.exr"), "R"));
}

#[test]
fn invalid_sections_are_errors_with_help() {
    let sheet = "o Curtain\nv 4 -1 0\nv 5 -1 0\nv 4 1 0\nf 1 2 3\n";
    let scene = |section: &str| format!("version = 1\n[[object]]\nobj = \"a.obj\"\n{section}");
    let folder = folder(&[
        ("a.obj", &sphere()),
        ("sheet.obj", sheet),
        ("none.toml", &scene("[[section]]\nmaterial = \"a\"\n")),
        (
            "both.toml",
            &scene("[[section]]\naxis = \"x\"\nvalue = 1\nnormal = [1, 0, 0]\n"),
        ),
        ("axis.toml", &scene("[[section]]\naxis = \"w\"\nvalue = 1\n")),
        ("value.toml", &scene("[[section]]\naxis = \"y\"\n")),
        ("zero.toml", &scene("[[section]]\nnormal = [0, 0, 0]\n")),
    ]);
    for (args, code, parts) in [
        ("a.obj --cut q=1", 2, ["--cut q=1", "z=1.2 keeps"]),
        ("a.obj --cut z", 2, ["--cut z", "AXIS=VALUE"]),
        ("a.obj --cut z=-9", 2, ["z=-9 leaves nothing", "embrasure info"]),
        ("none.toml", 1, ["without a plane", "axis = "]),
        ("both.toml", 1, ["both.toml:5", "keep one"]),
        ("axis.toml", 1, ["axis.toml:5", "x, y, z, -x"]),
        ("value.toml", 1, ["needs a finite `value` or `height`", "value = 1.2"]),
        ("zero.toml", 1, ["zero.toml:5", "not zero"]),
    ] {
        let words = refused(
            folder.path(),
            &split(&format!("render {args} -q --spp 1 -o t.exr")),
            code,
        );
        assert!(parts.iter().all(|part| words.contains(part)), "{args}: {words}");
    }
    let render = "render sheet.obj -q --size 8x8 --spp 1 -o t.exr --cut y=0";
    let words = words(&done(folder.path(), &split(render)));
    assert!(
        words.contains("not closed") && words.contains("`Curtain` at"),
        "{words}"
    );
}

/// A closed room with a lamp below its ceiling, a solid body on its floor, and a glass pane across
/// the room.
fn room() -> TempDir {
    let mut vertices = 0;
    let mut obj = String::from("mtllib a.mtl\nusemtl wall\n");
    obj += &cuboid([-2.2, -0.2, -2.2], [2.2, 3.2, 2.2], false, &mut vertices);
    obj += &cuboid([-2.0, 0.0, -2.0], [2.0, 3.0, 2.0], true, &mut vertices);
    obj += "usemtl red\n";
    obj += &cuboid([-1.2, 0.0, -0.8], [-0.4, 1.8, 0.4], false, &mut vertices);
    obj += "usemtl lamp\n";
    obj += &cuboid([-0.7, 2.6, -0.6], [0.6, 2.7, 0.6], false, &mut vertices);
    obj += "usemtl glass\n";
    obj += &cuboid([0.8, 0.1, -1.9], [0.82, 2.9, 1.9], false, &mut vertices);
    folder(&[
        ("a.obj", &obj),
        (
            "a.mtl",
            "newmtl wall\nKd 0.6 0.6 0.6\nnewmtl red\nKd 0.7 0.2 0.1\nnewmtl lamp\nKd 0 0 0\nKe 6 6 6\n\
             newmtl glass\nKd 0 0 0\nKs 1 1 1\nNs 1000\nTf 1 1 1\nNi 1.5\nd 0.1\nillum 4\n",
        ),
        (
            "s.toml",
            "version = 1\n[image]\nwidth = 16\nheight = 16\n[[object]]\nobj = \"a.obj\"\n",
        ),
    ])
}

/// Means of blocks of pixels. Errors are computed from renders with several seeds.
fn means(folder: &TempDir, flags: &str, seeds: u32) -> Vec<Mean> {
    let render = |seed: u32| {
        let args = format!("render s.toml -q -o t.exr --ortho-height 3.6 --seed {seed} {flags}");
        done(folder.path(), &split(&args));
        let channels = ["R", "G", "B"].map(|name| read_channel(&folder.path().join("t.exr"), name));
        let mut blocks = Vec::new();
        for channel in channels {
            for block in 0..16 {
                let pixels = (0..16).map(|i| (block / 4 * 4 + i / 4) * 16 + block % 4 * 4 + i % 4);
                blocks.push(pixels.map(|pixel| f64::from(channel[pixel])).sum::<f64>() / 16.0);
            }
        }
        blocks
    };
    let renders: Vec<Vec<f64>> = (0..seeds).map(render).collect();
    Mean::of_each(&renders)
}

/// A camera above the cut room sees the same points as a camera inside the whole room. The lamp is
/// above the cutting plane.
#[test]
fn cut_room_keeps_the_light_of_the_whole_room() {
    let folder = room();
    let place = |y: f64| format!("--projection orthographic --position 0,{y},0 --look-at 0,0,0 --up 0,0,-1");
    let (within, above) = (place(1.95), place(9.0));
    for (method, reference) in [
        ("path --spp 32", "path --spp 32"),
        ("path --spp 32 --backend obvhs", "path --spp 32"),
        ("bdpt --spp 16", "bdpt --spp 16"),
        ("light --spp 64", "light --spp 64"),
        ("vcm --spp 16", "vcm --spp 16"),
        ("mlt --spp 32", "mlt --spp 32"),
    ] {
        let whole = means(&folder, &format!("{within} --integrator {reference}"), 6);
        let cut = means(
            &folder,
            &format!("{above} --cut y=2 --cut-light whole --integrator {method}"),
            6,
        );
        let pairs: Vec<(Mean, Mean)> = whole.into_iter().zip(cut).collect();
        assert_all_means_within(method, &pairs, |_| 0.0);
    }
}

/// If a wall is hidden, a camera behind the wall sees the same image as a camera in the room, and a
/// mirror still shows the wall.
#[test]
fn hidden_surfaces_keep_their_light() {
    let folder = room();
    let view = |z: f64| format!("--projection orthographic --position 0,1.3,{z} --look-at 0,1.3,0");
    let (within, behind) = (view(1.9), view(8.0));
    // All walls have one material. If this material is hidden, the other surfaces remain.
    fs::write(
        folder.path().join("s.toml"),
        "version = 1\n[image]\nwidth = 16\nheight = 16\n[[object]]\nobj = \"a.obj\"\n[material.glass]\nopacity = 0\n",
    )
    .unwrap();
    let red = |flags: &str| {
        let args = format!("render s.toml -q -o t.exr --ortho-height 2.6 --spp 256 {flags}");
        done(folder.path(), &split(&args));
        read_channel(&folder.path().join("t.exr"), "R")
    };
    let whole = red(&within);
    for flags in [
        "--material wall.camera_visible=false",
        "--material wall.camera_visible=false --integrator bdpt",
    ] {
        let hidden = red(&format!("{behind} {flags}"));
        let solid = |i: usize| (1..5).contains(&(i % 16)) && (6..14).contains(&(i / 16));
        let mean = |picture: &[f32]| {
            let pixels: Vec<f32> = (0..256).filter(|&i| solid(i)).map(|i| picture[i]).collect();
            pixels.iter().sum::<f32>() / pixels.len() as f32
        };
        let [a, b] = [mean(&whole), mean(&hidden)];
        assert!(a > 0.01 && (a / b - 1.0).abs() < 0.05, "{flags}: {a} {b}");
        // Walls in the background are also hidden.
        assert_eq!(hidden[0], 0.0, "{flags}");
    }
    // The whole object is hidden, so nothing is visible.
    fs::write(
        folder.path().join("s.toml"),
        "version = 1\n[image]\nwidth = 16\nheight = 16\n[[object]]\nobj = \"a.obj\"\ncamera_visible = false\n",
    )
    .unwrap();
    assert!(red(&behind).iter().all(|&value| value == 0.0));
}
