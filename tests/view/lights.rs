//! Lights and materials changed by pages, and light groups, which pages change without a render.

use super::{Page, Viewer};
use crate::support::program::{assert_same_bits, done, lit_floor, split};
use half::f16;
use serde_json::Value;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// The lit floor with two lights in its scene file.
fn two_lights() -> TempDir {
    let folder = lit_floor();
    let path = folder.path().join("s.toml");
    let text = fs::read_to_string(&path).unwrap();
    let lights = "# Two lights\n[[light]]\ntype = \"point\" # left\nposition = [-1, 2, 1]\nintensity = [2, 1, 0.5]\n\n[[light]]\ntype = \"constant\"\nradiance = [0.1, 0.2, 0.4]\n";
    fs::write(&path, text + lights).unwrap();
    folder
}

fn saved(viewer: &Viewer, folder: &Path) -> std::path::PathBuf {
    let path = folder.join("v.exr");
    fs::write(&path, viewer.get("picture.exr").1).unwrap();
    path
}

fn is_whole(header: &Value) -> bool {
    header["preview"] == false && header["samples"] == 4.0
}

/// A page that shows light groups gets each group separately. The sum of the groups is the image,
/// and the image equals a render with the same groups.
#[test]
fn light_groups_sum_to_the_image() {
    let folder = two_lights();
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let mut page = viewer.page();
    page.wait_for_all();
    page.send(r#"{"do":"channel","name":"lights","second":"picture"}"#);
    let groups = page.frame_where(|h| h["channel"] == "lights" && is_whole(h) && h["groups"][0].is_string());
    assert_eq!(groups.header["groups"], serde_json::json!(["lamp", "light1", "light2"]));
    let (width, height) = (40, 24);
    let values: Vec<f32> = groups.halves().map(f16::to_f32).collect();
    let count = 3 * width * height;
    assert_eq!(values.len(), 3 * count);
    page.wait_for_all();
    let path = saved(&viewer, folder.path());
    let [r, g, b] = crate::support::read_rgb(&path);
    for i in 0..width * height {
        for (c, channel) in [&r, &g, &b].into_iter().enumerate() {
            let sum: f32 = (0..3).map(|k| values[k * count + 3 * i + c]).sum();
            assert!(
                (sum - channel[i]).abs() < 2e-3 * (1.0 + sum),
                "pixel {i}: {sum} {}",
                channel[i]
            );
        }
    }
    // Each group has some light.
    for k in 0..3 {
        assert!(
            values[k * count..(k + 1) * count].iter().sum::<f32>() > 0.0,
            "group {k}"
        );
    }
    let groups = "light_group=[{ name = \"lamp\", materials = [\"lamp\"] }]";
    let args = [
        "render",
        "s.toml",
        "-q",
        "-o",
        "r.exr",
        "--aov",
        "lights",
        "--set",
        "light.0.group=light1",
        "--set",
        "light.1.group=light2",
        "--set",
        groups,
    ];
    done(folder.path(), &args);
    assert_same_bits(&folder.path().join("r.exr"), &path);

    // Without groups, the image is the same as before.
    page.send(r#"{"do":"channel","name":"picture"}"#);
    page.message("note");
    page.wait_for_all();
    done(folder.path(), &split("render s.toml -q -o r.exr"));
    assert_same_bits(&folder.path().join("r.exr"), &saved(&viewer, folder.path()));
}

/// A page changes a light like `--set` does. The change keeps the acceleration structure, and is
/// saved in the scene file with changes of materials.
#[test]
fn lights_are_changed_and_saved() {
    let folder = two_lights();
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let mut page = viewer.page();
    let hello = page.message("hello");
    assert_eq!(hello["scene_lights"][0]["keys"]["type"], "point");
    assert_eq!(hello["scene_lights"][1]["keys"]["radiance"][2], 0.4);
    page.send(r#"{"do":"light","index":0,"key":"intensity","value":"[0.5, 4, 0.25]"}"#);
    let note = page.message("note");
    assert_eq!(note["kept_structure"], true, "{note}");
    page.wait_for_all();
    let args = [
        "render",
        "s.toml",
        "-q",
        "-o",
        "r.exr",
        "--set",
        "light.0.intensity=[0.5, 4, 0.25]",
    ];
    done(folder.path(), &args);
    assert_same_bits(&folder.path().join("r.exr"), &saved(&viewer, folder.path()));
    for wrong in [
        r#"{"do":"light","index":2,"key":"intensity","value":"1"}"#,
        r#"{"do":"light","index":0,"key":"no.key","value":"1"}"#,
        r#"{"do":"light","index":0,"key":"colour","value":"1"}"#,
        r#"{"do":"light","index":0,"key":"intensity","value":"[-1, 0, 0]"}"#,
    ] {
        page.send(wrong);
        page.message("error");
    }

    let state = page.message_where("state", |state| state["light_edits"][0].is_string());
    let sections = state["light_sections"].as_str().unwrap();
    assert!(
        sections.contains("type = \"point\"") && sections.contains("intensity = [0.5, 4.0, 0.25]"),
        "{sections}"
    );

    page.send(r#"{"do":"material","name":"floor","key":"diffuse","value":"[0.1, 0.7, 0.2]"}"#);
    let note = page.message("note");
    assert_eq!(note["kept_structure"], true, "{note}");
    page.wait_for_all();
    let changed = saved(&viewer, folder.path());
    page.send(r#"{"do":"save-changes"}"#);
    let note = page.message("note");
    assert!(note["text"].as_str().unwrap().contains("saved in s.toml"), "{note}");
    let text = fs::read_to_string(folder.path().join("s.toml")).unwrap();
    assert!(
        text.contains("# Two lights") && text.contains("type = \"point\" # left"),
        "{text}"
    );
    assert!(text.contains("[patch.floor]\ndiffuse = [0.1, 0.7, 0.2]"), "{text}");
    done(folder.path(), &split("render s.toml -q -o r.exr"));
    assert_same_bits(&folder.path().join("r.exr"), &changed);
}

/// A page must not select files to read. Keys that name files are refused, also if other fields of
/// a command hide them.
#[test]
fn keys_of_files_are_refused() {
    let folder = two_lights();
    let picture = tempfile::tempdir().unwrap();
    let private = picture.path().join("private.png");
    image::RgbImage::from_pixel(2, 2, image::Rgb([255, 0, 255]))
        .save(&private)
        .unwrap();
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let mut page = viewer.page();
    page.wait_for_all();
    let before = viewer.get("picture.exr").1;
    let file = serde_json::json!(private).to_string();
    for (name, key) in [
        ("floor", "diffuse_map"),
        ("floor", "normal_map"),
        ("floor", "diffuse_map.file"),
    ] {
        page.send(&serde_json::json!({ "do": "material", "name": name, "key": key, "value": file }).to_string());
        let said = page.message("error")["text"].to_string();
        assert!(said.contains(key), "{said}");
    }
    page.send(&serde_json::json!({ "do": "light", "index": 1, "key": "image", "value": file }).to_string());
    page.message("error");
    // A material name is not parsed as a key: the name below belongs to no material.
    let name = format!("floor.diffuse_map={file} #");
    page.send(&serde_json::json!({ "do": "material", "name": name, "key": "opacity", "value": "1" }).to_string());
    page.message("note");
    page.wait_for_all();
    let path = folder.path().join("before.exr");
    fs::write(&path, before).unwrap();
    assert_same_bits(&path, &saved(&viewer, folder.path()));
}

/// Lights of flags are added to the lights of the file, or replace them. A page gets only the
/// lights of the file, and can change only these.
#[test]
fn page_changes_only_lights_of_the_file() {
    let folder = two_lights();
    let path = folder.path().join("s.toml");
    let text = fs::read_to_string(&path).unwrap();
    let point = text.find("[[light]]\ntype = \"point\"").unwrap();
    let constant = text.find("[[light]]\ntype = \"constant\"").unwrap();
    // Put the environment first, so that the index of the point light changes without it
    let swapped = [&text[..point], &text[constant..], &text[point..constant]].concat();
    fs::write(&path, swapped).unwrap();
    let flags = ["s.toml", "--env", "0.05,0.1,0.2", "--sun", "30,40,2"];
    let viewer = Viewer::start(folder.path(), &flags);
    let mut page = viewer.page();
    let hello = page.message("hello");
    let lights = hello["scene_lights"].as_array().unwrap();
    assert_eq!(lights.len(), 1, "{lights:?}");
    assert!(
        lights[0]["index"] == 1 && lights[0]["keys"]["type"] == "point",
        "{lights:?}"
    );
    page.send(r#"{"do":"light","index":1,"key":"intensity","value":"[0.5, 4, 0.25]"}"#);
    page.message("note");
    page.wait_for_all();
    let edit = ["--set", "light.1.intensity=[0.5, 4, 0.25]"];
    done(
        folder.path(),
        &[&["render"], &flags[..], &edit, &["-q", "-o", "r.exr"]].concat(),
    );
    assert_same_bits(&folder.path().join("r.exr"), &saved(&viewer, folder.path()));
    for index in [0, 2] {
        page.send(&format!(
            r#"{{"do":"light","index":{index},"key":"radiance","value":"[1, 1, 1]"}}"#
        ));
        page.message("error");
    }
    // Lamps and lights of the file have groups, and lights of flags have no groups of their own.
    page.send(r#"{"do":"channel","name":"lights"}"#);
    let groups = page.frame_where(|h| h["channel"] == "lights" && is_whole(h) && h["groups"][0].is_string());
    let names: Vec<&str> = groups.header["groups"]
        .as_array()
        .unwrap()
        .iter()
        .map(|name| name.as_str().unwrap())
        .collect();
    assert_eq!(names, ["lamp", "light2", "default"]);
    page.send(r#"{"do":"save-changes"}"#);
    page.message_where("note", |note| note["text"].as_str().unwrap().contains("saved"));
    let text = fs::read_to_string(&path).unwrap();
    assert!(
        text.contains("position = [-1, 2, 1]\nintensity = [0.5, 4, 0.25]"),
        "{text}"
    );
    assert!(text.contains("radiance = [0.1, 0.2, 0.4]"), "{text}");
}

/// Changed meshes need a new acceleration structure.
#[test]
fn changed_meshes_get_a_new_structure() {
    let folder = two_lights();
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let mut page = viewer.page();
    page.wait_for_all();
    let obj = folder.path().join("a.obj");
    let text = fs::read_to_string(&obj).unwrap();
    fs::write(&obj, text.replace("v -1 0 1\n", "v -1.5 0 1\n")).unwrap();
    let note = page.message("note");
    assert_eq!(note["kept_structure"], false, "{note}");
    page.wait_for_all();
    done(folder.path(), &split("render s.toml -q -o r.exr"));
    assert_same_bits(&folder.path().join("r.exr"), &saved(&viewer, folder.path()));
}

/// The brightest samples of a pixel are the same samples as in `--pixel --sample`, sorted by their
/// contribution.
#[test]
fn brightest_samples_are_found() {
    let folder = two_lights();
    let viewer = Viewer::start(folder.path(), &split("s.toml --spp 20 --reuse none"));
    let mut page: Page = viewer.page();
    page.wait_for_all();
    page.send(r#"{"do":"brightest","x":20,"y":15}"#);
    let found = page.message("brightest");
    assert!(found["searched"] == 20 && found["of"] == 20, "{found}");
    let samples = found["samples"].as_array().unwrap();
    assert_eq!(samples.len(), 8);
    let shares: Vec<f64> = samples.iter().map(|s| s["share"].as_f64().unwrap()).collect();
    assert!(shares.is_sorted_by(|a, b| a >= b) && shares[0] > 0.0, "{shares:?}");
    let sample = samples[0]["sample"].to_string();
    let line = format!("render s.toml --spp 20 --reuse none --pixel 20,15 --sample {sample} --json -q");
    let printed = crate::support::program::json(&done(folder.path(), &split(&line)));
    for c in 0..3 {
        let [one, other] =
            [&printed["samples"][0]["radiance"][c], &samples[0]["radiance"][c]].map(|v| v.as_f64().unwrap());
        assert!((one - other).abs() <= 1e-6 * one.abs(), "{one} {other}");
    }
    page.send(r#"{"do":"brightest","x":40,"y":15}"#);
    page.message("error");
}
