//! Denoising by the real program: errors against a reference, what is written, and what is refused.
#![cfg(feature = "embree")]

use crate::support::program::{done, folder, joined, refused, split};
use crate::support::{read_channel, read_rgb, rel_mse};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Arguments that render the Cornell box.
fn cornell<'a>(out: &'a str, flags: &[&'a str]) -> Vec<&'a str> {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell-box.toml");
    [&["render", "-q", "--size", "128x128", "-o", out], flags, &[scene]].concat()
}

/// Renders it; the picture's path.
fn render(folder: &TempDir, out: &str, flags: &[&str]) -> PathBuf {
    done(folder.path(), &cornell(out, flags));
    folder.path().join(out)
}

/// Of the Cornell box with 4 samples per pixel. A fifth is asked of Open Image Denoise, half of the wavelets, which do better the
/// larger a picture is, and less of filters without guides.
#[test]
fn denoising_leaves_a_fraction_of_the_error() {
    let folder = folder(&[]);
    let reference = read_rgb(&render(&folder, "reference.exr", &["--spp", "256", "--seed", "1"]));
    let denoisers: &[(&str, f64)] = if cfg!(feature = "oidn") {
        &[("atrous", 0.5), ("nlm", 0.7), ("bilateral", 0.9), ("oidn", 0.2)]
    } else {
        &[("atrous", 0.5), ("nlm", 0.7), ("bilateral", 0.9)]
    };
    for (name, max) in denoisers {
        let denoise = format!("--denoise={name}");
        let image = render(&folder, "image.exr", &["--spp", "4", &denoise]);
        let raw = ["raw.R", "raw.G", "raw.B"].map(|channel| read_channel(&image, channel));
        let [before, after] = [&raw, &read_rgb(&image)].map(|image| rel_mse(image, &reference));
        println!("{name}: relMSE {before:.5} becomes {after:.5}");
        assert!(after < max * before, "{name}: relMSE {before} becomes {after}");
    }
}

/// With few samples the wavelets brought lamps and their reflections down, and lost up to a fifth of the light.
#[test]
fn wavelets_lose_no_light() {
    let folder = folder(&[]);
    for name in ["cornell-box", "veach-plates", "spheres"] {
        let scene = format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        let args = "render -q --size 128x128 --spp 4 --denoise=atrous -o image.exr";
        done(folder.path(), &joined(&split(args), &[&scene]));
        let image = folder.path().join("image.exr");
        let mean = |name: &str| {
            let values = read_channel(&image, name);
            values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64
        };
        let left = mean("G") / mean("raw.G");
        println!("{name}: {left:.4}");
        assert!((left - 1.0).abs() < 0.02, "{name}: {left} of the light is left");
    }
}

/// A radius widens the filters that have one, and is refused with others.
#[test]
fn radii_are_those_of_filters_that_have_one() {
    let folder = folder(&[]);
    for name in ["gaussian", "bilateral", "nlm"] {
        let denoise = format!("--denoise={name}");
        let flags = ["--spp", "2", &denoise];
        let usual = render(&folder, "usual.exr", &flags);
        let wide = render(&folder, "wide.exr", &joined(&flags, &["--denoise-radius", "4"]));
        assert!(read_channel(&usual, "G") != read_channel(&wide, "G"), "{name}");
        // `develop` makes the same pixels of it.
        let args = format!("develop -q usual.exr {denoise} --denoise-radius 4 -o later.exr");
        done(folder.path(), &split(&args));
        let later = folder.path().join("later.exr");
        assert!(read_channel(&later, "G") == read_channel(&wide, "G"), "{name}");
    }
    for flags in [
        &["--denoise=atrous", "--denoise-radius", "2"][..],
        &["--denoise-radius", "2"],
    ] {
        let said = refused(folder.path(), &cornell("x.exr", flags), 2);
        assert!(
            said.contains("--denoise-radius 2: the denoiser has no radius"),
            "{said}"
        );
    }
    let said = refused(
        folder.path(),
        &cornell("x.exr", &["--denoise=nlm", "--denoise-radius", "99"]),
        2,
    );
    assert!(said.contains("--denoise-radius 99"), "{said}");
}

#[test]
fn denoised_files_say_so_and_keep_the_raw_pixels() {
    let folder = folder(&[]);
    let crop = ["--spp", "4", "--crop", "20,10,60,51"];
    let raw = render(&folder, "raw.exr", &crop);
    let denoised = render(&folder, "denoised.exr", &joined(&crop, &["--denoise=gaussian"]));
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
    let folder = folder(&[]);
    let said = |flag: &str| {
        let said = refused(folder.path(), &cornell("x.exr", &[flag]), 2);
        assert!(!folder.path().join("x.exr").exists());
        said
    };
    let words = said("--denoise=median");
    assert!(words.contains("off, oidn, atrous, gaussian"), "{words}");
    if cfg!(not(feature = "oidn")) {
        // A bare --denoise is oidn, also right before the scene.
        let words = said("--denoise");
        assert!(
            words.contains("--denoise=atrous") && words.contains("scripts/setup oidn"),
            "{words}"
        );
    }
}
