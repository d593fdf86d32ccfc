//! Lights and materials that pages change, and the light groups that they change by themselves.

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

/// A page that shows light groups gets each by itself; they add up to the picture, and the picture is that of a render that tells the same groups apart.
#[test]
fn light_groups_add_up() {
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
    // Each group gives some light.
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

    // Without them the picture is as before.
    page.send(r#"{"do":"channel","name":"picture"}"#);
    page.message("note");
    page.wait_for_all();
    done(folder.path(), &split("render s.toml -q -o r.exr"));
    assert_same_bits(&folder.path().join("r.exr"), &saved(&viewer, folder.path()));
}

/// A light is changed as `--set` changes it, with the acceleration structure that is there, and saved in the scene file with materials.
#[test]
fn lights_are_changed_and_saved() {
    let folder = two_lights();
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let mut page = viewer.page();
    let hello = page.message("hello");
    assert_eq!(hello["scene_lights"][0]["type"], "point");
    assert_eq!(hello["scene_lights"][1]["radiance"][2], 0.4);
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

/// Meshes that are others need a structure of their own.
#[test]
fn changed_meshes_are_built_anew() {
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

/// The brightest samples of a pixel are those of `--pixel --sample`, by what they add.
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
