//! The JSON Schema of scene files agrees with the program: existing scene files follow it, and a
//! changed file is refused by both or by neither.
//!
//! Crates for schema validation have some fifty dependencies. The few keywords of this schema are
//! evaluated here; any other keyword is an error.

use crate::support::program::{done, folder, printed};
use embrasure::{SceneFile, Session, Settings};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// The schema printed by the program.
fn schema() -> Value {
    let here = folder(&[]);
    let text = printed(&done(here.path(), &["help", "schema"]));
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/scene.schema.json");
    assert!(
        text == fs::read_to_string(kept).unwrap(),
        "docs/scene.schema.json is another one"
    );
    serde_json::from_str(&text).unwrap()
}

/// First place where `value` violates `schema` (draft 7), if any.
fn violation(schema: &Value, value: &Value, path: &str) -> Option<String> {
    let Some(schema) = schema.as_object() else {
        let is_false = !schema.as_bool().expect("a schema is an object, true or false");
        return is_false.then(|| format!("{path}: nothing may be here"));
    };
    let number = value.as_f64().filter(|_| value.is_number());
    let (array, object) = (value.as_array(), value.as_object());
    let follows = |schema: &Value| violation(schema, value, path).is_none();
    schema.iter().find_map(|(keyword, rule)| {
        let fails = |fails: bool| fails.then(|| format!("{path}: {keyword} {rule}"));
        let bound = || rule.as_f64().unwrap();
        let size = || rule.as_u64().unwrap() as usize;
        match keyword.as_str() {
            "$schema" | "title" | "description" | "default" => None,
            "type" => fails(!match rule.as_str().unwrap() {
                "object" => object.is_some(),
                "array" => array.is_some(),
                "string" => value.is_string(),
                "boolean" => value.is_boolean(),
                "number" => number.is_some(),
                "integer" => number.is_some_and(|n| n.fract() == 0.0),
                other => panic!("type {other}"),
            }),
            // 1 and 1.0 are the same number.
            "enum" => fails(
                !rule
                    .as_array()
                    .unwrap()
                    .iter()
                    .any(|item| item == value || (number.is_some() && item.as_f64() == number)),
            ),
            "minimum" => fails(number.is_some_and(|n| n < bound())),
            "maximum" => fails(number.is_some_and(|n| n > bound())),
            "exclusiveMinimum" => fails(number.is_some_and(|n| n <= bound())),
            "exclusiveMaximum" => fails(number.is_some_and(|n| n >= bound())),
            "pattern" => {
                let pattern = regex::Regex::new(rule.as_str().unwrap()).unwrap();
                fails(value.as_str().is_some_and(|text| !pattern.is_match(text)))
            }
            "minItems" => fails(array.is_some_and(|items| items.len() < size())),
            "maxItems" => fails(array.is_some_and(|items| items.len() > size())),
            "items" => array?.iter().enumerate().find_map(|(i, item)| {
                let of_item = rule.as_array().map_or(Some(rule), |rules| rules.get(i));
                violation(of_item?, item, &format!("{path}[{i}]"))
            }),
            "additionalItems" => {
                let named = schema["items"].as_array().unwrap().len();
                fails(rule == false && array.is_some_and(|items| items.len() > named))
            }
            "required" => {
                let missing = |key: &&Value| object.is_some_and(|table| !table.contains_key(key.as_str().unwrap()));
                let key = rule.as_array().unwrap().iter().find(missing)?;
                Some(format!("{path}: no {key}"))
            }
            "properties" => object?
                .iter()
                .find_map(|(key, item)| violation(rule.get(key)?, item, &format!("{path}.{key}"))),
            "additionalProperties" => object?.iter().find_map(|(key, item)| {
                let is_named = schema
                    .get("properties")
                    .is_some_and(|properties| properties.get(key).is_some());
                if is_named {
                    None
                } else {
                    violation(rule, item, &format!("{path}.{key}"))
                }
            }),
            "allOf" => rule
                .as_array()
                .unwrap()
                .iter()
                .find_map(|rule| violation(rule, value, path)),
            "anyOf" => fails(!rule.as_array().unwrap().iter().any(follows)),
            "oneOf" => fails(rule.as_array().unwrap().iter().filter(|rule| follows(rule)).count() != 1),
            "not" => fails(follows(rule)),
            "if" => match follows(rule) {
                true => violation(&schema["then"], value, path),
                false => None,
            },
            "then" | "definitions" => None,
            "$ref" => {
                static ROOT: OnceLock<Value> = OnceLock::new();
                let root = ROOT.get_or_init(|| serde_json::from_str(&embrasure::scene_file::schema_text()).unwrap());
                let place = rule.as_str().unwrap().trim_start_matches('#');
                violation(root.pointer(place).unwrap(), value, path)
            }
            other => panic!("the keyword {other} is not evaluated here"),
        }
    })
}

/// First place where the scene file violates the schema, if any. A text that is not TOML also
/// violates the schema.
fn fault_by_schema(schema: &Value, text: &str) -> Option<String> {
    match toml::from_str::<Value>(text) {
        Ok(value) => violation(schema, &value, "scene"),
        Err(error) => Some(error.to_string()),
    }
}

/// Error of the program for the scene file, if any.
fn fault_by_program(path: &Path) -> Option<String> {
    let file = SceneFile::load(path).map_err(|error| error.to_string());
    let loaded = file.and_then(|file| {
        let mut settings = Settings::of(&file);
        settings.threads = 1;
        Session::load(&file, settings, &())
            .map(drop)
            .map_err(|error| error.to_string())
    });
    loaded.err()
}

/// All files below `folder` with this extension.
fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let below = entries.flat_map(|path| match path.is_dir() {
        true => files(&path, extension),
        false => vec![path],
    });
    below
        .filter(|path| path.extension().is_some_and(|found| found == extension))
        .collect()
}

#[test]
fn scene_files_follow_the_schema() {
    let schema = schema();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut count = 0;
    let mut follows = |what: &str, text: &str| {
        assert_eq!(fault_by_schema(&schema, text), None, "{what}");
        count += 1;
    };
    for folder in ["scenes", "docs/gallery"] {
        for path in files(&root.join(folder), "toml") {
            follows(&path.display().to_string(), &fs::read_to_string(&path).unwrap());
        }
    }
    // Scene files of the guide, and parts of them
    for path in files(&root.join("docs"), "md") {
        let page = fs::read_to_string(&path).unwrap();
        for block in page.split("\n```toml\n").skip(1) {
            let block = block.split("\n```").next().unwrap();
            let mut text = String::from(block);
            if !text.contains("version =") {
                text = format!("version = 1\n{text}");
            }
            if !text.contains("[[object]]") {
                text += "\n[[object]]\nobj = 'a.obj'\n";
            }
            // Keys without a section are skipped: their section is in the text of the page.
            if block.starts_with('[') || block.contains("version =") {
                follows(&format!("{}: {block}", path.display()), &text);
            }
        }
    }
    assert!(count > 25, "{count} scene files");
    // Check files that the program writes
    let here = folder(&[("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl x\nf 1 2 3\n")]);
    done(here.path(), &["init", "a.obj", "-o", "a.toml"]);
    done(
        here.path(),
        &[
            "render",
            "a.obj",
            "-q",
            "--spp",
            "1",
            "--size",
            "4x4",
            "--dump-scene",
            "b.toml",
            "-o",
            "b.exr",
        ],
    );
    for name in ["a.toml", "b.toml"] {
        let text = fs::read_to_string(here.path().join(name)).unwrap();
        assert_eq!(fault_by_schema(&schema, &text), None, "{name}");
    }
}

/// A scene with a section of each kind.
const SCENE: &str = "\
version = 1
[camera]
position = [0, 1, 4]
look_at = [0, 0.3, 0]
[image]
width = 40
height = 24
[render]
samples = 4
[[object]]
obj = \"a.obj\"
[material.floor]
diffuse = [0.5, 0.5, 0.5]
[patch.\"fl*\"]
opacity = 1
[[light]]
type = \"point\"
position = [0, 2, 0]
intensity = [1, 1, 1]
[ground]
albedo = 0.5
[[light_group]]
name = \"lamps\"
materials = [\"lamp\"]
";

/// Sections of [`SCENE`], each with lines for this section. Each line replaces the line of its key.
/// A line without a value removes the key.
const CHANGES: &[(&str, &[&str])] = &[
    (
        "",
        &[
            "version = 2",
            "version = '1'",
            "version = 1.5",
            "version = 0",
            "version",
            "name = 'x'",
            "samples = 4",
            "object = 1",
        ],
    ),
    (
        "[camera]",
        &[
            "postion = [0, 1, 4]",
            "view = 'front'",
            "orbit = [30, 20]",
            "position = [0, 1]",
            "position = [0, 1, 'a']",
            "position = [0, 1, 4, 3]",
            "position = 'here'",
            "position = 1",
            "look_at = 5",
            "look_at = [0, 0.3]",
            "up = true",
            "up = [0, 0, 1]",
            "vertical_fov = 0",
            "vertical_fov = 180",
            "vertical_fov = -5",
            "vertical_fov = '40'",
            "vertical_fov = [40]",
            "vertical_fov = 60.5",
            "lens_radius = -1",
            "lens_radius = 0",
            "f_stop = 0",
            "f_stop = 2.8",
            "sensor_height = 0",
            "sensor_height = 24",
            "aperture_blades = 2",
            "aperture_blades = 33",
            "aperture_blades = 5.5",
            "aperture_blades = 7",
            "aperture_rotation = 'left'",
            "aperture_rotation = 20",
            "focus_distance = 0",
            "focus_distance = -2",
            "focus_distance = 2",
            "focus_at = [1]",
            "focus_at = [1, 2, 3]",
            "focus_at = [20, 12]",
            "shutter = [0]",
            "shutter = [0, 0.5, 1]",
            "shutter = [-0.5, 1]",
            "shutter = [0, 2]",
            "shutter = [0.2, 0.8]",
            "shutter = 'slow'",
            "position_close = [1]",
            "look_at_close = 1",
            "up_close = [0, 'y', 0]",
        ],
    ),
    (
        "[image]",
        &[
            "hieght = 24",
            "width = 0",
            "width = 65537",
            "width = 12.5",
            "width = 12.0",
            "width = -3",
            "width = '40'",
            "height = [24]",
            "filter = 'gauss'",
            "filter = 'gaussian'",
            "filter = 2",
            "filter_radius = 0",
            "filter_radius = -1",
            "filter_radius = 2",
            "background = 'grey'",
            "background = '#12345'",
            "background = '#123456'",
            "background = 'transparent'",
            "background = 'gradient:0.5'",
            "background = [1, 2, 3]",
            "background = [0.1, 0.2]",
            "background = [1, 2, 3, 4]",
            "background = '0.5'",
            "background = '0.5,0.5'",
            "background = '0.2,0.3,0.4'",
            "background = [1, 2, -3]",
            "background = -0.5",
            "background = true",
            "exposure = 65",
            "exposure = 'bright'",
            "exposure = '1'",
            "exposure = 'auto'",
            "exposure = -2.5",
            "tone = 'aces2'",
            "tone = 'agx'",
        ],
    ),
    (
        "[render]",
        &[
            "samples = 0",
            "samples = -1",
            "samples = 1.5",
            "samples = '4'",
            "samples = true",
            "spp = 4",
            "seed = -1",
            "seed = 1.5",
            "seed = 7",
            "sampler = 'sobl'",
            "sampler = 'halton'",
            "sampler = ['sobol']",
            "backend = 'optix'",
            "denoise = 'of'",
            "denoise = 'off'",
            "denoise = true",
            "denoise_radius = 0.05",
            "quality = 'best'",
            "integrator = 'pth'",
            "integrator = 'direct'",
            "max_depth = -1",
            "max_depth = 1025",
            "max_depth = 2.5",
            "max_depth = 'deep'",
            "max_depth = 'none'",
            "max_depth = '3'",
            "max_depth = 3",
            "max_dept = 3",
            "roulette_depth = -1",
            "directions = 'cos'",
            "direct = 'no'",
            "mis = 'max'",
            "mis = 'balance'",
            "light_selection = 'best'",
            "triangle_sampling = 'angle'",
            "reuse = 'some'",
            "reuse = false",
            "clamp_indirect = 0",
            "clamp_indirect = 'on'",
            "clamp_indirect = '2'",
            "clamp_indirect = 'off'",
            "light_samples = 0",
            "light_samples = 1025",
            "branching = 0",
            "ao_distance = 0",
            "photons = 0",
            "photons = 67108865",
            "photon_alpha = 0",
            "photon_alpha = 1.5",
            "photon_alpha = 1",
            "photon_count = 1",
            "gather_rays = 101",
            "cache_error = 2",
            "cache_rays = 8",
            "debug_view = 'deep'",
            "chains = 0",
            "large_step_probability = 1.1",
            "mutation_size = 0.6",
            "mtl_dialect = 'unreal'",
            "obj_reader = 'fast'",
            "smooth = 0",
            "smooth = 30",
            "panes = 'thin'",
            "texture_filter = 'linear'",
            "texture_dir = 5",
            "texture_dir = [1]",
            "texture_dir = '.'",
        ],
    ),
    (
        "[[object]]",
        &[
            "obj",
            "obj = 5",
            "file = 'a.obj'",
            "name = 3",
            "name = 'thing'",
            "transform = { translate = [1, 2] }",
            "transform = { translate = [1, 2, 3, 4] }",
            "transform = { scale = [1, 2, 3, 4] }",
            "transform = { turn = [0, 0, 90] }",
            "transform = { rotate = [0, 0, 90], scale = 2 }",
            "transform = { scale = true }",
            "transform = 5",
            "matrix = [[1, 0, 0, 0]]",
            "matrix = [[1, 0, 0, 1, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]",
            "matrix = [[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]",
            "matrix_close = 'a'",
            "instances = [1]",
            "instances = 1",
        ],
    ),
    (
        "[material.floor]",
        &[
            "color = [1, 1, 1]",
            "diffuse = 'red'",
            "diffuse = [1, 2]",
            "diffuse = [0.1, 0.2, 0.3, 0.4]",
            "diffuse = [1, 1, -1]",
            "diffuse = -1",
            "diffuse = 0.4",
            "model = 'phng'",
            "model = 5",
            "exponent = -1",
            "roughness = 2",
            "metallic = -0.1",
            "metallic = 0.5",
            "clearcoat = 3",
            "clearcoat_roughness = 'rough'",
            "sheen = 2",
            "opacity = 1.5",
            "opacity = 0.5",
            "ior = 0",
            "thin = 'yes'",
            "abbe = 2",
            "absorption = 0.5",
            "absorption = [1, -1, 0]",
            "absorption_depth = 0",
            "emission = [1, 1, -1]",
            "patch = 'yes'",
            "patch = true",
            "diffuse_map = true",
            "diffuse_map = false",
            "diffuse_map = 5",
            "diffuse_map = { fil = 'x.png' }",
            "diffuse_map = { wrap = 'clamp' }",
            "diffuse_map = { file = 'x.png', wrap = 'tile' }",
            "diffuse_map = { file = 'x.png', channel = 'q' }",
            "diffuse_map = { file = 'x.png', scale = 2 }",
            "diffuse_map = { file = 'x.png', scale = [1, 2, 3] }",
            "diffuse_map = { file = 'x.png', gain = 'much' }",
        ],
    ),
    (
        "[patch.\"fl*\"]",
        &[
            "patch = true",
            "rough = 0.2",
            "opacity = 2",
            "opacity = 0.5",
            "diffuse = 'x'",
        ],
    ),
    (
        "[[light]]",
        &[
            "type",
            "type = 'pont'",
            "type = 5",
            "type = 'spot'",
            "type = 'constant'",
            "position",
            "position = [1, 2]",
            "position = [1, 2, 3, 4]",
            "position = [1e16, 0, 0]",
            "intensity = [1, 1]",
            "intensity = [1, 1, 1, 1]",
            "intensity = [1, 1, -1]",
            "intensity = 1",
            "intensity",
            "radiance = [1, 1, 1]",
            "direction = [0, -1, 0]",
            "colour = [1, 1, 1]",
            "group = 'key'",
            "group = 'a b'",
            "group = 'default'",
            "group = ''",
            "group = 'abcdefghijklmnopqrstuvwx'",
            "group = 5",
        ],
    ),
    (
        "[ground]",
        &[
            "hight = 1",
            "albedo = 0",
            "albedo = 2",
            "albedo = [0.5, 0.5]",
            "albedo = [0.5, 0.5, 0.5, 0.5]",
            "albedo = [0.5, 0.4, 0.3]",
            "albedo = 'grey'",
            "radius = 0",
            "radius = 'far'",
            "up = 'y'",
            "up = [0, 0, 1]",
            "point = [0, 0]",
            "point = [0, 0, 0, 0]",
            "point = [0, 1e11, 0]",
        ],
    ),
    (
        "[[light_group]]",
        &[
            "name",
            "name = 5",
            "name = 'default'",
            "materials = []",
            "materials = 'lamp'",
            "materials = [5]",
            "materials",
            "lights = []",
        ],
    ),
];

/// Sections with errors in their names or keys. A section for lights replaces the light of the
/// scene. Other sections are added.
const SECTIONS: &[&str] = &[
    "[cammera]\nposition = [0, 1, 4]",
    "[renders]\nsamples = 4",
    "[[lights]]\ntype = 'point'",
    "[materials.floor]\ndiffuse = 1",
    "[light]\ntype = 'constant'\nradiance = [1, 1, 1]",
    "[[material]]\ndiffuse = 1",
    "[[light]]\ntype = 'spot'\nposition = [0, 2, 0]\nintensity = [1, 1, 1]\nangle = 40\nlook_at = [0, 0, 0]",
    "[[light]]\ntype = 'spot'\nposition = [0, 2, 0]\nintensity = [1, 1, 1]\nlook_at = [0, 0, 0]",
    "[[light]]\ntype = 'spot'\nposition = [0, 2, 0]\nintensity = [1, 1, 1]\nangle = 0\nlook_at = [0, 0, 0]",
    "[[light]]\ntype = 'spot'\nposition = [0, 2, 0]\nintensity = [1, 1, 1]\nangle = 91\nlook_at = [0, 0, 0]",
    "[[light]]\ntype = 'spot'\nposition = [0, 2, 0]\nintensity = [1, 1, 1]\nangle = 40",
    "[[light]]\ntype = 'spot'\nposition = [0, 2, 0]\nintensity = [1, 1, 1]\nangle = 40\nlook_at = [0, 0, 0]\ndirection = [0, -1, 0]",
    "[[light]]\ntype = 'spot'\nposition = [0, 2, 0]\nintensity = [1, 1, 1]\nangle = 40\ndirection = [0, -1, 0]\nfalloff = -1",
    "[[light]]\ntype = 'directional'\ndirection = [0, -1, 0]\nirradiance = [1, 1, 1]",
    "[[light]]\ntype = 'directional'\ndirection = [0, -1, 0]\nirradiance = [1, 1, 1]\nangle = 0.53",
    "[[light]]\ntype = 'directional'\ndirection = [0, -1, 0]\nirradiance = [1, 1, 1]\nangle = 0.001",
    "[[light]]\ntype = 'directional'\ndirection = [0, -1, 0]\nirradiance = [1, 1, 1]\nangle = 200",
    "[[light]]\ntype = 'directional'\nirradiance = [1, 1, 1]",
    "[[light]]\ntype = 'constant'\nradiance = [1, 1, 1]",
    "[[light]]\ntype = 'constant'\nradiance = [-1, 0, 0]",
    "[[light]]\ntype = 'constant'\nradiance = 1",
    "[[light]]\ntype = 'constant'",
    "[[light]]\ntype = 'environment'",
    "[[light]]\ntype = 'environment'\nimage = 5",
    "[[light]]\ntype = 'sky'",
    "[[light]]\ntype = 'sky'\nsun = [30, 40]\nturbidity = 4",
    "[[light]]\ntype = 'sky'\nturbidity = 1",
    "[[light]]\ntype = 'sky'\nturbidity = 11",
    "[[light]]\ntype = 'sky'\nsun = [0]",
    "[[light]]\ntype = 'sky'\nsun = [0, 100]",
    "[[light]]\ntype = 'sky'\nsun = [0, 10, 20]",
    "[[light]]\ntype = 'sky'\nradiance = [1, 1, 1]",
    "[[light]]\ntype = 'studio'\nfront = 20",
    "[[light]]\ntype = 'studio'\nscale = -1",
    "[[light]]\ntype = 'studio'\nfront = 'left'",
    "[[light]]\ntype = 'rectangle'\nposition = [0, 3, 0]\ndirection = [0, -1, 0]\nsize = [1, 1]\nradiance = [1, 1, 1]",
    "[[light]]\ntype = 'rectangle'\nposition = [0, 3, 0]\ndirection = [0, -1, 0]\nsize = [0, 1]\nradiance = [1, 1, 1]",
    "[[light]]\ntype = 'rectangle'\nposition = [0, 3, 0]\ndirection = [0, -1, 0]\nradiance = [1, 1, 1]",
    "[[light]]\ntype = 'sphere'\nposition = [0, 3, 0]\nradius = 0.5\nradiance = [1, 1, 1]",
    "[[light]]\ntype = 'sphere'\nposition = [0, 3, 0]\nradius = 0\nradiance = [1, 1, 1]",
    "[[light]]\ntype = 'sphere'\nposition = [0, 3, 0]\nradiance = [1, 1, 1]",
    "[[light]]\ntype = 'disk'\nposition = [0, 3, 0]\ndirection = [0, -1, 0]\nradius = 0.5\nradiance = [1, 1, 1]",
    "[[light]]\ntype = 'disk'\nposition = [0, 3, 0]\nradius = 0.5\nradiance = [1, 1, 1]",
];

/// The scene with `line` in `section`.
fn changed(section: &str, line: &str) -> String {
    let key = line.split(' ').next().unwrap();
    let (before, rest) = SCENE.split_at(SCENE.find(section).unwrap() + section.len());
    let end = rest.find("\n[").map_or(rest.len(), |end| end + 1);
    let (of_section, after) = rest.split_at(end);
    let others = of_section.lines().filter(|old| old.split(' ').next() != Some(key));
    let others: Vec<&str> = others.filter(|line| !line.is_empty()).collect();
    let line = if line.contains('=') { line } else { "" };
    let first = if before.is_empty() { "" } else { "\n" };
    format!("{before}{first}{line}\n{}\n{after}", others.join("\n"))
}

/// The schema accepts a scene file exactly if the program accepts the file. Many of the tested
/// files have an error.
#[test]
fn the_schema_and_the_program_agree() {
    let schema = schema();
    let here = folder(&[
        (
            "a.mtl",
            "newmtl floor\nKd 0.5 0.4 0.3\nnewmtl lamp\nKd 0 0 0\nKe 5 5 5\n",
        ),
        (
            "a.obj",
            "mtllib a.mtl\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nv -1 1 -1\nv 1 1 -1\n\
             usemtl floor\nf 1 2 3 4\nusemtl lamp\nf 4 3 6 5\n",
        ),
    ]);
    let path = here.path().join("s.toml");
    let (mut refused, mut taken) = (0, 0);
    let mut differences = Vec::new();
    let mut check = |text: &str, what: &str| {
        fs::write(&path, text).unwrap();
        let (by_schema, by_program) = (fault_by_schema(&schema, text), fault_by_program(&path));
        match (&by_schema, &by_program) {
            (Some(_), Some(_)) => refused += 1,
            (None, None) => taken += 1,
            _ => differences.push(format!("{what}\n  schema: {by_schema:?}\n  program: {by_program:?}")),
        }
    };
    check(SCENE, "the scene as it is");
    for (section, lines) in CHANGES {
        lines
            .iter()
            .for_each(|line| check(&changed(section, line), &format!("{section} {line}")));
    }
    let (before, rest) = SCENE.split_at(SCENE.find("[[light]]").unwrap());
    let after = &rest[rest.find("[ground]").unwrap()..];
    // The ground is left out, because it refuses some of these lights.
    let after = &after[after.find("[[light_group]]").unwrap()..];
    for section in SECTIONS {
        check(&format!("{before}{section}\n{after}"), section);
    }
    // Two sections whose keys exclude each other, and a camera defined by angles
    let orbit = |angles: &str| {
        let text = changed("[camera]", &format!("orbit = {angles}"));
        text.lines()
            .filter(|line| !line.starts_with("position = [0, 1") && !line.starts_with("look_at"))
            .collect::<Vec<_>>()
            .join("\n")
    };
    for angles in [
        "[30, 20]",
        "[30, 20, 5]",
        "[30]",
        "[30, 100]",
        "[30, 20, -1]",
        "[1, 2, 3, 4]",
        "'front'",
    ] {
        check(&orbit(angles), angles);
    }
    let identity = "[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]";
    check(
        &changed(
            "[[object]]",
            &format!("matrix = {identity}\ntransform = {{ scale = 2 }}"),
        ),
        "matrix and transform",
    );
    assert!(
        differences.is_empty(),
        "{} differences\n{}",
        differences.len(),
        differences.join("\n")
    );
    assert!(refused > 150 && taken > 40, "{refused} refused, {taken} taken");
}

/// Keys in the first cells of the tables of the page, such as `camera.up`. After
/// `material.NAME.eta`, the name `.k` is short for `material.NAME.k`.
fn keys_of_page(page: &str) -> BTreeSet<String> {
    let mut keys = BTreeSet::new();
    for row in page.lines().filter(|line| line.starts_with("| `")) {
        let cell = row.trim_start_matches("| ").split(" | ").next().unwrap();
        let mut section = "";
        for name in cell.split('`').skip(1).step_by(2) {
            match name.strip_prefix('.') {
                Some(key) => drop(keys.insert(format!("{section}.{key}"))),
                None => {
                    section = name.rsplit_once('.').map_or("", |(section, _)| section);
                    keys.insert(name.into());
                }
            }
        }
    }
    keys
}

/// Each key of the schema has a row in the reference, and each type of light a row with its keys.
#[test]
fn reference_page_has_every_schema_key() {
    let schema = schema();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/guide/reference/scene-file.md");
    let page = fs::read_to_string(path).unwrap();
    let rows = keys_of_page(&page);
    let properties = &schema["properties"];
    let mut count = 0;
    for (section, table) in [
        ("camera", &properties["camera"]),
        ("image", &properties["image"]),
        ("object", &properties["object"]["items"]),
        ("material.NAME", &properties["material"]["additionalProperties"]),
        ("ground", &properties["ground"]),
        ("light_group", &properties["light_group"]["items"]),
    ] {
        let keys = table["properties"].as_object().unwrap().keys();
        // `fov` is a second name of another key, so it needs no row.
        for key in keys.filter(|key| *key != "fov") {
            assert!(rows.contains(&format!("{section}.{key}")), "{section}.{key} has no row");
            count += 1;
        }
    }
    let lights = page.split("\n## Lights\n").nth(1).unwrap();
    for condition in properties["light"]["items"]["allOf"].as_array().unwrap() {
        let name = condition["if"]["properties"]["type"]["enum"][0].as_str().unwrap();
        let row = lights.lines().find(|line| line.starts_with(&format!("| `{name}` | ")));
        let row = row.unwrap_or_else(|| panic!("light {name} has no row"));
        for key in condition["then"]["properties"].as_object().unwrap().keys() {
            let is_common = ["type", "group"].contains(&key.as_str());
            let has_row = match is_common {
                true => rows.contains(&format!("light.{key}")),
                false => row.contains(&format!("`{key}`")),
            };
            assert!(has_row, "{key} of light {name} is not on the page");
            count += 1;
        }
    }
    assert!(count > 100, "{count} keys");
}
