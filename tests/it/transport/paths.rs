//! `embrasure paths` and `render --pixel --json`: recorded paths are equal to the paths of a
//! render.

use crate::support::program::{done, folder, joined, json, refused, run, split};
use crate::support::read_channel;
use serde_json::Value;
use std::fs;
use std::path::Path;

/// A box without front: matte walls, a glossy wall, a mirror wall and a lamp.
const MTL: &str = "newmtl matte\nKd 0.6 0.5 0.4\nnewmtl glossy\nKd 0.2 0.2 0.3\nKs 0.4 0.4 0.4\nNs 30\nnewmtl mirror\nKd 0 0 0\nKs 0.9 0.9 0.9\nillum 3\n\
                   newmtl glass\nKd 0 0 0\nTf 0.9 0.9 0.9\nNi 1.5\nd 1\nillum 7\nnewmtl lamp\nKd 0 0 0\nKe 8 7 6\n";
const OBJ: &str = "mtllib a.mtl\nv -1 -1 1\nv 1 -1 1\nv 1 -1 -1\nv -1 -1 -1\nv -1 1 1\nv 1 1 1\nv 1 1 -1\nv -1 1 -1\n\
                   usemtl matte\nf 1 2 3 4\nf 5 8 7 6\nusemtl glossy\nf 4 3 7 8\nusemtl matte\nf 1 4 8 5\nusemtl mirror\nf 2 6 7 3\n\
                   v -0.4 0.98 0.4\nv 0.4 0.98 0.4\nv 0.4 0.98 -0.4\nv -0.4 0.98 -0.4\nusemtl lamp\nf 9 12 11 10\n";
const SCENE: &str = "version = 1\n[camera]\nposition = [0, 0, 3.4]\nlook_at = [0, 0, 0]\n[image]\nwidth = 24\nheight = 24\n[[object]]\nobj = 'a.obj'\n";

fn scene() -> tempfile::TempDir {
    folder(&[("a.mtl", MTL), ("a.obj", OBJ), ("s.toml", SCENE)])
}

fn color(value: &Value) -> [f64; 3] {
    [0, 1, 2].map(|c| value[c].as_f64().unwrap())
}

/// Colour of a pixel of a render with one sample.
fn rendered(folder: &Path, flags: &[&str], [x, y]: [usize; 2]) -> [f64; 3] {
    done(folder, &joined(&split("render s.toml -q --spp 1 -o r.exr"), flags));
    ["R", "G", "B"].map(|c| read_channel(&folder.join("r.exr"), c)[y * 24 + x].into())
}

fn assert_near(found: [f64; 3], expected: [f64; 3], what: &str) {
    for (found, expected) in found.into_iter().zip(expected) {
        let scale = expected.abs().max(1e-3);
        assert!(
            (found - expected).abs() <= 1e-4 * scale,
            "{what}: {found} for {expected}"
        );
    }
}

/// Integrators that estimate light, with flags that keep the test short.
const METHODS: [&str; 18] = [
    "path",
    "path --reuse none",
    "path --reuse none --light-samples 3 --filter mitchell",
    "naive",
    "direct",
    "one-sample",
    "area",
    "whitted",
    "distributed --branching 2 --tree-depth 3",
    "ao",
    "photon-map --photons 3000",
    "irradiance-cache --cache-rays 32",
    "light",
    "bdpt",
    "vcm --photons 500",
    "sppm --photons 2000",
    "mlt",
    "pssmlt",
];

/// For each integrator, the contributions of a record sum to the pixel of a render.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn contributions_sum_to_the_pixel() {
    let folder = scene();
    let pixel = [9, 19];
    for method in METHODS {
        let flags = joined(&["--integrator"], &split(method));
        let expected = rendered(folder.path(), &flags, pixel);
        let args = joined(&split("paths s.toml -q --spp 1 --pixel 9,19 --json"), &flags);
        let facts = json(&run(folder.path(), &args));
        let sample = &facts["samples"][0];
        assert_near(color(&sample["radiance"]), expected, method);
        assert_eq!(facts["integrator"].as_str(), split(method).first().copied());

        // The record is complete: the vertices of each contribution exist, and each surface vertex
        // has a material and a parent.
        let mut lit = 0;
        for trace in sample["traces"].as_array().unwrap() {
            let vertices = trace["vertices"].as_array().unwrap();
            for contribution in trace["contributions"].as_array().unwrap() {
                let on_path = contribution["path"].as_array().unwrap();
                assert!(
                    on_path.iter().all(|v| (v.as_u64().unwrap() as usize) < vertices.len()),
                    "{method}"
                );
                lit += 1;
            }
            for vertex in vertices.iter().filter(|vertex| vertex["on"] == "surface") {
                assert!(
                    vertex["material"].is_string() && vertex["parent"].is_u64(),
                    "{method}: {vertex}"
                );
            }
        }
        assert!(lit > 0 || expected == [0.0; 3], "{method}");
    }
}

/// The radius of a density estimate with k photons is the distance of the k-th photon. The estimate
/// counts the k − 1 nearer photons. The density hardly changes with k.
#[test]
fn density_estimates_use_the_photon_count() {
    let folder = folder(&[("a.txt", "")]);
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/ring-caustic.toml");
    let density = |count: f64| {
        let more = "--integrator photon-map --photons 300000 --size 96x72 --spp 1 --pixel 24,60 --json";
        let line = format!("paths {} -q {more} --photon-count {count}", scene.display());
        let facts = json(&run(folder.path(), &split(&line)));
        let traces = facts["samples"][0]["traces"].as_array().unwrap();
        let vertices = traces.iter().flat_map(|trace| trace["vertices"].as_array().unwrap());
        let on_paper = vertices.filter(|vertex| vertex["material"] == "paper");
        let photons: Vec<&Value> = on_paper.filter_map(|vertex| vertex["photons"].get(0)).collect();
        assert!(!photons.is_empty(), "{facts}");
        assert_eq!(photons[0]["count"].as_f64(), Some(count - 1.0));
        (count - 1.0) / photons[0]["radius"].as_f64().unwrap().powi(2)
    };
    let ratio = density(40.0) / density(10.0);
    assert!((0.4..2.5).contains(&ratio), "{ratio}");
}

/// A contribution is the product of the throughput of its vertex and of the recorded factors:
/// radiance, f cos θ, transmittance, 1 / density and MIS weight.
#[test]
fn vertex_factors_multiply_to_contributions() {
    let folder = scene();
    let mut samples = 0;
    for method in [
        "path --reuse none",
        "direct",
        "area",
        "whitted",
        "distributed --branching 2 --tree-depth 3",
    ] {
        for pixel in ["9,19", "4,12", "20,12", "12,12"] {
            let flags = joined(&["--integrator"], &split(method));
            let args = joined(
                &["paths", "s.toml", "--pixel", pixel, "--samples", "0..3", "--json"],
                &flags,
            );
            let facts = json(&run(folder.path(), &args));
            for sample in facts["samples"].as_array().unwrap() {
                let trace = &sample["traces"][0];
                let vertices = trace["vertices"].as_array().unwrap();
                let mut sum = [0.0; 3];
                let add = |sum: &mut [f64; 3], beta: [f64; 3], factor: [f64; 3], scale: f64| {
                    (0..3).for_each(|c| sum[c] += beta[c] * factor[c] * scale);
                };
                for vertex in vertices {
                    let beta = color(&vertex["beta"]);
                    for emission in vertex["emission"].as_array().into_iter().flatten() {
                        let weight = emission["mis_weight"].as_f64().unwrap();
                        add(&mut sum, beta, color(&emission["radiance"]), weight);
                    }
                    for light in vertex["light_samples"].as_array().into_iter().flatten() {
                        let number = |key: &str| light[key].as_f64().unwrap();
                        let [f, le, passed] = ["f_cos", "radiance", "transmittance"].map(|key| color(&light[key]));
                        let product = [0, 1, 2].map(|c| f[c] * le[c] * passed[c]);
                        let scale = number("mis_weight") / (number("probability") * number("pdf"));
                        add(&mut sum, beta, product, scale);
                        samples += 1;
                    }
                    // The throughput of the next vertex comes from one scattering record of its
                    // parent.
                    if let Some(parent) = vertex["parent"].as_u64() {
                        let parent = &vertices[parent as usize];
                        let ways = parent["scattering"].as_array().into_iter().flatten().map(|way| {
                            let (beta, weight) = (color(&parent["beta"]), color(&way["weight"]));
                            [0, 1, 2].map(|c| beta[c] * weight[c] * way["roulette"].as_f64().unwrap())
                        });
                        let is_near =
                            |way: [f64; 3]| (0..3).all(|c| (way[c] - beta[c]).abs() <= 1e-4 * beta[c].max(1e-3));
                        assert!(
                            parent["on"] == "camera" || ways.into_iter().any(is_near),
                            "{method}: {vertex}"
                        );
                    }
                }
                assert_near(sum, color(&trace["radiance"]), method);
            }
        }
    }
    assert!(samples > 100, "{samples}");
}

#[test]
fn paths_are_written_as_svg_obj_and_json() {
    let folder = scene();
    for method in ["path", "bdpt", "light", "sppm"] {
        let args = [
            "paths",
            "s.toml",
            "--pixel",
            "9,19",
            "--integrator",
            method,
            "--samples",
            "0..2",
        ];
        done(folder.path(), &joined(&args, &split("-o p.svg -o p.obj -o p.json")));
        let svg = fs::read_to_string(folder.path().join("p.svg")).unwrap();
        assert!(svg.contains("from the side") && svg.contains("sample 1: radiance") && !svg.contains("NaN"));
        // Lines of the OBJ file refer to existing vertices, so other programs can read the file.
        let obj = fs::read_to_string(folder.path().join("p.obj")).unwrap();
        let vertices = obj.lines().filter(|line| line.starts_with("v ")).count();
        let lines: Vec<&str> = obj.lines().filter(|line| line.starts_with("l ")).collect();
        let indices = lines
            .iter()
            .flat_map(|line| line.split(' ').skip(1))
            .map(|i| i.parse::<usize>().unwrap());
        assert!(!lines.is_empty() && indices.max() == Some(vertices), "{method}");
        let facts: Value = serde_json::from_str(&fs::read_to_string(folder.path().join("p.json")).unwrap()).unwrap();
        assert_eq!(facts["samples"].as_array().unwrap().len(), 2);
    }
}

#[test]
fn a_replayed_pixel_has_the_same_numbers() {
    let folder = scene();
    let of = |command: &str| json(&run(folder.path(), &split(command)));
    for method in ["path", "bdpt"] {
        let paths = of(&format!(
            "paths s.toml --pixel 9,19 --sample 2 --json --integrator {method}"
        ));
        let pixel = of(&format!(
            "render s.toml --pixel 9,19 --sample 2 --json --integrator {method}"
        ));
        assert_eq!(paths["samples"], pixel["samples"], "{method}");
    }
    let said = refused(folder.path(), &split("render s.toml --integrator bdpt --pixel 1,1"), 2);
    assert!(said.contains("add --json"), "{said}");
    let said = refused(folder.path(), &split("paths s.toml --pixel 24,0"), 2);
    assert!(said.contains("columns 0 to 23"), "{said}");
    let said = refused(folder.path(), &split("paths s.toml --pixel 1,1 -o p.png"), 2);
    assert!(said.contains(".obj"), "{said}");
}

/// A recorded light has the type of the light that emits.
#[test]
fn recorded_lights_have_their_type() {
    let folder = scene();
    for (light, kind) in [
        ("", "surface"),
        (
            "type = 'rectangle'\nposition = [0, 0.9, 0]\ndirection = [0, -1, 0]\nsize = [0.4, 0.4]\nradiance = 5",
            "surface",
        ),
        (
            "type = 'sphere'\nposition = [0, 0.6, 0]\nradius = 0.1\nradiance = 5",
            "surface",
        ),
        (
            "type = 'disk'\nposition = [0, 0.9, 0]\ndirection = [0, -1, 0]\nradius = 0.2\nradiance = 5",
            "surface",
        ),
        ("type = 'point'\nposition = [0, 0.6, 0]\nintensity = 1", "point"),
        (
            "type = 'spot'\nposition = [0, 0.6, 0]\ndirection = [0, -1, 0]\nangle = 60\nintensity = 1",
            "point",
        ),
        ("type = 'constant'\nradiance = 1", "background"),
        (
            "type = 'directional'\ndirection = [0, -1, -1]\nirradiance = 1",
            "background",
        ),
        (
            "type = 'directional'\ndirection = [0, -1, -1]\nirradiance = 1\nangle = 5",
            "background",
        ),
        ("type = 'sky'\nsun = [0, 45]", "background"),
    ] {
        // The lamp of the OBJ is off if another light is tested.
        let text = match light {
            "" => SCENE.to_string(),
            _ => format!("{SCENE}[patch.lamp]\nemission = [0, 0, 0]\n[[light]]\n{light}\n"),
        };
        fs::write(folder.path().join("l.toml"), text).unwrap();
        let args = split("paths l.toml -q --spp 1 --pixel 9,19 --json --reuse none");
        let facts = json(&run(folder.path(), &args));
        let vertices = facts["samples"][0]["traces"][0]["vertices"].as_array().unwrap();
        let found: Vec<&str> = vertices
            .iter()
            .flat_map(|vertex| vertex["light_samples"].as_array().into_iter().flatten())
            .filter_map(|sample| sample["light"]["type"].as_str())
            .collect();
        assert!(!found.is_empty(), "{light}: no light was sampled");
        assert!(found.iter().all(|found| *found == kind), "{light}: {found:?}");
    }
}
