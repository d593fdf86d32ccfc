use super::*;
use crate::color::srgb;
use crate::texture::samples::{Curve, LARGEST};

const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror];

/// Pseudorandom numbers in [0, 1).
fn noise(n: usize) -> impl Iterator<Item = f32> {
    let step = |i: usize| (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
    (0..n).map(move |i| step(i) as f32 / (1 << 24) as f32)
}

fn bytes(width: usize, height: usize, channels: usize, curve: Curve, wrap: Wrap) -> Texture {
    let codes = noise(width * height * channels).map(|v| (v * 256.0) as u8).collect();
    Texture::new(width, height, channels, Texels::Bytes(codes, curve), wrap).unwrap()
}

fn floats(width: usize, height: usize, wrap: Wrap, texel: impl Fn(usize, usize) -> f32) -> Texture {
    let texels = (0..width * height).map(|i| texel(i % width, i / width)).collect();
    Texture::new(width, height, 1, Texels::Floats(texels), wrap).unwrap()
}

/// Textures of all kinds of samples, with 1 to 4 channels.
fn assortment(wrap: Wrap) -> Vec<Texture> {
    let (width, height) = (13, 6);
    let mut all = Vec::new();
    for channels in 1..=4 {
        let n = width * height * channels;
        for texels in [
            Texels::Bytes(noise(n).map(|v| (v * 256.0) as u8).collect(), Curve::Srgb),
            Texels::Bytes(noise(n).map(|v| (v * 256.0) as u8).collect(), Curve::Linear),
            Texels::Shorts(noise(n).map(|v| (v * 65536.0) as u16).collect(), Curve::Linear),
            Texels::Shorts(noise(n).map(|v| (v * 65536.0) as u16).collect(), Curve::Srgb),
            Texels::Floats(noise(n).map(|v| (v * 256.0).floor() / 256.0).collect()),
            Texels::Floats(noise(n).collect()),
        ] {
            all.push(Texture::new(width, height, channels, texels, wrap).unwrap());
        }
    }
    assert!(matches!(all[4].samples, Samples::Halves(_)) && matches!(all[5].samples, Samples::Floats(_)));
    all
}

#[test]
fn lookups_of_a_ramp_are_linear() {
    // Texel centres lie at (i + ½) / n, so the texture is a ramp: u + 2 (1 − v).
    let (w, h) = (16, 8);
    let place = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
    let texture = floats(w, h, Wrap::Clamp, |x, y| place(x, w) + 2.0 * place(y, h));
    for k in 0..400 {
        let uv = Vec2::new(0.07 + 0.002 * k as f32, 0.1 + 0.002 * ((k * 7) % 400) as f32);
        let expected = uv.x + 2.0 * (1.0 - uv.y);
        assert!((texture.value(uv, 0.0) - expected).abs() < 1e-5, "{uv}");
        let gradient = texture.gradient(uv, 0.0);
        if uv.min_element() > 0.13 && uv.max_element() < 0.87 {
            assert!(gradient.distance(Vec2::new(1.0, -2.0)) < 1e-4, "{uv}: {gradient}");
        }
    }
    // At this distance from the border, coarser levels have the same ramp. These footprints are
    // between 1 and 2 texels wide.
    let uv = Vec2::new(0.4, 0.55);
    for footprint in [0.13, 0.2, 0.249] {
        assert!((texture.value(uv, footprint) - 1.3).abs() < 1e-5, "{footprint}");
        assert!(texture.gradient(uv, footprint).distance(Vec2::new(1.0, -2.0)) < 1e-4);
    }
}

#[test]
fn constants_stay_constant() {
    for code in [0, 1, 77, 128, 254, 255] {
        for curve in [Curve::Linear, Curve::Srgb] {
            for channels in 1..=4 {
                let texels = Texels::Bytes(vec![code; 7 * 5 * channels], curve);
                let texture = Texture::new(7, 5, channels, texels, Wrap::Mirror).unwrap();
                let encoded = code as f32 / 255.0;
                let value = if curve == Curve::Srgb {
                    srgb::decode(encoded)
                } else {
                    encoded
                };
                for (u, footprint) in noise(50).zip(noise(90).skip(40)) {
                    let uv = Vec2::new(5.0 * u, 0.3 - u);
                    let footprint = 4.0 * footprint;
                    assert_eq!(texture.color(uv, footprint), Spectrum::splat(value));
                    assert!((texture.value(uv, footprint) - value).abs() < 1e-6);
                    let alpha = if channels % 2 == 0 { encoded } else { 1.0 };
                    assert_eq!(texture.alpha(uv, footprint), alpha);
                    assert!(texture.gradient(uv, footprint).length() < 1e-4);
                }
            }
        }
    }
    for value in [0.3, 1.0, 5e4, 1e30, LARGEST] {
        let texture = floats(7, 5, Wrap::Repeat, |_, _| value);
        for (u, footprint) in noise(50).zip(noise(90).skip(40)) {
            let got = texture.value(Vec2::new(u, 2.0 * u), 4.0 * footprint);
            assert!((got / value - 1.0).abs() < 1e-6 && got <= value, "{got}, not {value}");
        }
    }
}

#[test]
fn checkerboards_turn_grey_in_linear_light() {
    for (curve, step) in [(Curve::Srgb, 0.003), (Curve::Linear, 0.002)] {
        let codes = (0..64 * 64)
            .map(|i| if (i + i / 64) % 2 == 0 { 255 } else { 0 })
            .collect();
        let texture = Texture::new(64, 64, 1, Texels::Bytes(codes, curve), Wrap::Repeat).unwrap();
        for level in 1..=6 {
            let grey = texture.value(Vec2::new(0.37, 0.91), (1 << level) as f32 / 64.0);
            // Tolerance: half a step of the 8-bit code
            assert!((grey - 0.5).abs() <= step, "{curve:?} level {level}: {grey}");
        }
    }
}

/// Lookups equal interpolated texels of an infinite plane, which repeats the picture by the
/// definition of the wrap mode.
#[test]
fn lookups_equal_the_definition_of_wrap_modes() {
    for wrap in WRAPS {
        let (w, h) = (5i64, 3i64);
        let texels: Vec<f32> = noise(15).collect();
        let texture = floats(5, 3, wrap, |x, y| texels[y * 5 + x]);
        let index = |i: i64, n: i64| match wrap {
            Wrap::Repeat => i.rem_euclid(n),
            Wrap::Clamp => i.clamp(0, n - 1),
            Wrap::Mirror => i.rem_euclid(2 * n).min(2 * n - 1 - i.rem_euclid(2 * n)),
        };
        let texel = |x: i64, y: i64| texels[(index(y, h) * w + index(x, w)) as usize] as f64;
        for (a, b) in noise(2000).zip(noise(3000).skip(1000)) {
            let uv = Vec2::new(8.0 * a - 4.0, 8.0 * b - 4.0);
            let (px, py) = (uv.x as f64 * w as f64 - 0.5, (1.0 - uv.y as f64) * h as f64 - 0.5);
            let (x, y) = (px.floor(), py.floor());
            let (fx, fy) = (px - x, py - y);
            let row = |y| texel(x as i64, y) * (1.0 - fx) + texel(x as i64 + 1, y) * fx;
            let expected = row(y as i64) * (1.0 - fy) + row(y as i64 + 1) * fy;
            let got = texture.value(uv, 0.0) as f64;
            assert!((got - expected).abs() < 1e-5, "{wrap:?} {uv}: {got}, not {expected}");
        }
    }
}

#[test]
fn lookups_are_continuous_between_levels() {
    for wrap in WRAPS {
        for texture in assortment(wrap) {
            for (a, b) in noise(40).zip(noise(80).skip(40)) {
                let uv = Vec2::new(a, b);
                for level in 0..4 {
                    // Footprint of 2ᵏ texels, along the shorter side
                    let footprint = (1 << level) as f32 / 6.0;
                    let at = |scale: f32| texture.color(uv, footprint * scale);
                    let jump = (at(1.0 + 1e-5) - at(1.0 - 1e-5)).to_array();
                    assert!(jump.iter().all(|j| j.abs() < 1e-4), "{wrap:?} {uv} {level}: {jump:?}");
                    let gradient = |scale: f32| texture.gradient(uv, footprint * scale);
                    let jump = gradient(1.0 + 1e-5) - gradient(1.0 - 1e-5);
                    assert!(jump.length() < 1e-2, "{wrap:?} {uv} {level}: {jump}");
                }
                // A footprint half way between the footprints of two levels gives the mean of both
                // levels.
                let at = |texels: f32| texture.alpha(uv, texels / 6.0) as f64;
                assert!((at(3.0) - 0.5 * (at(2.0) + at(4.0))).abs() < 1e-6);
            }
        }
    }
}

#[test]
fn the_top_row_of_a_picture_is_at_v_1() {
    let texels = Texels::Bytes(vec![10, 20, 30, 40, 50, 60], Curve::Linear);
    let texture = Texture::new(3, 2, 1, texels, Wrap::Repeat).unwrap();
    for (i, code) in [10.0, 20.0, 30.0, 40.0, 50.0, 60.0f32].into_iter().enumerate() {
        let uv = Vec2::new(((i % 3) as f32 + 0.5) / 3.0, if i < 3 { 0.75 } else { 0.25 });
        let got = texture.value(uv, 0.0) * 255.0;
        assert!((got - code).abs() < 1e-3, "{uv}: {got}, not {code}");
    }
    // From texel to texel, codes rise by 10 to the right and fall by 30 upwards. The gradient is
    // computed from the values at both sides of the point.
    let gradient = texture.gradient(Vec2::new(0.5, 0.5), 0.0) * 255.0;
    assert!(gradient.distance(Vec2::new(30.0, -60.0)) < 1e-2, "{gradient}");
}

#[test]
fn the_largest_heights_have_finite_slopes() {
    for wrap in WRAPS {
        let texture = floats(64, 2, wrap, |x, _| if x % 2 == 0 { LARGEST } else { 0.0 });
        let slope = |x| texture.gradient(Vec2::new(x as f32 / 64.0, 0.5), 0.0);
        assert!((0..64).all(|x| slope(x).is_finite()));
        assert!(
            slope(5).x == f32::MIN && slope(6).x == f32::MAX,
            "{} {}",
            slope(5),
            slope(6)
        );
    }
}

#[test]
fn lookups_at_invalid_positions_are_finite() {
    let odd = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        f32::MIN,
        1e9,
        -1e9,
        16_777_217.3,
        -1e-40,
        -7.3,
        0.0,
        1.0,
    ];
    for wrap in WRAPS {
        for texture in assortment(wrap) {
            for u in odd {
                for v in odd {
                    for footprint in odd {
                        let uv = Vec2::new(u, v);
                        let color = texture.color(uv, footprint);
                        assert!(
                            color.is_valid() && color.max_component() <= 1.0,
                            "{uv} {footprint}: {color:?}"
                        );
                        assert!((0.0..=1.0).contains(&texture.value(uv, footprint)));
                        assert!((0.0..=1.0).contains(&texture.alpha(uv, footprint)));
                        assert!(texture.normal(uv, footprint).is_finite());
                        assert!(texture.gradient(uv, footprint).is_finite());
                    }
                }
            }
        }
    }
}

#[test]
fn the_coarsest_level_is_the_mean() {
    // Compare with the mean of the colours, weighted by alpha
    for texture in assortment(Wrap::Repeat) {
        let (w, h) = texture.size();
        let (mut sum, mut alphas) = ([0.0f64; 3], 0.0);
        for i in 0..w * h {
            let uv = Vec2::new((i % w) as f32 + 0.5, (i / w) as f32 + 0.5) / Vec2::new(w as f32, h as f32);
            let alpha = texture.alpha(uv, 0.0) as f64;
            let weight = if texture.has_alpha() { alpha + 1.0 / 1024.0 } else { 1.0 };
            alphas += weight;
            for (s, v) in sum.iter_mut().zip(texture.color(uv, 0.0).to_array()) {
                *s += weight * v as f64;
            }
        }
        let mean = texture.color(Vec2::ZERO, f32::INFINITY).to_array();
        // Tolerance: half a step of 8 bits
        let max = if matches!(texture.samples, Samples::Bytes(..)) {
            0.004
        } else {
            3e-4
        };
        for (m, s) in mean.iter().zip(sum) {
            assert!((*m as f64 - s / alphas).abs() < max, "{m}, not {}", s / alphas);
        }
    }
}

#[test]
fn storage_is_compact() {
    let third = |texture: &Texture, bytes: usize| {
        let n = bytes * 256 * 128;
        let got = texture.bytes();
        assert!(got >= n && got <= n * 4 / 3 + 4 * bytes, "{got} of {n}");
    };
    for channels in 1..=4 {
        third(&bytes(256, 128, channels, Curve::Srgb, Wrap::Repeat), channels);
    }
    third(&floats(256, 128, Wrap::Repeat, |x, _| x as f32), 2);
    third(&floats(256, 128, Wrap::Repeat, |x, _| 0.1 * x as f32), 4);
}

#[test]
fn invalid_samples_become_0_and_are_counted() {
    let texels = vec![
        0.5,
        f32::NAN,
        2.0,
        -1.0,
        f32::INFINITY,
        -0.0,
        1.0,
        1.0,
        7.0,
        0.0,
        0.0,
        3.0,
    ];
    let texture = Texture::new(3, 1, 4, Texels::Floats(texels), Wrap::Clamp).unwrap();
    assert_eq!(texture.replaced_texels(), 2);
    assert_eq!(texture.max_value(), 7.0);
    assert!(!texture.is_reflectance());
    let at = |x: f32| texture.color(Vec2::new((x + 0.5) / 3.0, 0.5), 0.0).to_array();
    assert_eq!((at(0.0), at(1.0)), ([0.5, 0.0, 2.0], [0.0, 0.0, 1.0]));
    assert_eq!(texture.alpha(Vec2::new(0.99, 0.5), 0.0), 1.0);
    assert!(bytes(3, 3, 3, Curve::Srgb, Wrap::Clamp).is_reflectance());
    let veiled = Texture::new(1, 1, 2, Texels::Floats(vec![0.5, 1.0]), Wrap::Clamp).unwrap();
    assert_eq!(veiled.max_value(), 0.5);
}

#[test]
fn number_of_samples_must_match_the_size() {
    let picture = |w, h, c, n| Texture::new(w, h, c, Texels::Shorts(vec![0; n], Curve::Linear), Wrap::Repeat).is_some();
    assert!(picture(3, 2, 2, 12));
    assert!(!picture(3, 2, 2, 11) && !picture(0, 2, 2, 0) && !picture(3, 2, 0, 0) && !picture(1, 1, 5, 5));
    assert!(!picture(usize::MAX, 2, 2, 12));
}

#[test]
fn normals_point_up_in_the_middle_of_the_codes() {
    let texels = Texels::Bytes(vec![255, 0, 51], Curve::Linear);
    let texture = Texture::new(1, 1, 3, texels, Wrap::Repeat).unwrap();
    let expected = Vec3::new(1.0, -1.0, -0.6);
    assert!(texture.normal(Vec2::ZERO, 0.0).distance(expected) < 1e-6);
    assert_eq!(
        bytes(2, 2, 1, Curve::Linear, Wrap::Repeat).normal(Vec2::ZERO, 0.0),
        Vec3::Z
    );
}
