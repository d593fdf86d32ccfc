//! Light that is too bright for filters: lamps in view, and other bright pixels without noise.
//!
//! Filters change such light by a few percent or more, and spread it to other pixels. Beside
//! surfaces of radiance 1, Open Image Denoise made a lamp of radiance 10⁴ darker by 3 %, and a lamp
//! of 10⁶ brighter by 24 %. Its network has logarithms of radiance as input. A blur spreads a lamp
//! over its edge: pixels beside a lamp of radiance 10⁶ get 10⁵.
//!
//! Light above a limit is therefore removed from the picture before the filter and added again
//! after it, unless the light is noise. Light is not noise if the first surface emits it, or if it
//! exceeds three standard deviations of the pixel. The limit is [`LIMIT`] times the geometric mean
//! of the picture's luminance. The light of a lamp up to the limit stays in the picture, so the
//! filters still smooth the edges of usual lamps.

use super::layers::Layers;
use crate::color::Spectrum;
use crate::math::Vec3;

/// Limit above which light is removed, relative to the geometric mean of the luminances of the
/// picture. Open Image Denoise changes lamps below this limit by at most 0.1 %.
const LIMIT: f32 = 100.0;
/// Light of a pixel up to this number of standard deviations may be noise.
const NOISE: f32 = 3.0;

/// Removes bright light from `layers` and returns the removed light. `None` if there is no bright
/// light. `emitted` is, for each pixel, the luminance that the first surface or the background
/// emits.
pub(super) fn take_bright(layers: &mut Layers, emitted: Option<&[f32]>) -> Option<Vec<Vec3>> {
    let limit = LIMIT * geometric_mean(layers.color.iter().map(|&c| luminance(c)))?;
    // Returns the fraction of the light of a pixel that is removed, and true if the first surface
    // or the background emits it
    let share = |i: usize| {
        let brightness = luminance(layers.color[i]);
        if brightness <= limit {
            return (0.0, false);
        }
        let variance = layers.variance.as_ref().map_or(f32::INFINITY, |v| luminance(v[i]));
        // With an infinite or NaN variance, all light may be noise, so `certain` is 0.
        let certain = (brightness - NOISE * variance.sqrt()).max(0.0);
        let emitted = emitted.map_or(0.0, |emitted| emitted[i].min(brightness));
        let share = (emitted.max(certain) - limit) / brightness;
        (share.clamp(0.0, 1.0), emitted > limit)
    };
    let shares: Vec<(f32, bool)> = (0..layers.color.len()).map(share).collect();
    if shares.iter().all(|&(share, _)| share == 0.0) {
        return None;
    }
    let lit = layers.color.iter_mut().zip(&shares);
    let bright = lit.map(|(c, &(share, _))| {
        let bright = *c * share;
        *c -= bright;
        bright
    });
    let bright = bright.collect();
    if let Ok(variance) = &mut layers.variance {
        // If the light of a lamp is removed, the noise at the edge of the lamp is removed too.
        let of_lamps = variance.iter_mut().zip(&shares).filter(|(_, (_, emits))| *emits);
        of_lamps.for_each(|(v, _)| *v = Vec3::ZERO);
    }
    Some(bright)
}

fn luminance(value: Vec3) -> f32 {
    Spectrum::rgb(value.x, value.y, value.z).luminance()
}

/// Geometric mean of the positive values; `None` if there are none.
fn geometric_mean(values: impl Iterator<Item = f32>) -> Option<f32> {
    let logarithms = values.filter(|v| *v > 0.0 && v.is_finite()).map(|v| f64::from(v).ln());
    let (sum, count) = logarithms.fold((0.0, 0u64), |(sum, count), v| (sum + v, count + 1));
    (count > 0).then(|| (sum / count as f64).exp() as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::denoise::DenoiseError;

    /// Layers of a row of pixels. Each pixel is given by a luminance and a standard deviation.
    fn layers(pixels: &[[f32; 2]]) -> Layers {
        let missing = DenoiseError::NoChannel("Z");
        Layers {
            size: [pixels.len(), 1],
            color: pixels.iter().map(|p| Vec3::splat(p[0])).collect(),
            variance: Ok(pixels.iter().map(|p| Vec3::splat(p[1] * p[1])).collect()),
            albedo: Err(missing.clone()),
            normal: Err(missing.clone()),
            depth: Err(missing),
            is_light: true,
        }
    }

    #[test]
    fn bright_light_is_removed_from_lamps_but_not_fireflies() {
        let mut pixels = [[1.0, 0.1]; 400];
        pixels[0] = [1e6, 3e5]; // the edge of a lamp
        pixels[1] = [1e6, 1e6]; // a firefly
        pixels[2] = [1e6, 1.0]; // the mirror image of a lamp
        let mut emitted = [0.0; 400];
        emitted[0] = 1e6;
        let mut left = layers(&pixels);
        let bright = take_bright(&mut left, Some(&emitted)).unwrap();
        assert!(bright[0].y > 0.999e6 && bright[1].y == 0.0 && bright[2].y > 0.999e6);
        for (i, (bright, left)) in bright.iter().zip(&left.color).enumerate() {
            assert!(((bright.y + left.y) / pixels[i][0] - 1.0).abs() < 1e-6, "{i}");
            assert!(i == 1 || left.y < 200.0, "{i}: {left}");
        }
    }

    #[test]
    fn pictures_without_bright_light_stay() {
        for pixels in [
            vec![[0.0, 0.0]; 5],
            vec![[1.0, 0.0], [90.0, 0.0]],
            vec![[1.0, f32::INFINITY], [1e9, f32::INFINITY]],
        ] {
            let mut left = layers(&pixels);
            assert!(take_bright(&mut left, None).is_none());
            assert!(left.color.iter().zip(pixels).all(|(c, p)| c.y == p[0]));
        }
    }
}
