//! Denoising with the real program: errors against a reference, written channels, and refused
//! options.
#![cfg(feature = "embree")]

use crate::support::program::{done, folder, joined, refused, split, words};
use crate::support::{read_channel, read_rgb, rel_mse};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Arguments that render the Cornell box.
fn cornell<'a>(out: &'a str, flags: &[&'a str]) -> Vec<&'a str> {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell-box.toml");
    [&["render", "-q", "--size", "128x128", "-o", out], flags, &[scene]].concat()
}

/// Renders the Cornell box; returns the path of the image.
fn render(folder: &TempDir, out: &str, flags: &[&str]) -> PathBuf {
    done(folder.path(), &cornell(out, flags));
    folder.path().join(out)
}

/// Denoises the Cornell box with 4 samples per pixel. Open Image Denoise leaves at most a fifth of
/// the error. The wavelets leave at most half of the error, and less in larger images.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn denoising_reduces_the_error() {
    let folder = folder(&[]);
    let reference = read_rgb(&render(&folder, "reference.exr", &["--spp", "256", "--seed", "1"]));
    let denoisers: &[(&str, f64)] = if cfg!(feature = "oidn") {
        &[("atrous", 0.5), ("oidn", 0.2)]
    } else {
        &[("atrous", 0.5)]
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

/// Regression: with few samples the wavelets darkened lamps and their reflections, and lost up to a
/// fifth of the light.
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

/// A radius widens the filter of `gaussian`, and is refused with other denoisers.
#[test]
fn radius_applies_to_the_gaussian_only() {
    let folder = folder(&[]);
    let flags = ["--spp", "2", "--denoise=gaussian"];
    let usual = render(&folder, "usual.exr", &flags);
    let wide = render(&folder, "wide.exr", &joined(&flags, &["--denoise-radius", "4"]));
    assert!(read_channel(&usual, "G") != read_channel(&wide, "G"));
    // `develop` gives the same pixels.
    let args = "develop -q usual.exr --denoise=gaussian --denoise-radius 4 -o later.exr";
    done(folder.path(), &split(args));
    let later = folder.path().join("later.exr");
    assert!(read_channel(&later, "G") == read_channel(&wide, "G"));
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
        &cornell("x.exr", &["--denoise=gaussian", "--denoise-radius", "99"]),
        2,
    );
    assert!(said.contains("--denoise-radius 99"), "{said}");
}

/// Denoisers of this build.
const DENOISERS: &[&str] = if cfg!(feature = "oidn") {
    &["oidn", "atrous", "gaussian"]
} else {
    &["atrous", "gaussian"]
};

/// A ball of 24 × 12 quads and radius 0.8 with the material `material`, in a white sky.
fn ball(material: &str, image: &str) -> TempDir {
    let (columns, rows) = (24, 12);
    let mut obj = String::new();
    for (row, column) in (0..=rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let (sin, cos) = (std::f64::consts::PI * f64::from(row) / f64::from(rows)).sin_cos();
        let (x, z) = (std::f64::consts::TAU * f64::from(column) / f64::from(columns)).sin_cos();
        obj += &format!("v {} {} {}\n", 0.8 * sin * x, 0.8 * cos, 0.8 * sin * z);
    }
    obj += "usemtl m\n";
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let at = |row: i32, column: i32| row * columns + column % columns + 1;
        let (a, b, c, d) = (
            at(row, column),
            at(row + 1, column),
            at(row + 1, column + 1),
            at(row, column + 1),
        );
        obj += &format!("f {a} {b} {c} {d}\n");
    }
    let scene = format!(
        "version = 1\n[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\nvertical_fov = 40\n\
         [image]\nwidth = 64\nheight = 64\n{image}\n[[object]]\nobj = \"o.obj\"\n[material.m]\n{material}\n\
         [[light]]\ntype = \"constant\"\nradiance = [1, 1, 1]\n"
    );
    folder(&[("o.obj", &obj), ("s.toml", &scene)])
}

/// A matte ball of albedo 0.8 in front of a transparent background. Every pixel has the colour of
/// the ball, up to the noise of pixels with few samples.
#[test]
fn denoised_rims_keep_their_color() {
    let folder = ball("diffuse = 0.8", "background = \"transparent\"");
    for denoiser in DENOISERS {
        let args = format!("render s.toml -q --spp 64 --denoise={denoiser} -o a.exr");
        done(folder.path(), &split(&args));
        let channel = |name: &str| read_channel(&folder.path().join("a.exr"), name);
        let (light, alpha, raw) = (channel("G"), channel("A"), channel("raw.A"));
        let mut rim = Vec::new();
        for (i, (&light, &alpha)) in light.iter().zip(&alpha).enumerate() {
            // Subnormal numbers have too few digits for a ratio.
            if alpha < 1e-30 {
                assert!(light < 1e-30, "{denoiser}, pixel {i}: {light}");
                continue;
            }
            let color = light / alpha;
            assert!(
                (0.62..=0.98).contains(&color),
                "{denoiser}, pixel {i}: {color} of {alpha}"
            );
            if alpha < 0.98 {
                rim.push(f64::from(color));
            }
        }
        let mean = rim.iter().sum::<f64>() / rim.len() as f64;
        assert!(rim.len() > 60 && (mean / 0.8 - 1.0).abs() < 0.02, "{denoiser}: {mean}");
        let sum = |values: &[f32]| values.iter().map(|&v| f64::from(v)).sum::<f64>();
        let left = sum(&alpha) / sum(&raw);
        assert!((left - 1.0).abs() < 0.01, "{denoiser}: {left} of the coverage");
        // The file can be denoised again, from the noisy image and the coverage in the file.
        done(
            folder.path(),
            &split(&format!("develop -q a.exr --denoise={denoiser} -o b.exr")),
        );
        let again = read_channel(&folder.path().join("b.exr"), "A");
        assert!(again == alpha, "{denoiser}");
    }
}

/// A ball emits from 1 to 10⁸ in a sky of radiance 1.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn denoised_lamps_keep_their_light() {
    for exponent in 0..=8 {
        let radiance = 10f64.powi(exponent);
        let folder = ball(&format!("emission = {radiance:e}"), "");
        for denoiser in DENOISERS {
            let args = format!("render s.toml -q --spp 16 --denoise={denoiser} -o a.exr");
            done(folder.path(), &split(&args));
            let channel = |name: &str| read_channel(&folder.path().join("a.exr"), name);
            let sum = |name: &str| channel(name).iter().map(|&v| f64::from(v)).sum::<f64>();
            let left = sum("G") / sum("raw.G");
            println!("{radiance:e} {denoiser}: {left:.5}");
            assert!(
                (left - 1.0).abs() < 0.005,
                "{radiance:e} {denoiser}: {left} of the light"
            );
            // A pixel inside the lamp, and a pixel of the sky
            for (pixel, expected) in [(32 * 64 + 32, radiance), (3 * 64 + 3, 1.0)] {
                let found = f64::from(channel("G")[pixel]);
                assert!(
                    (found / expected - 1.0).abs() < 0.03,
                    "{radiance:e} {denoiser}: {found}"
                );
                let emitted = f64::from(channel("emitted")[pixel]);
                assert!((emitted / expected - 1.0).abs() < 1e-4, "{radiance:e}: {emitted}");
            }
        }
    }
}

/// Open Image Denoise pads a side of up to 16 pixels, which is slow. The other denoisers need no
/// padding.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn narrow_images_warn_of_slow_denoising() {
    let folder = ball("diffuse = 0.5", "");
    let told = |denoiser: &str, size: &str| {
        let args = format!("render s.toml --spp 1 --size {size} --denoise={denoiser} -o a.exr");
        words(&done(folder.path(), &split(&args))).contains("pads both sides")
    };
    assert!(!told("atrous", "20000x1") && !told("gaussian", "20000x1"));
    if cfg!(feature = "oidn") {
        assert!(told("oidn", "20000x1") && !told("oidn", "200x1"));
    }
}

#[test]
fn denoised_files_keep_the_raw_pixels() {
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
fn missing_denoiser_is_an_error_at_once() {
    let folder = folder(&[]);
    let said = |flag: &str| {
        let said = refused(folder.path(), &cornell("x.exr", &[flag]), 2);
        assert!(!folder.path().join("x.exr").exists());
        said
    };
    for name in ["median", "bilateral", "nlm"] {
        let words = said(&format!("--denoise={name}"));
        assert!(words.contains("off, oidn, oidn-fast, atrous, gaussian"), "{words}");
    }
    if cfg!(not(feature = "oidn")) {
        // `--denoise` without a name selects oidn, also directly before the scene.
        let words = said("--denoise");
        assert!(
            words.contains("--denoise=atrous") && words.contains("scripts/setup oidn"),
            "{words}"
        );
    }
}
