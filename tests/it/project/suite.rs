//! The comparison suite: means against converged references, and convergence.
#![cfg(feature = "embree")]

use crate::support::program::{done, folder};
use crate::support::{budget, read_rgb, rel_mse, shared};
use std::ops::Range;
use std::path::Path;

/// Columns of the suite's pictures.
const WIDTH: usize = 512;

/// Renders `toml` and reads the picture.
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

#[test]
#[cfg_attr(not(shared), ignore = "needs ../shared")]
#[cfg_attr(all(shared, not(long)), ignore = "long")]
fn cornell_converges_to_the_reference() {
    let folder = shared("suite/cornell");
    // The rows between the lamp and the front of the floor: the other half tells no more of errors.
    const ROWS: Range<usize> = 128..384;
    let crop = format!("0,{},{WIDTH},{}", ROWS.start, ROWS.end);
    let toml = folder.join("cornell.toml");
    let reference = read_rgb(&folder.join("reference.exr"));
    let reference = reference.map(|channel| channel[ROWS.start * WIDTH..ROWS.end * WIDTH].to_vec());
    let counts = [8, 32, 128].map(budget);
    let plain = ["--crop", &crop, "--sampler", "independent", "--reuse", "none"];
    let images = counts.map(|spp| render(&toml, spp, &plain));
    assert_means("most samples", &images[2], &reference, 0.003);

    // The error of independent samples falls as 1/spp. The reference has 4096 samples and an error of its own, which is taken out before the slope is
    // fitted in logarithms.
    let raw = images.map(|image| rel_mse(&image, &reference));
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

    // Stratified samples, and then paths that are shared, have the same mean and less error.
    for (flags, max) in [
        (&["--crop", &crop, "--reuse", "none"][..], 0.8),
        (&["--crop", &crop], 0.15),
    ] {
        let image = render(&toml, counts[1], flags);
        assert_means(&format!("{flags:?}"), &image, &reference, 0.003);
        let error = rel_mse(&image, &reference);
        println!("{flags:?}: relMSE {error:.5}");
        assert!(
            error < max * raw[1],
            "{flags:?}: relMSE {error} against {} of independent samples",
            raw[1]
        );
    }
}

#[test]
#[cfg_attr(not(shared), ignore = "needs ../shared")]
#[cfg_attr(all(shared, not(long)), ignore = "long")]
fn hall_and_sponza_have_the_means_of_their_references() {
    for name in ["hall", "sponza"] {
        let folder = shared(&format!("suite/{name}"));
        let reference = read_rgb(&folder.join("reference.exr"));
        let image = render(&folder.join(format!("{name}.toml")), budget(16), &[]);
        // Fireflies of many small lights: the mean of 16 samples is good to some 0.15 %, of 4 to 0.3 %.
        assert_means(name, &image, &reference, 0.006);
    }
}
