//! Plans, elevations and images to scale.

use crate::support::program::*;
use crate::support::read_channel;
use exr::prelude::{AttributeValue, LayerAttributes, Text, read_first_flat_layer_from_file};
use std::path::Path;
use tempfile::TempDir;

const CENTERS: &str = "--spp 1 --denoise=off --aov P --no-ground --filter box --filter-radius 1e-5";

/// Vertices and faces of an axis-aligned box.
fn cuboid(min: [f64; 3], max: [f64; 3], first: usize) -> String {
    let mut obj = String::new();
    for i in 0..8 {
        let side = |bit: usize| if i >> bit & 1 == 0 { min[bit] } else { max[bit] };
        obj += &format!("v {} {} {}\n", side(0), side(1), side(2));
    }
    for quad in [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ] {
        let [a, b, c, d] = quad.map(|i: usize| i + first);
        obj += &format!("f {a} {b} {c} {d}\n");
    }
    obj
}

/// A wall of 3.000 × 2.500 × 0.240 m and a table beside it.
fn walls() -> TempDir {
    let wall = cuboid([0.0, 0.0, 0.0], [3.0, 2.5, 0.24], 1);
    let table = cuboid([0.5, 0.0, 1.0], [1.5, 0.8, 1.6], 9);
    folder(&[("a.obj", &format!("o Wall\n{wall}o Table\n{table}"))])
}

fn attributes(path: &Path) -> (LayerAttributes, [usize; 2]) {
    let layer = read_first_flat_layer_from_file(path).unwrap().layer_data;
    (layer.attributes, [layer.size.0, layer.size.1])
}

/// Number of columns and rows between the first and the last visible pixel.
fn extent(seen: &[bool], width: usize) -> [usize; 2] {
    let pixels = || (0..seen.len()).filter(|&i| seen[i]);
    let span = |values: Vec<usize>| values.iter().max().unwrap() - values.iter().min().unwrap() + 1;
    [
        span(pixels().map(|i| i % width).collect()),
        span(pixels().map(|i| i / width).collect()),
    ]
}

#[test]
fn wall_at_scale_has_its_size_in_pixels() {
    let folder = walls();
    let args = format!("render a.obj -q -o t.exr -o t.png --elevation front --up 0,1,0 --scale 1:50 {CENTERS}");
    done(folder.path(), &split(&args));
    let file = folder.path().join("t.exr");
    let (attributes, [width, height]) = attributes(&file);
    let depth = read_channel(&file, "N.Z");
    let seen: Vec<bool> = depth.iter().map(|&z| z != 0.0).collect();
    let [columns, rows] = extent(&seen, width);
    let pixels = |metres: f64| metres / 50.0 / 0.0254 * 300.0;
    assert!((columns as f64 - pixels(3.0)).abs() <= 1.0, "{columns}");
    assert!((rows as f64 - pixels(2.5)).abs() <= 1.0, "{rows}");
    // Margins of 2 % of the larger side
    assert!((width as f64 - pixels(3.0 * 1.04)).abs() <= 1.0 && (height as f64 - pixels(2.5 + 0.12)).abs() <= 1.0);
    assert_eq!(attributes.horizontal_density, Some(300.0));
    let scale = attributes.other.get(&Text::from("embrasure.scale"));
    assert!(matches!(scale, Some(AttributeValue::Text(text)) if text.eq("1:50")));
    let reader = png::Decoder::new(std::io::BufReader::new(
        std::fs::File::open(folder.path().join("t.png")).unwrap(),
    ));
    let density = reader.read_info().unwrap().info().pixel_dims.unwrap();
    assert_eq!(
        (density.xppu, density.yppu, density.unit),
        (11811, 11811, png::Unit::Meter)
    );
}

/// The unit of a file changes the length of a wall on paper. The program prints scale, paper and
/// unit.
#[test]
fn units_change_the_size_on_paper() {
    let folder = walls();
    for (unit, metres, words) in [
        ("--unit cm", 0.01, "a unit of the scene is 0.01 m"),
        ("--unit in", 0.0254, "a unit of the scene is 0.0254 m"),
    ] {
        let args = format!("render a.obj -o t.exr --elevation front --up 0,1,0 --scale 1:1 --dpi 127 {unit} {CENTERS}");
        let printed = done(folder.path(), &split(&args));
        let said = String::from_utf8(printed.stderr).unwrap();
        let file = folder.path().join("t.exr");
        let (_, [width, _]) = attributes(&file);
        let seen: Vec<bool> = read_channel(&file, "N.Z").iter().map(|&z| z != 0.0).collect();
        let [columns, _] = extent(&seen, width);
        let pixels = 3.0 * metres / 0.0254 * 127.0;
        assert!((columns as f64 - pixels).abs() <= 1.0, "{unit}: {columns}");
        let paper = (25.4 * width as f64 / 127.0).round();
        assert!(said.contains(words), "{said}");
        assert!(
            said.contains(&format!("scale: 1:1 at 127 pixels per inch, on {paper} x ")),
            "{said}"
        );
    }
}

/// A plan shows the scene from above, with the front at the bottom. The part above the height is
/// cut off.
#[test]
fn plans_show_the_scene_below_their_height() {
    let folder = walls();
    for (height, top) in [(1.2, 1.2), (0.5, 0.5)] {
        let args = format!("render a.obj -q -o t.exr --plan {height} --scale 1:20 --dpi 100 {CENTERS}");
        done(folder.path(), &split(&args));
        let file = folder.path().join("t.exr");
        let (_, [width, _]) = attributes(&file);
        let [x, y, z] = ["P.X", "P.Y", "P.Z"].map(|name| read_channel(&file, name));
        let normal = read_channel(&file, "N.Y");
        let is_wall = |i: usize| normal[i] != 0.0 && z[i] < 0.5;
        let seen: Vec<bool> = (0..x.len()).map(is_wall).collect();
        let [columns, rows] = extent(&seen, width);
        let pixels = |metres: f64| metres / 20.0 / 0.0254 * 100.0;
        assert!((columns as f64 - pixels(3.0)).abs() <= 1.0, "{columns}");
        assert!((rows as f64 - pixels(0.24)).abs() <= 1.0, "{rows}");
        let highest = y.iter().fold(f32::NEG_INFINITY, |max, &y| max.max(y));
        assert!((highest - top).abs() < 1e-5, "{highest}");
        // x is to the right, and the front is at the bottom
        let first = seen.iter().position(|&seen| seen).unwrap();
        let last = (0..x.len()).rposition(|i| normal[i] != 0.0).unwrap();
        assert!(x[first] < x[first + 5] && z[last] > 1.5, "{} {}", x[first], z[last]);
    }
}

#[test]
fn scale_sets_ortho_height_or_image_size() {
    let folder = walls();
    let camera = "--projection orthographic --position 1,1,9 --look-at 1,1,0";
    for (flags, size) in [
        // A height of 2 m at the scale 0.02 is 40 mm, which are 157.48 pixels at 100 dpi.
        ("--ortho-height 2 --size 200x100", [314, 157]),
        ("--size 120x90", [120, 90]),
    ] {
        let args = format!("render a.obj -q -o t.exr --scale 1:50 --dpi 100 {camera} {flags} {CENTERS}");
        done(folder.path(), &split(&args));
        let file = folder.path().join("t.exr");
        assert_eq!(attributes(&file).1, size, "{flags}");
        let x = read_channel(&file, "P.X");
        let row = size[1] / 2 * size[0] + size[0] / 2;
        let step = f64::from(x[row + 1] - x[row]);
        assert!((step - 50.0 * 0.0254 / 100.0).abs() < 1e-4, "{flags}: {step}");
    }
}

/// A page has the scale of the drawing, and the drawing in its middle.
#[test]
fn drawings_are_in_the_middle_of_a_page() {
    let folder = walls();
    let at = folder.path();
    let mask = |flags: &str| {
        let flags = format!("render a.obj -q --elevation front --scale 1:50 --dpi 40 {CENTERS} {flags} -o t.exr");
        done(at, &split(&flags));
        let path = at.join("t.exr");
        let size = read_first_flat_layer_from_file(&path).unwrap().layer_data.size;
        let hit: Vec<bool> = read_channel(&path, "Z").iter().map(|z| *z < 1e9).collect();
        (hit, [size.0, size.1])
    };
    let (drawing, [width, height]) = mask("");
    // Even differences leave whole pixels on both sides.
    let (page, [page_width, _]) = mask(&format!("--size {}x{}", width + 20, height + 34));
    let shifted = |i: usize| page[(i / width + 17) * page_width + i % width + 10];
    let count = |mask: &[bool]| mask.iter().filter(|hit| **hit).count();
    // Edges may lie on pixel centres, where rounding decides.
    let differing = (0..drawing.len()).filter(|&i| drawing[i] != shifted(i)).count();
    assert!(50 * differing < count(&drawing), "{differing} of {}", count(&drawing));
    assert!(50 * count(&page).abs_diff(count(&drawing)) < count(&drawing));
}

#[test]
fn impossible_drawings_are_errors() {
    let folder = walls();
    for (flags, parts) in [
        ("--scale 50", ["--scale 50", "1:50"]),
        (
            "--scale 1:50 --position 1,1,9 --look-at 1,1,0",
            ["1:50", "orthographic"],
        ),
        ("--elevation front --projection panorama", ["front", "orthographic"]),
        (
            "--elevation front --scale 1:50 --size 9x9",
            ["page has 9 x 9", "--size"],
        ),
        ("--elevation front --scale 1000:1", ["1000:1", "smaller scale"]),
        ("--elevation front --view top", ["--elevation", "--view"]),
        ("--elevation side", ["side", "front"]),
        ("--plan -1", ["-1", "height"]),
    ] {
        let out = run(
            folder.path(),
            &split(&format!("render a.obj -q --spp 1 -o t.exr {flags}")),
        );
        let words = words(&out);
        assert!(
            code(&out) != 0 && parts.iter().all(|part| words.contains(part)),
            "{flags}: {words}"
        );
    }
}
