//! `--cameras` and `--write-cameras`: renders with a written camera see the same points.

use super::calibrated::room;
use crate::support::program::*;
use crate::support::read_channel;
use std::path::Path;

/// Maximum distance between the points that a pixel sees in two renders.
const TOLERANCE: f32 = 1e-3;

fn points(file: &Path) -> Vec<f32> {
    let axes = ["P.X", "P.Y", "P.Z"].map(|name| read_channel(file, name));
    axes.concat()
}

#[test]
fn written_cameras_render_the_same_points() {
    let folder = room();
    for (index, flags) in [
        "--position 1,2,3 --look-at -2,1,-4 --up 0.1,1,0.2 --fov 70",
        "--orbit 30,20,5 --shift 0.1,-0.2",
        "--intrinsics 50,45,30,27 --distortion=-0.1,0.01,0.002,-0.001,0.003 --pose opencv:1,0,0,1,0,-1,0,2,0,0,-1,3",
        "--projection fisheye --fisheye-fov 170 --view front",
    ]
    .into_iter()
    .enumerate()
    {
        let name = format!("view {index}");
        let common = "render s.toml --aov P --quiet";
        for file in ["transforms.json", "sparse"] {
            let written = format!("{name}.exr");
            let writing = ["--write-cameras", file, "-o", &written];
            done(folder.path(), &[&split(common), &split(flags), &writing[..]].concat());
            let reading = ["--cameras", file, "--camera", &name, "-o", "again.exr"];
            done(folder.path(), &joined(&split(common), &reading));
            let [first, second] = [written.as_str(), "again.exr"].map(|file| points(&folder.path().join(file)));
            let off = first
                .iter()
                .zip(&second)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f32::max);
            assert!(off < TOLERANCE, "{flags}: {file}: points are {off} apart");
        }
    }
}

#[test]
fn cameras_of_files_set_the_size_of_the_picture() {
    let folder = room();
    let csv = "name,position.x,position.y,position.z,look_at,width,height\nleft,-1,0,5,\"0,0,0\",40,20\nright,1,0,5,\"0,0,0\",,\n";
    std::fs::write(folder.path().join("c.csv"), csv).unwrap();
    for (flags, samples) in [
        ("--camera left", 40 * 20),
        ("--camera right", 64 * 48),
        ("--camera left --size 8x4", 32),
    ] {
        let args = format!("render s.toml --cameras c.csv {flags} --quiet -o a.exr");
        done(folder.path(), &split(&args));
        assert_eq!(
            read_channel(&folder.path().join("a.exr"), "R").len(),
            samples,
            "{flags}"
        );
    }
    for (flags, expected) in [
        ("--cameras c.csv", "choose one with --camera: left, right"),
        ("--cameras c.csv --camera lft", "did you mean left?"),
        ("--cameras c.csv --camera left --fov 30", "--fov"),
        ("--camera left", "--cameras"),
        ("--cameras nothing.json", "nothing.json"),
        ("--projection orthographic --write-cameras a.json", "`orthographic`"),
        ("--write-cameras a.txt", "give a .json file"),
        ("--cameras c.csv --camera left -o c.csv", "c.csv"),
    ] {
        let args = format!("render s.toml {flags} --quiet");
        let out = run(folder.path(), &split(&args));
        assert_ne!(code(&out), 0, "{flags}");
        assert!(words(&out).contains(expected), "{flags}: {}", words(&out));
    }
}

/// A camera file may lack a lens shift, as glTF files always do. `--shift` adds the shift to the
/// camera of the file.
#[test]
fn shift_is_added_to_cameras_of_files() {
    let folder = room();
    let csv = "name,position.x,position.y,position.z,look_at\nfront,0,0,5,\"0,0,0\"\n";
    std::fs::write(folder.path().join("c.csv"), csv).unwrap();
    let flags = split("render s.toml --aov P --quiet --shift 0.2,-0.1");
    done(folder.path(), &joined(&flags, &split("--cameras c.csv -o a.exr")));
    done(
        folder.path(),
        &joined(&flags, &split("--position 0,0,5 --look-at 0,0,0 -o b.exr")),
    );
    let [a, b] = ["a.exr", "b.exr"].map(|name| points(&folder.path().join(name)));
    assert!(a == b);
}
