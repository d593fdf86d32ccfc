//! Denoising by the real program: errors against a reference, what is written, and what is refused.
#![cfg(feature = "embree")]

mod support;

use std::path::Path;
use std::process::{Command, Output};
use support::{read_channel, read_rgb, rel_mse};

fn render(out: &Path, flags: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_embrasure"))
        .args(["render", "-q", "--size", "128x128", "-o"])
        .arg(out)
        .args(flags)
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box.toml"))
        .output()
        .unwrap()
}

/// Of the Cornell box with 8 samples a pixel. A fifth is asked of Open Image Denoise, and half of the wavelets, which
/// do better the larger a picture is.
#[test]
fn denoising_leaves_a_fraction_of_the_error() {
    let folder = tempfile::tempdir().unwrap();
    let [reference, image] = ["reference.exr", "image.exr"].map(|file| folder.path().join(file));
    assert!(render(&reference, &["--spp", "256", "--seed", "1"]).status.success());
    let reference = read_rgb(&reference);
    let denoisers: &[(&str, f64)] = if cfg!(feature = "oidn") {
        &[("atrous", 0.5), ("oidn", 0.2)]
    } else {
        &[("atrous", 0.5)]
    };
    for (name, most) in denoisers {
        let out = render(&image, &["--spp", "8", &format!("--denoise={name}")]);
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        let raw = ["raw.R", "raw.G", "raw.B"].map(|channel| read_channel(&image, channel));
        let [before, after] = [&raw, &read_rgb(&image)].map(|image| rel_mse(image, &reference));
        println!("{name}: relMSE {before:.5} becomes {after:.5}");
        assert!(after < most * before, "{name}: relMSE {before} becomes {after}");
    }
}

#[test]
fn denoised_files_say_so_and_keep_the_raw_pixels() {
    let folder = tempfile::tempdir().unwrap();
    let [raw, denoised] = ["raw.exr", "denoised.exr"].map(|file| folder.path().join(file));
    let crop = ["--spp", "4", "--crop", "20,10,60,51"];
    assert!(render(&raw, &crop).status.success());
    let flags: Vec<&str> = crop.into_iter().chain(["--denoise=gaussian"]).collect();
    assert!(render(&denoised, &flags).status.success());
    for (name, kept) in [
        ("R", "raw.R"),
        ("G", "raw.G"),
        ("B", "raw.B"),
        ("variance.G", "variance.G"),
    ] {
        assert!(read_channel(&raw, name) == read_channel(&denoised, kept), "{name}");
    }
    assert!(read_channel(&raw, "G") != read_channel(&denoised, "G"));

    let attributes = |path: &Path| {
        let meta = exr::meta::MetaData::read_from_file(path, false).unwrap();
        let header = &meta.headers[0];
        ["embrasure.settings", "embrasure.denoiser"].map(|name| {
            let value = header.own_attributes.other.iter().find(|(key, _)| **key == *name);
            value.map(|(_, value)| format!("{value:?}"))
        })
    };
    let [[settings, none], [same, denoiser]] = [attributes(&raw), attributes(&denoised)];
    assert!(settings.is_some() && settings == same && none.is_none());
    assert!(denoiser.unwrap().contains("gaussian"));
}

#[test]
fn a_denoiser_that_is_not_there_is_refused_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    let image = folder.path().join("x.exr");
    let refused = |flags: &[&str]| {
        let out = render(&image, flags);
        assert_eq!(out.status.code(), Some(2));
        assert!(!image.exists());
        String::from_utf8_lossy(&out.stderr).into_owned()
    };
    let words = refused(&["--denoise=median"]);
    assert!(words.contains("off, oidn, atrous, gaussian"), "{words}");
    if cfg!(not(feature = "oidn")) {
        // A bare --denoise is oidn, also right before the scene.
        let words = refused(&["--denoise"]);
        assert!(
            words.contains("--denoise=atrous") && words.contains("scripts/setup oidn"),
            "{words}"
        );
    }
}
