//! Numbers as pictures in false colours.

use super::layer::{Layer, LayerKind};
use crate::color::{false_color, srgb};
use crate::film::{Image, Z_BACKGROUND, resample, resample_nearest};
use crate::io::Figure;
use crate::math::hash::{GOLDEN_GAMMA, mix};

/// Fraction of the values at each end that the colour range ignores.
const TRIMMED: f64 = 0.01;
/// Colour of pixels without a value.
const NOTHING: [u8; 3] = [0; 3];

/// Draws the layer of `image`, scaled to `size` if given.
pub(super) fn draw(layer: &Layer, image: &Image, size: Option<[u32; 2]>) -> Figure {
    let channels: Vec<&[f32]> = image.channels.iter().map(|channel| channel.values.as_slice()).collect();
    let pixels = image.crop.area() as usize;
    let vector = |i: usize| -> [f32; 3] { std::array::from_fn(|c| channels.get(c).map_or(0.0, |values| values[i])) };
    let first = || channels.first().map_or(Vec::new(), |values| values.to_vec());
    let length = |i: usize| {
        channels
            .iter()
            .map(|values| f64::from(values[i]).powi(2))
            .sum::<f64>()
            .sqrt() as f32
    };
    let title = layer.title();
    let (colors, legend): (Vec<[u8; 3]>, String) = match layer.kind {
        LayerKind::Normals => {
            let normal = |i| match vector(i) {
                [0.0, 0.0, 0.0] => NOTHING,
                v => v.map(|v| unit_code(0.5 + 0.5 * v)),
            };
            (
                (0..pixels).map(normal).collect(),
                "x, y and z from -1 to 1 as red, green and blue".into(),
            )
        }
        LayerKind::Coordinates => {
            let code = |i| vector(i).map(|v| unit_code(v - v.floor()));
            (
                (0..pixels).map(code).collect(),
                "fractional parts of u and v as red and green".into(),
            )
        }
        LayerKind::Positions => {
            let ranges = [0, 1, 2].map(|c| range(channels.get(c).copied().unwrap_or_default().iter().copied()));
            let code = |i| {
                let v = vector(i);
                [0, 1, 2].map(|c| unit_code(share(v[c], ranges[c])))
            };
            (
                (0..pixels).map(code).collect(),
                "x, y and z, each scaled to its range, as red, green and blue".into(),
            )
        }
        LayerKind::Ids => (
            first().into_iter().map(id_color).collect(),
            "a colour for each id; black for 0".into(),
        ),
        LayerKind::Matte => {
            // Name hash and coverage of the object that covers the largest part of the pixel
            let color = |i| {
                let [name, share, _] = vector(i);
                let amount = f32::max(share, 0.0).min(1.0);
                let hashed = color_of(name.to_bits());
                if name == 0.0 {
                    NOTHING
                } else {
                    hashed.map(|code| (f32::from(code) * amount).round() as u8)
                }
            };
            (
                (0..pixels).map(color).collect(),
                "a colour for each name, of the name that covers most of the pixel; brighter if it covers more".into(),
            )
        }
        LayerKind::Depth => {
            let values = first();
            let [near, far] = range(values.iter().copied().filter(|&z| is_depth(z)));
            let color = |z: f32| {
                if is_depth(z) {
                    false_color::magma(1.0 - 0.9 * share(z, [near, far]))
                } else {
                    NOTHING
                }
            };
            (
                values.into_iter().map(color).collect(),
                format!("colour map magma, bright for {near} and dark for {far}; pixels without a surface are black"),
            )
        }
        LayerKind::Magnitudes => {
            let values: Vec<f32> = (0..pixels).map(length).collect();
            let logs = || values.iter().map(|v| v.log10()).filter(|log| log.is_finite());
            let [low, high] = range(logs());
            let color = |v: &f32| match v.log10() {
                log if log.is_finite() => false_color::magma(share(log, [low, high])),
                log => {
                    if log > 0.0 {
                        [255; 3]
                    } else {
                        NOTHING
                    }
                }
            };
            (
                values.iter().map(color).collect(),
                format!("colour map magma, logarithmic from 10^{low:.2} to 10^{high:.2}"),
            )
        }
        LayerKind::Numbers | LayerKind::Colors | LayerKind::Reflectance => {
            let values = if channels.len() > 1 {
                (0..pixels).map(length).collect()
            } else {
                first()
            };
            let [low, high] = range(values.iter().copied());
            if low < 0.0 {
                let max = high.abs().max(low.abs());
                let color = |v: f32| {
                    if v.is_finite() {
                        false_color::diverging(v / max)
                    } else {
                        NOTHING
                    }
                };
                (
                    values.into_iter().map(color).collect(),
                    format!("blue for -{max}, grey for 0, red for {max}"),
                )
            } else {
                let color = |v: f32| {
                    if v.is_finite() {
                        false_color::magma(share(v, [low, high]))
                    } else {
                        NOTHING
                    }
                };
                (
                    values.into_iter().map(color).collect(),
                    format!("colour map magma from {low} to {high}"),
                )
            }
        }
    };
    let from = image.crop.size().to_array();
    let is_exact = matches!(layer.kind, LayerKind::Ids | LayerKind::Matte);
    let to = size.unwrap_or(from);
    Figure {
        size: to,
        pixels: if to == from {
            colors
        } else {
            scaled(&colors, from, to, is_exact)
        },
        legend: format!("{title}: {legend}"),
    }
}

/// Returns true if the depth belongs to a surface.
fn is_depth(z: f32) -> bool {
    z.is_finite() && z < 0.99 * Z_BACKGROUND
}

fn unit_code(value: f32) -> u8 {
    (f32::max(value, 0.0).min(1.0) * 255.0).round() as u8
}

/// Position of `value` between `low` and `high`, from 0 to 1; 0.5 if both ends are equal.
fn share(value: f32, [low, high]: [f32; 2]) -> f32 {
    if high > low {
        ((value - low) / (high - low)).clamp(0.0, 1.0)
    } else {
        0.5
    }
}

/// Range of the finite values without the fraction [`TRIMMED`] at each end. Zeros if there are no
/// finite values.
fn range(values: impl Iterator<Item = f32>) -> [f32; 2] {
    let mut values: Vec<f32> = values.filter(|v| v.is_finite()).collect();
    values.sort_by(f32::total_cmp);
    let trimmed = (values.len() as f64 * TRIMMED) as usize;
    let at = |i: usize| values.get(i).copied().unwrap_or(0.0);
    [at(trimmed), at(values.len().saturating_sub(1 + trimmed))]
}

fn id_color(id: f32) -> [u8; 3] {
    if id == 0.0 || !id.is_finite() {
        NOTHING
    } else {
        color_of(id.to_bits())
    }
}

/// A colour from a hash, neither dark nor pale.
fn color_of(bits: u32) -> [u8; 3] {
    let hash = mix(u64::from(bits).wrapping_add(1).wrapping_mul(GOLDEN_GAMMA));
    let hue = (hash >> 40) as f32 / (1u32 << 24) as f32 * 6.0;
    let value = 0.65 + 0.35 * ((hash & 0xffff) as f32 / 65535.0);
    // Convert hue, saturation (0.7) and value to red, green and blue
    [5.0f32, 3.0, 1.0].map(|n| {
        let k = (n + hue) % 6.0;
        let dip = 0.7 * k.min(4.0 - k).clamp(0.0, 1.0);
        unit_code(value * (1.0 - dip))
    })
}

/// Scales 8-bit colours from the size `from` to the size `to`. Colours are averaged as linear
/// light. If `is_exact` is true, each pixel has the colour of the nearest pixel instead.
fn scaled(colors: &[[u8; 3]], from: [u32; 2], to: [u32; 2], is_exact: bool) -> Vec<[u8; 3]> {
    let (from, size) = (from.map(|n| n as usize), to.map(|n| n as usize));
    let planes = [0, 1, 2].map(|c| {
        let linear: Vec<f32> = colors
            .iter()
            .map(|color| srgb::decode(f32::from(color[c]) / 255.0))
            .collect();
        if is_exact {
            resample_nearest(&linear, from, size)
        } else {
            resample(&linear, from, size)
        }
    });
    (0..size[0] * size[1])
        .map(|i| [0, 1, 2].map(|c| srgb::encode_u8(planes[c][i])))
        .collect()
}
