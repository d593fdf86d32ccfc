use super::*;
use crate::math::hash::{GOLDEN_GAMMA, mix};

const SIZE: [usize; 2] = [64, 48];

/// A wall with normal +z at depth 2. `albedo` and `light` return a pixel's values by its column.
/// Light has a standard deviation of `noise` times its value.
fn wall(albedo: impl Fn(usize) -> f32, light: impl Fn(usize) -> f32, noise: f32) -> Input {
    let guides = (0..SIZE[0] * SIZE[1])
        .map(|i| Guide {
            normal: Vec3::Z,
            albedo: Vec3::splat(albedo(i % SIZE[0])),
            disparity: 0.5,
            gradient: [0.0; 2],
            divisor: Vec3::splat(albedo(i % SIZE[0]).max(MIN_ALBEDO)),
        })
        .collect();
    let light = (0..SIZE[0] * SIZE[1])
        .map(|i| {
            let value = light(i % SIZE[0]);
            // Uniform in (−1, 1), with variance 1/3.
            let u = (mix((i as u64).wrapping_mul(GOLDEN_GAMMA)) >> 40) as f32 / (1 << 23) as f32 - 1.0;
            let sigma = noise * value;
            FilteredLight {
                value: Vec3::splat(value + sigma * 3f32.sqrt() * u),
                variance: sigma * sigma,
            }
        })
        .collect::<Vec<FilteredLight>>();
    Input {
        size: SIZE,
        guides,
        raw: light.iter().map(|light| luminance(light.value)).collect(),
        light,
    }
}

/// Mean and variance of the green channel over all pixels in `columns`.
fn moments(picture: &[Vec3], columns: std::ops::Range<usize>) -> (f64, f64) {
    let values = || {
        let inside = |(i, v): (usize, &Vec3)| columns.contains(&(i % SIZE[0])).then_some(v.y as f64);
        picture.iter().enumerate().filter_map(inside)
    };
    let n = values().count() as f64;
    let mean = values().sum::<f64>() / n;
    (mean, values().map(|v| (v - mean).powi(2)).sum::<f64>() / n)
}

#[test]
fn constants_stay() {
    // Uniform light stays uniform under a texture. The test has a tolerance, because the product of
    // light and albedo is rounded again.
    let texture = |x: usize| [0.05, 0.8, 0.3][x % 3];
    let picture = denoise(wall(texture, |_| 7.0, 0.0));
    for (i, v) in picture.iter().enumerate() {
        let expected = 7.0 * texture(i % SIZE[0]);
        assert!((v.y / expected - 1.0).abs() < 1e-6, "{i}: {v} instead of {expected}");
    }
}

#[test]
fn noise_on_a_wall_falls_fiftyfold() {
    let (mean, variance) = moments(&denoise(wall(|_| 0.5, |_| 1.0, 0.3)), 0..SIZE[0]);
    let before = 0.15f64.powi(2);
    println!("variance {before:.3e} becomes {variance:.3e}, mean {mean:.4}");
    assert!(variance < before / 50.0, "{before:.3e} became {variance:.3e}");
    assert!((mean / 0.5 - 1.0).abs() < 0.02, "mean {mean}");
}

/// One of 53 pixels has a bright sample, and a variance that includes this sample. After the
/// reduction of outliers, the total light is unchanged and the denoised picture is smooth.
#[test]
fn fireflies_leave_no_blotches() {
    let mut input = wall(|_| 0.5, |_| 1.0, 0.1);
    let before: f32 = input.light.iter().map(|light| light.value.y).sum();
    let mut added = 0.0;
    for i in (7..SIZE[0] * SIZE[1]).step_by(53) {
        input.light[i].value += Vec3::splat(40.0);
        input.light[i].variance = 1600.0;
        added += 40.0;
    }
    input.raw = input.light.iter().map(|light| luminance(light.value)).collect();
    let light = without_outliers(&input.guides, &input.light, SIZE);
    let after: f32 = light.iter().map(|light| light.value.y).sum();
    assert!(
        (after / (before + added) - 1.0).abs() < 1e-3,
        "{after} of {}",
        before + added
    );
    input.light = with_mean_variance(&input.guides, &light, SIZE);
    let (mean, variance) = moments(&denoise(input), 0..SIZE[0]);
    println!("mean {mean:.4}, standard deviation {:.4}", variance.sqrt());
    assert!(variance.sqrt() < 0.2 * mean, "{mean} ± {}", variance.sqrt());
}

/// Some rows of pixels are on the edge of a lamp. Their guides differ from the guides of the
/// neighbours. Their light is random, and their variances include this noise. The filter keeps the
/// mean of the picture.
#[test]
fn light_on_edges_is_not_lost() {
    let mut input = wall(|_| 0.5, |_| 1.0, 0.1);
    for i in (0..SIZE[0] * SIZE[1]).filter(|i| i / SIZE[0] % 12 == 5) {
        input.guides[i].normal = Vec3::new(0.7, 0.0, 0.7);
        let is_bright = mix((i as u64 + 9).wrapping_mul(GOLDEN_GAMMA)) >> 62 == 0;
        let value = if is_bright { 40.0 } else { 0.0 };
        input.light[i] = FilteredLight {
            value: Vec3::splat(value),
            variance: value * value,
        };
    }
    input.raw = input.light.iter().map(|light| luminance(light.value)).collect();
    let before = input.raw.iter().sum::<f32>() as f64 / input.raw.len() as f64;
    let light = without_outliers(&input.guides, &input.light, SIZE);
    input.light = with_mean_variance(&input.guides, &light, SIZE);
    let (mean, _) = moments(&denoise(input), 0..SIZE[0]);
    assert!((mean / (0.5 * before) - 1.0).abs() < 0.02, "{mean} of {}", 0.5 * before);
}

#[test]
fn highlights_of_many_samples_stay() {
    let mut input = wall(|_| 0.5, |_| 1.0, 0.1);
    let spot = 20 * SIZE[0] + 20;
    input.light[spot].value = Vec3::splat(30.0);
    let light = without_outliers(&input.guides, &input.light, SIZE);
    assert!(light[spot].value.y > 29.0, "{}", light[spot].value);
}

#[test]
fn edges_stay_sharp() {
    // An edge of albedo, and an edge of light far above the noise. Both sides of the edge keep
    // their means.
    let edge = |x: usize| if x < 30 { 0.8 } else { 0.1 };
    let pictures = [
        (wall(edge, |_| 1.0, 0.1), 1.0),
        (wall(|_| 1.0, |x| 20.0 * edge(x), 0.1), 20.0),
    ];
    for (input, scale) in pictures {
        let picture = denoise(input);
        for x in [28, 29, 30, 31] {
            let (mean, _) = moments(&picture, x..x + 1);
            let expected = scale * edge(x) as f64;
            assert!(
                (mean / expected - 1.0).abs() < 0.05,
                "column {x}: {mean} instead of {expected}"
            );
        }
    }
    // Edges of normals and of depths, with a small difference of light
    let light = |x: usize| if x < 30 { 1.0 } else { 0.7 };
    let turned = |g: &mut Guide| g.normal = Vec3::X;
    let behind = |g: &mut Guide| g.disparity = 0.25;
    for change in [&turned as &dyn Fn(&mut Guide), &behind] {
        let mut input = wall(|_| 1.0, light, 0.1);
        let columns = input.guides.iter_mut().enumerate();
        columns.filter(|(i, _)| i % SIZE[0] >= 30).for_each(|(_, g)| change(g));
        let picture = denoise(input);
        for x in [29, 30] {
            let (mean, _) = moments(&picture, x..x + 1);
            let expected = light(x) as f64;
            assert!(
                (mean / expected - 1.0).abs() < 0.05,
                "column {x}: {mean} instead of {expected}"
            );
        }
    }
}

#[test]
fn slanted_plane_is_not_an_edge() {
    // The disparity of a plane is linear in the picture, so `gradient` is exact in every pixel.
    let disparity: Vec<f32> = (0..SIZE[0] * SIZE[1])
        .map(|i| 0.1 + 0.02 * (i % SIZE[0]) as f32 + 0.01 * (i / SIZE[0]) as f32)
        .collect();
    let mut input = wall(|_| 0.5, |_| 1.0, 0.3);
    for (i, guide) in input.guides.iter_mut().enumerate() {
        guide.disparity = disparity[i];
        guide.gradient = gradient(&disparity, SIZE, i);
        assert!((guide.gradient[0] - 0.02).abs() < 1e-5 && (guide.gradient[1] - 0.01).abs() < 1e-5);
    }
    let (_, variance) = moments(&denoise(input), 0..SIZE[0]);
    assert!(variance < 0.15f64.powi(2) / 50.0, "{variance:.3e}");
}

#[test]
fn variance_around_a_pixel_is_the_noise_variance() {
    let Input { light, .. } = wall(|_| 0.5, |_| 1.0, 0.3);
    let mean = (0..light.len())
        .map(|i| variance_around(&light, SIZE, i) as f64)
        .sum::<f64>()
        / light.len() as f64;
    assert!((mean / 0.09 - 1.0).abs() < 0.05, "{mean}");
}
