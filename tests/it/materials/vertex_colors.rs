//! Vertex colours: interpolation against closed forms, spellings, and errors.

use crate::support::program::*;
use crate::support::*;
use embrasure::color::srgb;
use embrasure::integrator::{DirectLight, PathIntegrator, Strategy};
use embrasure::math::UVec2;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A triangle that fills the image. Each vertex has its numbers of `colors` after its position.
fn triangle(colors: [&str; 3]) -> String {
    let [a, b, c] = colors;
    format!("v -6 -4 0 {a}\nv 6 -4 0 {b}\nv 0 8 0 {c}\nf 1 2 3\n")
}

const SCENE: &str = "version = 1\n[camera]\nposition = [0, 0, 2]\nlook_at = [0, 0, 0]\nvertical_fov = 60\n\
    [image]\nwidth = 16\nheight = 12\n[render]\nsamples = 16\n[[object]]\nobj = \"a.obj\"\n\
    [[light]]\ntype = \"constant\"\nradiance = 1\n";

/// A folder with the OBJ file `text`.
fn scene(text: &str) -> TempDir {
    folder(&[("a.obj", text), ("s.toml", SCENE)])
}

/// Image of the OBJ file `text` with these flags, and the messages.
fn picture(text: &str, flags: &str) -> (Vec<u8>, String) {
    let folder = scene(text);
    picture_in(folder.path(), flags)
}

fn picture_in(folder: &Path, flags: &str) -> (Vec<u8>, String) {
    let output = done(folder, &joined(&["render", "s.toml", "-o", "t.png"], &split(flags)));
    (fs::read(folder.join("t.png")).unwrap(), words(&output))
}

#[test]
fn radiance_in_a_white_sky_interpolates_colors() {
    let folder = scene(&triangle(["1 0 0.5", "0.25 1 0", "0 0.75 1"]));
    let corners = [[1.0, 0.0, 0.5], [0.25, 1.0, 0.0], [0.0, 0.75, 1.0]].map(|color| color.map(srgb::decode));
    let size = UVec2::new(16, 12);
    let camera = pinhole([0.0, 0.0, 2.0].into(), [0.0; 3].into(), 60.0);
    let film = with_world(&load(&folder.path().join("s.toml")), camera, size, |world| {
        // Directions follow the cosine, so the value of each sample is the albedo.
        let path = PathIntegrator {
            strategy: Strategy {
                direct: DirectLight::None,
                ..Strategy::default()
            },
            ..path_tracer(world, Some(1))
        };
        film_by(&sobol(3), &path, size, 64)
    });
    let half = 2.0 * 30f64.to_radians().tan();
    for (pixel, sums) in film.pixels() {
        let x = half * (f64::from(pixel.x) + 0.5 - 8.0) / 6.0;
        let y = -half * (f64::from(pixel.y) + 0.5 - 6.0) / 6.0;
        let top = (y + 4.0) / 12.0;
        let right = ((x + 6.0) / 12.0) - 0.5 * top;
        for c in 0..3 {
            let [a, b, d] = corners.map(|color| f64::from(color[c]));
            let expected = (1.0 - right - top) * a + right * b + top * d;
            let got = sums.mean(c);
            assert!(
                (got - expected).abs() < 1e-3,
                "{pixel}, channel {c}: {got}, not {expected}"
            );
        }
    }
}

#[test]
fn spellings_of_a_color_give_one_image() {
    let (unit, words) = picture(&triangle(["1 0 0.2", "0.4 1 0", "0 0.6 1"]), "");
    assert!(words.contains("3 vertices have a colour"), "{words}");
    let (bytes, words) = picture(&triangle(["255 0 51", "102 255 0", "0 153 255"]), "");
    assert!(words.contains("from 0 to 255"), "{words}");
    assert!(bytes == unit);
    let (dark, words) = picture(&triangle(["2 0 0", "0 1 0", "0 0 2"]), "");
    assert!(words.contains("from 0 to 255"), "{words}");
    assert!(dark == picture(&triangle(["0.0078431 0 0", "0 0.0039216 0", "0 0 0.0078431"]), "").0);
    let mrgb = triangle([""; 3]).replace("f 1", "#MRGB ffff0033ff66ff00\n#MRGB ff0099ff\nf 1");
    assert!(picture(&mrgb, "").0 == unit);
    let opaque = triangle(["1 0 0.2 1", "0.4 1 0 1", "0 0.6 1 1"]);
    assert!(picture(&opaque, "").0 == unit);
    let [a, b] = [srgb::decode(0.2), srgb::decode(0.4)].map(|c| c.to_string());
    let linear = triangle([
        &format!("1 0 {a}"),
        &format!("{b} 1 0"),
        &format!("0 {} 1", srgb::decode(0.6)),
    ]);
    assert!(picture(&linear, "--vertex-color-space linear").0 == unit);
    assert!(picture(&linear, "").0 != unit);
}

/// Numbers of linear light above 1 are not codes of 8 bits.
#[test]
fn numbers_outside_their_range_are_clamped() {
    let unit = picture(&triangle(["1 0 0.2", "0.4 1 0", "0 0.6 1"]), "").0;
    for (colors, range) in [
        (["1.3 0 0.2", "0.4 1 -0.5", "0 0.6 1"], "0 to 1"),
        (["510 0 51", "102 255 -9", "0 153 255"], "0 to 255"),
    ] {
        let (clamped, words) = picture(&triangle(colors), "");
        let expected = format!("2 vertices have a colour with a number outside {range}");
        assert!(words.contains(&expected), "{words}");
        assert!(clamped == unit, "{range}");
    }
}

#[test]
fn textures_take_precedence_over_vertex_colors() {
    let colored = triangle(["1 0 0", "0 1 0", "0 0 1"]);
    let plain = picture(&triangle([""; 3]), "").0;
    assert!(picture(&colored, "").0 != plain);
    assert!(picture(&colored, "--vertex-colors off").0 == plain);

    let textured = |colors| {
        let text = triangle(colors).replace("f 1 2 3", "vt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3");
        let folder = scene(&format!("mtllib a.mtl\n{text}"));
        fs::write(folder.path().join("a.mtl"), "newmtl m\nKd 1 1 1\nmap_Kd a.png\n").unwrap();
        write_grey_png(&folder.path().join("a.png"), &[40, 200, 90, 255]);
        folder
    };
    let with = textured(["1 0 0", "0 1 0", "0 0 1"]);
    let texture_alone = picture_in(textured([""; 3]).path(), "").0;
    assert!(picture_in(with.path(), "").0 == texture_alone);
    assert!(picture_in(with.path(), "--vertex-colors on").0 != texture_alone);
}

#[test]
fn default_grey_of_exporters_is_ignored() {
    let grey = "0.752941 0.752941 0.752941";
    let folder = scene(&triangle([grey; 3]));
    let checked = printed(&done(folder.path(), &split("check s.toml")));
    assert!(checked.contains("0.753, which exporters write by default"), "{checked}");
    let (default, words) = picture(&triangle([grey; 3]), "");
    assert!(!words.contains("colour"), "{words}");
    assert!(default == picture(&triangle([""; 3]), "").0);
    assert!(default != picture(&triangle([grey; 3]), "--vertex-colors on").0);
    // If there are other greys, the colours are painted, so all colours are used.
    let painted = triangle([grey, grey, "0.2 0.2 0.2"]);
    assert!(default != picture(&painted, "").0);
}

#[test]
fn wrong_vertex_colors_are_reported() {
    let white = picture(&triangle(["1 0 0", "1 1 1", "1 1 1"]), "").0;
    let (some, words) = picture(&triangle(["1 0 0", "", ""]), "");
    assert!(
        words.contains("2 of 3 vertices have no colour; they are white"),
        "{words}"
    );
    assert!(some == white);
    for wrong in ["nan 0 0", "x 0 0", "1 inf 0 1", "1 0", "0.5 0 0 1 1", "1 0 0 1 0 0"] {
        let (picture, words) = picture(&triangle(["1 0 0", wrong, "1 1 1"]), "");
        assert!(words.contains("a.obj:2"), "{words}");
        assert!(words.contains("colour is not three or four finite numbers"), "{words}");
        assert!(picture == white);
    }
    let plain = picture(&triangle([""; 3]), "").0;
    let short = triangle([""; 3]).replace("f 1", "#MRGB ffff0033ff66ff00\nf 1");
    let (picture_of_short, words) = picture(&short, "");
    assert!(words.contains("2 colours for 3 vertices"), "{words}");
    assert!(picture_of_short == plain);
    let wrong = triangle([""; 3]).replace("f 1", "#MRGB ffff0033ff66ff0\nf 1");
    let (picture_of_wrong, words) = picture(&wrong, "");
    assert!(words.contains("group that is not 8 hexadecimal digits"), "{words}");
    assert!(picture_of_wrong == plain);
    // One number after the position is a weight, not a colour.
    let (weighted, words) = picture(&triangle(["1", "1", "0.5"]), "");
    assert!(!words.contains("colour"), "{words}");
    assert!(weighted == plain);
}

#[test]
fn vertex_opacities_transmit_light() {
    let folder = scene(&format!("mtllib a.mtl\nusemtl m\n{}", triangle(["0 0 0 0.25"; 3])));
    fs::write(folder.path().join("a.mtl"), "newmtl m\nKd 0 0 0\n").unwrap();
    done(folder.path(), &split("render s.toml --spp 1024 -q -o t.exr"));
    for channel in read_rgb(&folder.path().join("t.exr")) {
        let mean = channel.iter().sum::<f32>() / channel.len() as f32;
        assert!((mean - 0.75).abs() < 0.005, "{mean}");
    }
}

#[test]
fn paths_report_the_vertex_color() {
    let folder = scene(&triangle(["1 0 0"; 3]));
    let printed = printed(&done(folder.path(), &split("paths s.toml --pixel 8,6 --json")));
    assert!(printed.contains("vertex_color"), "{printed}");
}
