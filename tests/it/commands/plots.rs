//! Plots of samplers, lobes and surfaces: `embrasure points`, `embrasure explain` and the debug
//! views.

use crate::support::program::{done, folder, json, printed, refused, run, split};
use crate::support::read_rgb;
use embrasure::sampler::SamplerKind;
use std::fs;
use std::path::Path;

/// Asserts that the elements of an SVG image are well-formed, and that it has no invalid number.
fn assert_svg(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    assert!(
        text.starts_with("<svg ") && text.trim_end().ends_with("</svg>"),
        "{}",
        path.display()
    );
    for wrong in ["NaN", "inf"] {
        assert!(!text.contains(wrong), "{}: {wrong}", path.display());
    }
    let mut open = Vec::new();
    for tag in text.split('<').skip(1) {
        let (tag, _) = tag.split_once('>').unwrap();
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "{}", path.display());
        } else if !tag.ends_with('/') {
            open.push(tag.split_whitespace().next().unwrap());
        }
    }
    assert!(open.is_empty(), "{open:?}");
    text
}

#[test]
fn points_of_all_samplers_are_shown() {
    let folder = folder(&[]);
    let directions = ["fibonacci", "perturbed-qmc"];
    let samplers = SamplerKind::NAMES.iter().map(|(name, _)| *name);
    for name in samplers.chain(directions) {
        let out = run(folder.path(), &["points", name, "-n", "64", "--json", "-o", "p.svg"]);
        let facts = json(&out);
        assert_eq!(
            (facts["sampler"].as_str(), facts["points"].as_u64()),
            (Some(name), Some(64))
        );
        let projections = facts["projections"].as_array().unwrap();
        assert_eq!(projections.len(), if directions.contains(&name) { 7 } else { 12 });
        let independent = facts["independent"]["star_discrepancy"].as_f64().unwrap();
        for projection in projections {
            let points = projection["points"].as_array().unwrap();
            let half = projection["name"].as_str().unwrap().contains("half");
            assert!(points.len() == 64 || half, "{name}: {projection}");
            if let Some(star) = projection["star_discrepancy"].as_f64() {
                assert!(star > 0.5 / 64.0 && star < 3.0 * independent, "{name}: {star}");
            }
        }
        assert_eq!(facts["convergence"].as_array().unwrap().len(), 4);
        assert_svg(&folder.path().join("p.svg"));
    }
    // The plots of the upper and of the lower half of the sphere together have all points.
    let facts = json(&run(folder.path(), &split("points fibonacci -n 128 --json")));
    let count = |name: &str| {
        let projections = facts["projections"].as_array().unwrap().iter();
        let half = projections
            .filter(|p| p["name"] == name)
            .map(|p| p["points"].as_array().unwrap().len());
        half.sum::<usize>()
    };
    assert_eq!(count("sphere, upper half") + count("sphere, lower half"), 128);
    let text = printed(&done(folder.path(), &split("points sobol -n 256")));
    assert!(
        text.contains("star discrepancy") && text.contains("falls as N^-"),
        "{text}"
    );
}

#[test]
fn invalid_points_arguments_are_errors() {
    let folder = folder(&[]);
    let said = refused(folder.path(), &["points", "sobel"], 2);
    assert!(said.contains("did you mean sobol?"), "{said}");
    let said = refused(folder.path(), &["points", "sobol", "-n", "20000"], 2);
    assert!(said.contains("16384"), "{said}");
    let said = refused(folder.path(), &["points", "sobol", "-o", "p.png"], 2);
    assert!(said.contains(".svg"), "{said}");
}

const MATERIALS: &str = "newmtl glazed\nKd 0.6 0.3 0.1\nPr 0.3\nPm 0\nnewmtl glass\nKd 0 0 0\nTf 1 1 1\nNi 1.5\nd 1\nillum 7\nnewmtl plain\nKd 0.5 0.5 0.5\n";
const TRIANGLES: &str =
    "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl glazed\nf 1 2 3\nusemtl glass\nf 1 2 3\nusemtl plain\nf 1 2 3\n";

#[test]
fn lobes_are_plotted_and_printed() {
    let folder = folder(&[("a.mtl", MATERIALS), ("a.obj", TRIANGLES)]);
    for (name, is_delta) in [("glazed", false), ("glass", true), ("plain", false)] {
        let out = run(
            folder.path(),
            &["explain", "a.obj", name, "--json", "--plots", "-o", "l.svg"],
        );
        let facts = json(&out);
        let picture = assert_svg(&folder.path().join("l.svg"));
        assert!(picture.contains("80°"));
        let profiles = facts["profiles"].as_array().unwrap();
        assert_eq!(profiles.len(), 4);
        for profile in profiles {
            let numbers = |key: &str| profile["total"][key].as_array().unwrap().len();
            assert_eq!([numbers("f_cos"), numbers("pdf")], [361; 2]);
            assert_eq!(numbers("directions") > 0, is_delta);
        }
        // At no angle more energy is scattered than arrives, and values of lobes are numbers.
        for entry in facts["albedo_by_angle"].as_array().unwrap() {
            let albedo = entry["albedo"].as_array().unwrap();
            assert!(
                albedo.iter().all(|a| (0.0..=1.004).contains(&a.as_f64().unwrap())),
                "{name}: {entry}"
            );
        }
        assert!(
            facts["lobes"][0]["values"]
                .as_object()
                .is_some_and(|values| !values.is_empty())
        );
        let text = printed(&done(folder.path(), &["explain", "a.obj", name, "--plots"]));
        assert!(text.contains("energy        kept"), "{text}");
        let braille = text.chars().filter(|c| ('\u{2801}'..='\u{28ff}').contains(c)).count();
        assert!(braille > 20, "{text}");
    }
    // On a matte surface, f cos θ is ρ/π cos θ, and the density of samples is cos θ/π.
    let facts = json(&run(folder.path(), &["explain", "a.obj", "plain", "--json", "--plots"]));
    let total = &facts["profiles"][2]["total"];
    for (i, degrees) in [(180, 0.0f64), (240, 60.0), (100, -80.0)] {
        let cos = degrees.to_radians().cos() / std::f64::consts::PI;
        assert!((total["pdf"][i].as_f64().unwrap() - cos).abs() < 1e-6);
        assert!((total["f_cos"][i][0].as_f64().unwrap() - 0.5 * cos).abs() < 1e-6);
    }
    assert_eq!(
        facts["lobes"][0]["values"]["albedo"],
        serde_json::json!([0.5, 0.5, 0.5])
    );
}

/// A square that fills the image, with texture coordinates from 0 to 2. One of its two triangles
/// faces away from the camera.
const SQUARE: &str = "mtllib a.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 2 0\nvt 2 2\nvt 0 2\nusemtl plain\nf 1/1 2/2 3/3\nf 1/1 4/4 3/3\n";
const SCENE: &str = "version = 1\n[camera]\nposition = [0, 0, 1]\nlook_at = [0, 0, 0]\nvertical_fov = 90\n[image]\nwidth = 32\nheight = 32\n\
                     [render]\nsamples = 16\nintegrator = 'debug'\n[[object]]\nobj = 'a.obj'\n[[light]]\ntype = 'point'\nposition = [0, 0, 0.5]\nintensity = [1, 1, 1]\n\
                     [[light]]\ntype = 'point'\nposition = [0, 0, -0.5]\nintensity = [1, 1, 1]\n";

#[test]
fn debug_views_show_their_quantity() {
    let folder = folder(&[("a.mtl", MATERIALS), ("a.obj", SQUARE), ("s.toml", SCENE)]);
    let view = |name: &str| {
        done(
            folder.path(),
            &["render", "s.toml", "--debug-view", name, "-o", "v.exr"],
        );
        read_rgb(&folder.path().join("v.exr"))
    };
    let near = |a: f32, b: f32| (a - b).abs() < 0.02;
    // `at` is the index of a pixel by column and row from the top. Texture coordinates run from 0
    // to 2 over 32 pixels.
    let at = |column: usize, row: usize| row * 32 + column;
    let place = |i: usize| (i as f32 + 0.5) / 16.0;
    let uv = view("uv");
    for (column, row) in [(3, 4), (20, 9), (10, 28)] {
        let expected = [place(column).fract(), (2.0 - place(row)).fract(), 0.0];
        let found = [0, 1, 2].map(|c| uv[c][at(column, row)]);
        assert!((0..3).all(|c| near(found[c], expected[c])), "{found:?} {expected:?}");
    }
    // The lower right half is hit on its front, the other half on its back.
    let facing = view("facing");
    assert!(facing[2][at(28, 20)] > facing[0][at(28, 20)] && facing[0][at(4, 10)] > facing[2][at(4, 10)]);
    let wireframe = view("wireframe");
    let diagonal: f32 = (2..30).map(|i| wireframe[0][at(i, 31 - i)]).sum::<f32>() / 28.0;
    assert!(diagonal < 0.5 * wireframe[0][at(28, 20)], "{diagonal}");
    assert!(view("albedo").iter().all(|c| near(c[at(9, 9)], 0.5)));
    let material = view("material");
    assert_eq!(material[0][at(3, 4)], material[0][at(28, 20)]);
    let ids = view("ids");
    assert_ne!(ids[0][at(4, 10)], ids[0][at(28, 20)]);
    // One of the two lights shines on the visible side. The value of the pixel is ln 2 / ln 3 on
    // the colour map magma. The cost of a pixel is at least one ray, even if the ray hits nothing.
    let lights = view("light-count");
    assert!(
        lights[0][at(9, 9)] > 0.3 && near(lights[0][at(9, 9)], lights[0][at(20, 25)]),
        "{}",
        lights[0][at(9, 9)]
    );
    let cost = view("ray-cost");
    assert!(cost[0].iter().all(|v| *v > 0.0));
    let barycentrics = view("barycentrics");
    assert!(
        barycentrics[0]
            .iter()
            .zip(&barycentrics[1])
            .all(|(b1, b2)| b1 + b2 <= 1.001)
    );
}
