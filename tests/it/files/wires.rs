//! Lines and points of OBJ files, rendered as tubes and spheres.

use crate::support::program::*;
use crate::support::{matte, read_channel};

const DRAWING: &str = "v -1 0 0\nv 1 0 0\nv 0 1 0\no bar\nl 1 2\no dot\np 3\n";
const SCENE: &str = "version = 1\n[camera]\nposition = [0, 0, 10]\nlook_at = [0, 0, 0]\nprojection = \"orthographic\"\northo_height = 4\n\
    [image]\nwidth = 64\nheight = 64\nbackground = \"transparent\"\n[render]\nsamples = 64\n[[object]]\nobj = \"a.obj\"\n[[light]]\ntype = \"constant\"\nradiance = 1\n";

/// The image shows the silhouettes of a capsule and a disk, which are separate parts.
#[test]
fn lines_and_points_cover_their_shapes() {
    let with = folder(&[("a.obj", DRAWING), ("s.toml", SCENE)]);
    let render = [
        "render",
        "s.toml",
        "-q",
        "--line-width",
        "0.5",
        "--aov",
        "cryptomatte",
        "-o",
        "t.exr",
    ];
    done(with.path(), &render);
    let path = with.path().join("t.exr");
    let pixel = 4.0f32 * 4.0 / (64.0 * 64.0);
    let area = |coverage: Vec<f32>| coverage.iter().sum::<f32>() * pixel;
    let disk = std::f32::consts::PI * 0.25 * 0.25;
    let bar = area(matte(&path, "CryptoPart", "bar"));
    let dot = area(matte(&path, "CryptoPart", "dot"));
    assert!((bar / (disk + 1.0) - 1.0).abs() < 0.02, "{bar}");
    assert!((dot / disk - 1.0).abs() < 0.04, "{dot}");
    let whole = area(read_channel(&path, "A"));
    assert!((whole - bar - dot).abs() < 1e-3, "{whole}");
}

/// Without `--line-width`, a note has the number of lines and points, and the name of the flag.
#[test]
fn skipped_lines_and_points_are_counted() {
    let mesh = format!("{DRAWING}f 1 2 3\n");
    let with = folder(&[("a.obj", &mesh), ("s.toml", SCENE)]);
    let note = |flags: &str| printed(&run(with.path(), &joined(&["check", "s.toml"], &split(flags))));
    let told = note("");
    assert!(
        told.contains("1 line (`l`) and 1 point (`p`)") && told.contains("--line-width W"),
        "{told}"
    );
    assert!(!note("--line-width 0.1").contains("skipped-elements"));
    let alone = folder(&[("a.obj", DRAWING), ("s.toml", SCENE)]);
    let error = refused(alone.path(), &["render", "s.toml"], 1);
    assert!(error.contains("--line-width"), "{error}");
    let error = refused(with.path(), &["render", "s.toml", "--line-width", "0"], 2);
    assert!(error.contains("above 0"), "{error}");
}
