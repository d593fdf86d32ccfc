//! Lines of drawings: their width, the edges that have lines, and lines in PNG files.

use crate::support::program::{assert_same_bits, done, folder, joined, printed, refused, split};
use crate::support::read_channel;
use std::f32::consts::PI;
use std::path::Path;
use tempfile::TempDir;

const SIZE: usize = 64;
/// Flags of a camera that sees 64 × 64 units, so that a pixel is one unit wide.
const CAMERA: &str = "--projection orthographic --ortho-height 64 --position 0,0,50 --look-at 0,0,0 --size 64x64";

/// Plates of 20 x 20 units:
///
/// - `plate.obj`: a single plate.
/// - `fold.obj`: two plates that meet in an edge of 20° and are one smooth part, and in another
///   part two plates that meet in an edge of 40°.
/// - `step.obj`: a plate half of which lies 3 behind the other half; both are one part.
/// - `pair.obj`: two coplanar halves of two materials.
/// - `hidden.obj`: a plate with `d 0`.
fn scenes() -> TempDir {
    let quad = |points: [[f64; 3]; 4]| points.map(|[x, y, z]| format!("v {x} {y} {z}\n")).concat();
    let fold = |x: f64, degrees: f64| {
        let depth = -10.0 * (0.5 * degrees).to_radians().tan();
        let (left, right) = (x - 10.0, x + 10.0);
        quad([
            [left, -10.0, depth],
            [x, -10.0, 0.0],
            [x, 10.0, 0.0],
            [left, 10.0, depth],
        ]) + &quad([
            [x, -10.0, 0.0],
            [right, -10.0, depth],
            [right, 10.0, depth],
            [x, 10.0, 0.0],
        ])
    };
    let plate = quad([
        [-10.0, -10.0, 0.0],
        [10.0, -10.0, 0.0],
        [10.0, 10.0, 0.0],
        [-10.0, 10.0, 0.0],
    ]);
    let halves = |z: f64| {
        quad([
            [-10.0, -10.0, 0.0],
            [0.0, -10.0, 0.0],
            [0.0, 10.0, 0.0],
            [-10.0, 10.0, 0.0],
        ]) + &quad([[0.0, -10.0, z], [10.0, -10.0, z], [10.0, 10.0, z], [0.0, 10.0, z]])
    };
    let scene = |obj: &str| {
        format!("version = 1\n[[object]]\nobj = \"{obj}\"\n[[light]]\ntype = \"constant\"\nradiance = [1, 1, 1]\n")
    };
    folder(&[
        (
            "m.mtl",
            "newmtl a\nKd 0.5 0.5 0.5\nnewmtl b\nKd 0.2 0.5 0.5\nnewmtl none\nKd 1 1 1\nd 0\n",
        ),
        ("plate.obj", &format!("{plate}f 1 2 3 4\n")),
        (
            "fold.obj",
            &format!(
                "{}{}f 1 2 3 4\nf 5 6 7 8\ng other\nf 9 10 11 12\nf 13 14 15 16\n",
                fold(-20.0, 20.0),
                fold(20.0, 40.0)
            ),
        ),
        ("step.obj", &format!("{}f 1 2 3 4\nf 5 6 7 8\n", halves(-3.0))),
        (
            "pair.obj",
            &format!(
                "mtllib m.mtl\n{}usemtl a\nf 1 2 3 4\nusemtl b\nf 5 6 7 8\n",
                halves(0.0)
            ),
        ),
        (
            "hidden.obj",
            &format!(
                "mtllib m.mtl\n{plate}v 0 0 -20\nv 1 0 -20\nv 0 1 -20\nusemtl none\nf 1 2 3 4\nusemtl a\nf 5 6 7\n"
            ),
        ),
        ("plate.toml", &scene("plate.obj")),
        ("fold.toml", &scene("fold.obj")),
        ("step.toml", &scene("step.obj")),
        ("pair.toml", &scene("pair.obj")),
        ("hidden.toml", &scene("hidden.obj")),
    ])
}

/// Channel of lines of `scene`, rendered with the additional `flags`.
fn lines(folder: &Path, scene: &str, flags: &str) -> Vec<f32> {
    let command = format!("render {scene}.toml -q --denoise=off --spp 16 --aov lines -o {scene}.exr {CAMERA} {flags}");
    done(folder, &split(&command));
    read_channel(&folder.join(format!("{scene}.exr")), "lines")
}

/// Area of the lines in square pixels.
fn area(folder: &Path, scene: &str, flags: &str) -> f32 {
    lines(folder, scene, flags).iter().sum()
}

/// Mean of the channel `lines` in the column `x`, over rows in the middle of the plates.
fn column(values: &[f32], x: usize) -> f32 {
    let rows = 26..38;
    let count = rows.len() as f32;
    rows.map(|y| values[y * SIZE + x]).sum::<f32>() / count
}

/// A line of width w lies on both sides of an edge. Outside of a square of side s it has the area 2
/// s w + π w² / 4, and inside 2 s w − w². The outer corners are octagons instead of circles, so the
/// area is smaller by up to 0.2 w².
#[test]
fn lines_have_their_width() {
    let scenes = scenes();
    for width in [1.0f32, 2.0, 5.0] {
        let found = area(scenes.path(), "plate", &format!("--lines-width {width}"));
        let expected = 80.0 * width + (0.25 * PI - 1.0) * width * width;
        let error = (found - expected).abs();
        assert!(
            error < 0.01 * expected + 0.1 * width * width,
            "{width}: {found}, not {expected}"
        );
    }
}

/// Edges inside the plates have lines at creases, steps and changes of material.
#[test]
fn lines_are_creases_steps_and_changes_of_material() {
    let scenes = scenes();
    let fold = lines(scenes.path(), "fold", "--lines-width 2");
    // The edges at x = ±20 lie between columns 11 and 12, and between columns 51 and 52.
    assert_eq!(
        column(&fold, 11) + column(&fold, 12),
        0.0,
        "an edge of 20° is no crease"
    );
    assert_eq!(column(&fold, 51) + column(&fold, 52), 2.0, "an edge of 40° is a crease");
    let sharper = lines(scenes.path(), "fold", "--lines-width 2 --lines-angle 50");
    assert_eq!(column(&sharper, 51), 0.0);
    let flatter = lines(scenes.path(), "fold", "--lines-width 2 --lines-angle 10");
    assert_eq!(column(&flatter, 11), 1.0);
    for scene in ["step", "pair"] {
        let values = lines(scenes.path(), scene, "--lines-width 2");
        assert_eq!(
            (column(&values, 31), column(&values, 32), column(&values, 28)),
            (1.0, 1.0, 0.0),
            "{scene}"
        );
    }
    assert_eq!(
        column(&lines(scenes.path(), "hidden", ""), 22),
        0.0,
        "invisible plates have no lines"
    );
}

/// Lines depend on sample positions, which differ between path reuse and other methods. They do not
/// depend on parts.
#[test]
fn lines_are_the_same_in_all_integrators_and_parts() {
    let scenes = scenes();
    let folder = scenes.path();
    let expected = lines(folder, "fold", "--reuse none");
    for integrator in [
        "path",
        "naive",
        "bdpt",
        "light",
        "whitted",
        "sppm",
        "vcm",
        "photon-map",
        "ao",
    ] {
        let found = lines(folder, "fold", &format!("--integrator {integrator}"));
        let sum = |values: &[f32]| values.iter().sum::<f32>();
        let differences = found.iter().zip(&expected).map(|(a, b)| (a - b).abs());
        let largest = differences.fold(0.0, f32::max);
        let ratio = sum(&found) / sum(&expected);
        assert!(
            (ratio - 1.0).abs() < 0.01 && largest < 0.4,
            "{integrator}: {ratio}, {largest}"
        );
    }
    let part = |range: &str, name: &str| {
        let command = format!("render fold.toml -q --denoise=off --spp 128 --lines red {CAMERA} -o {name}");
        done(folder, &joined(&split(&command), &split(range)));
    };
    part("", "whole.exr");
    part("", "whole.png");
    part("--samples 0..64", "a.exr");
    part("--samples 64..128", "b.exr");
    done(folder, &split("merge a.exr b.exr -q -o merged.exr -o merged.png"));
    assert_same_bits(&folder.join("whole.exr"), &folder.join("merged.exr"));
    let bytes = |name: &str| image::open(folder.join(name)).unwrap().into_rgba8();
    assert!(bytes("whole.png") == bytes("merged.png"));
}

#[test]
fn pictures_show_lines_in_their_color() {
    let scenes = scenes();
    let folder = scenes.path();
    let render = format!("render plate.toml -q --denoise=off --spp 4 --lines-width 4 {CAMERA}");
    done(
        folder,
        &joined(&split(&render), &split("--lines #ff8000 -o a.png -o a.exr")),
    );
    done(folder, &joined(&split(&render), &split("--aov lines -o b.exr")));
    done(folder, &split("develop b.exr -q --lines=#ff8000 -o b.png -o c.exr"));
    done(folder, &split("develop b.exr -q -o plain.png"));
    done(folder, &split("develop a.exr -q -o d.png"));
    let image = |name: &str| image::open(folder.join(name)).unwrap().into_rgb8();
    let (a, plain) = (image("a.png"), image("plain.png"));
    assert!(a == image("b.png") && a == image("d.png"));
    assert_eq!(a.get_pixel(22, 32).0, [255, 128, 0]);
    assert_eq!(a.get_pixel(32, 32), plain.get_pixel(32, 32));
    assert_ne!(plain.get_pixel(22, 32).0, [255, 128, 0]);
    // A flag switches off the lines of a scene file, and the lines that the EXR file of a render
    // stores for `develop`.
    let scene = std::fs::read_to_string(folder.join("plate.toml")).unwrap();
    let scene = format!("{scene}\n[image]\nlines = \"#ff8000\"\nlines_width = 4\n");
    std::fs::write(folder.join("lined.toml"), scene).unwrap();
    let render = format!("render lined.toml -q --denoise=off --spp 4 {CAMERA}");
    done(folder, &joined(&split(&render), &split("-o e.png")));
    done(
        folder,
        &joined(
            &split(&render),
            &split("--lines off -o off.png -o off.exr --dump-scene off.toml"),
        ),
    );
    assert!(image("e.png") == a && image("off.png") == plain);
    let listed = printed(&done(folder, &split("develop off.exr --list")));
    assert!(!listed.contains("lines"), "{listed}");
    done(folder, &split("render off.toml -q --denoise=off -o again.png"));
    assert!(image("again.png") == plain);
    done(folder, &split("develop a.exr -q --lines=off -o f.png"));
    assert!(image("f.png") == plain);
    // In EXR files the colour is linear light.
    let red = read_channel(&folder.join("c.exr"), "R");
    let blue = read_channel(&folder.join("c.exr"), "B");
    assert_eq!((red[32 * SIZE + 22], blue[32 * SIZE + 22]), (1.0, 0.0));
    // Over a transparent background lines are opaque.
    done(
        folder,
        &joined(
            &split(&render),
            &split("--lines black --background transparent -o t.png"),
        ),
    );
    let t = image::open(folder.join("t.png")).unwrap().into_rgba8();
    assert_eq!(t.get_pixel(20, 32).0, [0, 0, 0, 255]);
    assert_eq!(t.get_pixel(2, 2).0[3], 0);
}

#[test]
fn lines_that_cannot_be_drawn_are_errors() {
    let scenes = scenes();
    let folder = scenes.path();
    done(folder, &split("render plate.toml -q --spp 1 --size 8x8 -o a.exr"));
    for (command, words) in [
        (
            "render plate.toml --lines-width 3 -o b.exr",
            ["--lines-width", "--lines black"],
        ),
        ("render plate.toml --lines blak -o b.exr", ["blak", "off, or a colour"]),
        (
            "render plate.toml --lines off --lines-width 3 -o b.exr",
            ["--lines-width", "no lines are drawn"],
        ),
        (
            "render plate.toml --lines black --lines-width 0 -o b.exr",
            ["lines-width", "0.1"],
        ),
        (
            "render plate.toml --lines black --lines-angle nan -o b.exr",
            ["lines-angle", "nan"],
        ),
        ("develop a.exr --lines -o b.png", ["no channel `lines`", "--aov lines"]),
        (
            "develop a.exr --channel Z --lines -o b.png",
            ["--channel", "the picture only"],
        ),
    ] {
        let message = refused(folder, &split(command), 2);
        for word in words {
            assert!(message.contains(word), "{command}: {message}");
        }
    }
}
