//! The coarser levels of a texture (MIP map). Each level is half as wide and high as the level
//! before, down to a single texel.
//!
//! The texels of a level are means of the linear values of the level before. Means are computed
//! from means that are not yet rounded to 8 or 16 bits. If a size is odd, each texel is a mean of
//! three texels, and the triples of neighbouring texels overlap (Guthe and Heckbert 2005). Colours
//! are weighted by alpha. Without these weights, the black texels around a cut-out leaf would
//! darken the leaf in coarse levels.

/// Position and size of one level in the array of all samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Level {
    /// Index of the first sample of the level.
    pub start: usize,
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
}

/// The weight of a colour is its alpha plus this number, so that the mean of fully transparent
/// texels still has a colour.
const MIN_WEIGHT: f32 = 1.0 / 1024.0;

/// Appends the coarser levels of a picture to `samples`. Returns all levels, the finest first.
///
/// `samples` holds the picture of `size` texels (columns, rows). A texel has `channels` samples. If
/// there are two or four, the last sample is alpha. `decode` and `encode` take the index of a
/// channel: `decode` converts a sample to a linear value, and `encode` converts a value to a
/// sample. A coarse texel is the mean of the finer texels that it covers, computed from unrounded
/// values. Colours are weighted by their alpha, because a transparent texel is not visible.
pub(super) fn append<T: Copy>(
    samples: &mut Vec<T>,
    size: (usize, usize),
    channels: usize,
    decode: impl Fn(usize, T) -> f32,
    encode: impl Fn(usize, f32) -> T,
) -> Vec<Level> {
    let level = |start, (width, height)| Level {
        start,
        width: width as u32,
        height: height as u32,
    };
    let sizes: Vec<_> = std::iter::successors(Some(size), |&size| (size != (1, 1)).then(|| half(size))).collect();
    let rest: usize = sizes.iter().skip(1).map(|(width, height)| width * height).sum();
    samples.reserve_exact(rest * channels);

    let mut levels = vec![level(0, size)];
    let mut plane: Vec<f32> = Vec::new();
    for pair in sizes.windows(2) {
        let row_length = pair[0].0 * channels;
        let row = |y: usize| y * row_length..(y + 1) * row_length;
        plane = if levels.len() == 1 {
            let read = |y: usize, values: &mut [f32]| {
                let texels = samples[row(y)].chunks_exact(channels);
                for (texel, values) in texels.zip(values.chunks_exact_mut(channels)) {
                    for (c, (value, &sample)) in values.iter_mut().zip(texel).enumerate() {
                        *value = decode(c, sample);
                    }
                    weigh(values);
                }
            };
            halved(pair[0], channels, read)
        } else {
            halved(pair[0], channels, |y, values| values.copy_from_slice(&plane[row(y)]))
        };
        levels.push(level(samples.len(), pair[1]));
        for texel in plane.chunks_exact(channels) {
            samples.extend((0..channels).map(|c| encode(c, unweighed(texel, c))));
        }
    }
    levels
}

/// Size of the next level; odd sizes are rounded down.
fn half((width, height): (usize, usize)) -> (usize, usize) {
    ((width / 2).max(1), (height / 2).max(1))
}

/// Multiplies the colours of a texel by its weight and replaces alpha by the weight. A texel
/// without alpha does not change.
fn weigh(texel: &mut [f32]) {
    if texel.len() % 2 == 0 {
        if let Some((weight, colors)) = texel.split_last_mut() {
            *weight += MIN_WEIGHT;
            colors.iter_mut().for_each(|color| *color *= *weight);
        }
    }
}

/// Channel `c` of a texel after [`weigh`] is undone: a colour divided by the weight, or alpha.
fn unweighed(texel: &[f32], c: usize) -> f32 {
    match texel.last() {
        Some(&weight) if texel.len() % 2 == 0 && c + 1 == texel.len() => (weight - MIN_WEIGHT).max(0.0),
        Some(&weight) if texel.len() % 2 == 0 => texel[c] / weight,
        _ => texel[c],
    }
}

/// Returns the picture of half the size. Each texel is a weighted mean of two or three columns and
/// rows. `read` fills in a row of the larger picture.
fn halved(size: (usize, usize), channels: usize, read: impl Fn(usize, &mut [f32])) -> Vec<f32> {
    let (width, height) = half(size);
    let mut plane = Vec::with_capacity(width * height * channels);
    let mut row = vec![0.0; size.0 * channels];
    let mut sum = row.clone();
    for y in 0..height {
        sum.fill(0.0);
        for (from, weight) in taps(size.1, y) {
            read(from, &mut row);
            sum.iter_mut().zip(&row).for_each(|(s, v)| *s += weight * v);
        }
        for x in 0..width {
            let start = plane.len();
            plane.resize(start + channels, 0.0);
            for (from, weight) in taps(size.0, x) {
                let fine = &sum[from * channels..][..channels];
                plane[start..].iter_mut().zip(fine).for_each(|(p, v)| *p += weight * v);
            }
        }
    }
    plane
}

/// The texels of a row of `n` texels that are covered by texel `i` of the next level, each with its
/// weight.
///
/// For odd `n` = 2 m + 1, each of the m coarse texels is 2 + 1/m fine texels wide and overlaps
/// three fine texels (Guthe and Heckbert 2005, "Non-Power-of-Two Mipmap Creation"). Over all coarse
/// texels, the weights of each fine texel have the same sum.
fn taps(n: usize, i: usize) -> impl Iterator<Item = (usize, f32)> {
    let m = n / 2;
    let weights = match (n, n % 2) {
        (1, _) => [1.0, 0.0, 0.0],
        (_, 0) => [0.5, 0.5, 0.0],
        _ => [m - i, m, i + 1].map(|share| share as f32 / n as f32),
    };
    let count = if n == 1 { 1 } else { 2 + n % 2 };
    (0..count).map(move |k| (2 * i + k, weights[k]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Levels of floats without any encoding.
    fn floats(samples: &[f32], size: (usize, usize), channels: usize) -> (Vec<f32>, Vec<Level>) {
        let mut samples = samples.to_vec();
        let levels = append(&mut samples, size, channels, |_, v| v, |_, v| v);
        (samples, levels)
    }

    fn noise(n: usize) -> Vec<f32> {
        let step = |i: usize| (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
        (0..n).map(|i| step(i) as f32 / (1 << 24) as f32).collect()
    }

    const SIZES: [(usize, usize); 10] = [
        (1, 1),
        (2, 2),
        (3, 2),
        (5, 7),
        (1, 9),
        (16, 1),
        (31, 33),
        (64, 64),
        (100, 3),
        (127, 255),
    ];

    #[test]
    fn levels_halve_down_to_one_texel_and_keep_the_mean() {
        for size in SIZES {
            let picture = noise(size.0 * size.1 * 3);
            let (samples, levels) = floats(&picture, size, 3);
            let last = levels[levels.len() - 1];
            assert_eq!((last.width, last.height, last.start), (1, 1, samples.len() - 3));
            for (k, level) in levels.iter().enumerate() {
                assert_eq!(level.width as usize, (size.0 >> k).max(1));
                assert_eq!(level.height as usize, (size.1 >> k).max(1));
                let texels = (level.width * level.height) as usize;
                for c in 0..3 {
                    let mean = |samples: &[f32]| {
                        let values = samples.iter().skip(c).step_by(3);
                        values.map(|&v| v as f64).sum::<f64>() / (samples.len() / 3) as f64
                    };
                    let (whole, here) = (mean(&picture), mean(&samples[level.start..][..texels * 3]));
                    assert!((whole - here).abs() < 1e-6, "{size:?} level {k}: {here}, not {whole}");
                }
            }
        }
    }

    /// Expected weight: the area that the coarse and the fine texel have in common.
    #[test]
    fn weights_are_the_common_areas() {
        for n in [2, 3, 5, 8, 9, 41] {
            let coarse = n / 2;
            for i in 0..coarse {
                let mut sum = 0.0;
                for (from, weight) in taps(n, i) {
                    let edge = |j: usize, of: usize| j as f64 / of as f64;
                    let common = edge(i + 1, coarse).min(edge(from + 1, n)) - edge(i, coarse).max(edge(from, n));
                    assert!(
                        (weight as f64 - common * coarse as f64).abs() < 1e-6,
                        "{n}: {i} from {from}"
                    );
                    sum += weight;
                }
                assert!((sum - 1.0).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn levels_take_a_third_of_the_picture() {
        for size in SIZES {
            let (samples, _) = floats(&vec![0.0; size.0 * size.1], size, 1);
            // If one side is a single texel, only the other side is still halved.
            let (long, short) = (size.0.max(size.1), size.0.min(size.1));
            let max = size.0 * size.1 * 4 / 3 + 2 * long / short;
            assert!(samples.len() <= max, "{size:?}: {} of {max}", samples.len());
            assert_eq!(samples.capacity(), samples.len());
        }
    }

    #[test]
    fn colors_are_weighted_by_alpha() {
        // A green leaf, beside a black texel with alpha 0
        let (samples, levels) = floats(&[0.0, 0.8, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0], (2, 1), 4);
        let texel = &samples[levels[1].start..];
        assert!(
            (texel[1] - 0.8).abs() < 1e-3 && (texel[3] - 0.5).abs() < 1e-6,
            "{texel:?}"
        );
        // If alpha is 0 everywhere, all colours have the same weight.
        let (samples, levels) = floats(&[0.2, 0.0, 0.4, 0.0], (1, 2), 2);
        let texel = &samples[levels[1].start..];
        assert!((texel[0] - 0.3).abs() < 1e-6 && texel[1].abs() < 1e-6, "{texel:?}");
    }
}
