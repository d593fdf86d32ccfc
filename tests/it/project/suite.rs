//! The comparison suite: means against converged references, and convergence.
#![cfg(feature = "embree")]

use crate::support::program::{done, folder};
use crate::support::{budget, read_rgb, rel_mse, shared};
use std::ops::Range;
use std::path::Path;

/// Width of the images of the suite in pixels.
const WIDTH: usize = 512;

/// Renders `toml` and reads the image.
fn render(toml: &Path, spp: u32, flags: &[&str]) -> [Vec<f32>; 3] {
    let folder = folder(&[]);
    let (toml, spp) = (toml.canonicalize().unwrap(), spp.to_string());
    let usual = ["render", "-q", "--spp", &spp, "-o", "x.exr", toml.to_str().unwrap()];
    done(folder.path(), &[&usual, flags].concat());
    read_rgb(&folder.path().join("x.exr"))
}

fn assert_means(what: &str, image: &[Vec<f32>; 3], reference: &[Vec<f32>; 3], tolerance: f64) {
    for c in 0..3 {
        let mean = |x: &[f32]| x.iter().map(|&v| v as f64).sum::<f64>() / x.len() as f64;
        let ratio = mean(&image[c]) / mean(&reference[c]);
        println!("{what}: channel {c} has {ratio:.5} of the reference's mean");
        assert!(
            (ratio - 1.0).abs() < tolerance,
            "{what}: channel {c} has {ratio} of the reference's mean"
        );
    }
}

/// Renders `toml` with three increasing numbers of independent samples. Fails unless relMSE falls
/// as 1/spp, and the render with most samples has the mean of the reference (4096 samples).
///
/// Two more renders use the default sampler: first without path reuse, then with path reuse. Each
/// must have the mean of the reference. Its relMSE must be below `factors` times the relMSE of the
/// same number of independent samples. Means agree within `tolerance`. `flags` are added to each
/// render.
fn assert_converges(toml: &Path, flags: &[&str], reference: &[Vec<f32>; 3], (tolerance, factors): (f64, [f64; 2])) {
    let counts = [8, 32, 128].map(budget);
    let plain = [flags, &["--sampler", "independent", "--reuse", "none"]].concat();
    let images = counts.map(|spp| render(toml, spp, &plain));
    assert_means("most samples", &images[2], reference, tolerance);

    // The error of independent samples falls as 1/spp. The error of the reference is subtracted
    // before the slope is fitted in logarithms.
    let raw = images.map(|image| rel_mse(&image, reference));
    println!("relMSE at {counts:?} spp: {raw:.5?}");
    let floor = raw[2] / (4096.0 / f64::from(counts[2]) + 1.0);
    let points: Vec<(f64, f64)> = counts
        .iter()
        .zip(raw)
        .map(|(&n, e)| ((n as f64).ln(), (e - floor).max(1e-12).ln()))
        .collect();
    let (mx, my) = (
        points.iter().map(|p| p.0).sum::<f64>() / points.len() as f64,
        points.iter().map(|p| p.1).sum::<f64>() / points.len() as f64,
    );
    let slope = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>()
        / points.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>();
    println!("slope {slope:.3}");
    assert!((slope + 1.0).abs() < 0.05, "relMSE {raw:?} falls as spp^{slope}");

    for (more, max) in [&["--reuse", "none"][..], &[]].into_iter().zip(factors) {
        let image = render(toml, counts[1], &[flags, more].concat());
        assert_means(&format!("{more:?}"), &image, reference, tolerance);
        let error = rel_mse(&image, reference);
        println!(
            "{more:?}: relMSE {error:.5}, {:.3} of independent samples",
            error / raw[1]
        );
        assert!(
            error < max * raw[1],
            "{more:?}: relMSE {error} against {} of independent samples",
            raw[1]
        );
    }
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn own_cornell_box_converges() {
    let toml = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box.toml");
    let flags = ["--size", "128x128", "--denoise=off"];
    let independent = ["--sampler", "independent", "--reuse", "none", "--seed", "1"];
    let reference = render(&toml, 4096, &[flags.as_slice(), &independent].concat());
    assert_converges(&toml, &flags, &reference, (0.01, [0.9, 0.2]));
}

#[test]
#[cfg_attr(not(shared), ignore = "needs ../shared")]
#[cfg_attr(all(shared, not(long)), ignore = "long")]
fn cornell_converges_to_the_reference() {
    let folder = shared("suite/cornell");
    // Use only the rows from the lamp to the front of the floor. The other half of the rows adds no
    // information about errors.
    const ROWS: Range<usize> = 128..384;
    let crop = format!("0,{},{WIDTH},{}", ROWS.start, ROWS.end);
    let reference = read_rgb(&folder.join("reference.exr"));
    let reference = reference.map(|channel| channel[ROWS.start * WIDTH..ROWS.end * WIDTH].to_vec());
    assert_converges(
        &folder.join("cornell.toml"),
        &["--crop", &crop],
        &reference,
        (0.003, [0.8, 0.15]),
    );
}

#[test]
#[cfg_attr(not(shared), ignore = "needs ../shared")]
#[cfg_attr(all(shared, not(long)), ignore = "long")]
fn hall_and_sponza_have_the_reference_means() {
    for name in ["hall", "sponza"] {
        let folder = shared(&format!("suite/{name}"));
        let reference = read_rgb(&folder.join("reference.exr"));
        let image = render(&folder.join(format!("{name}.toml")), budget(16), &[]);
        // Many small lights cause fireflies: the mean of 16 samples has an error of about 0.15 %,
        // of 4 samples 0.3 %.
        assert_means(name, &image, &reference, 0.006);
    }
}
