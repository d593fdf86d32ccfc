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
/// `samples` holds the picture of `size` texels (columns, rows). A texel has `channels` samples, 1
/// to 4. If there are two or four, the last sample is alpha. `decode` and `encode` take the index
/// of a channel: `decode` converts a sample to a linear value, and `encode` converts a value to a
/// sample. A coarse texel is the mean of the finer texels that it covers, computed from unrounded
/// values. Colours are weighted by their alpha, because a transparent texel is not visible.
pub(super) fn append<T: Copy>(
    samples: &mut Vec<T>,
    size: (usize, usize),
    channels: usize,
    decode: impl Fn(usize, T) -> f32,
    encode: impl Fn(usize, f32) -> T,
) -> Vec<Level> {
    match channels {
        1 => append_texels::<T, 1>(samples, size, decode, encode),
        2 => append_texels::<T, 2>(samples, size, decode, encode),
        3 => append_texels::<T, 3>(samples, size, decode, encode),
        _ => append_texels::<T, 4>(samples, size, decode, encode),
    }
}

/// Appends the coarser levels as [`append`] does. The number of channels is a constant, so that the
/// loops over channels are unrolled.
fn append_texels<T: Copy, const N: usize>(
    samples: &mut Vec<T>,
    size: (usize, usize),
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
    samples.reserve_exact(rest * N);

    let mut levels = vec![level(0, size)];
    let mut plane: Vec<[f32; N]> = Vec::new();
    for pair in sizes.windows(2) {
        let width = pair[0].0;
        plane = if levels.len() == 1 {
            let read = |y: usize, texels: &mut [[f32; N]]| {
                let row = samples[y * width * N..][..width * N].chunks_exact(N);
                for (texel, samples) in texels.iter_mut().zip(row) {
                    *texel = weighed(std::array::from_fn(|c| decode(c, samples[c])));
                }
            };
            halved(pair[0], read)
        } else {
            halved(pair[0], |y, texels| {
                texels.copy_from_slice(&plane[y * width..][..width])
            })
        };
        levels.push(level(samples.len(), pair[1]));
        for texel in &plane {
            samples.extend((0..N).map(|c| encode(c, unweighed(texel, c))));
        }
    }
    levels
}

/// Size of the next level; odd sizes are rounded down.
fn half((width, height): (usize, usize)) -> (usize, usize) {
    ((width / 2).max(1), (height / 2).max(1))
}

/// The texel with its colours multiplied by its weight, and with the weight instead of alpha. A
/// texel without alpha does not change.
fn weighed<const N: usize>(texel: [f32; N]) -> [f32; N] {
    if N % 2 == 1 {
        return texel;
    }
    let weight = texel[N - 1] + MIN_WEIGHT;
    std::array::from_fn(|c| if c + 1 == N { weight } else { texel[c] * weight })
}

/// Channel `c` of a texel after [`weighed`] is undone: a colour divided by the weight, or alpha.
fn unweighed<const N: usize>(texel: &[f32; N], c: usize) -> f32 {
    if N % 2 == 1 {
        return texel[c];
    }
    let weight = texel[N - 1];
    if c + 1 == N {
        (weight - MIN_WEIGHT).max(0.0)
    } else {
        texel[c] / weight
    }
}

/// Returns the picture of half the size. Each texel is a weighted mean of two or three columns and
/// rows. `read` fills in a row of the larger picture.
fn halved<const N: usize>(size: (usize, usize), read: impl Fn(usize, &mut [[f32; N]])) -> Vec<[f32; N]> {
    let (width, height) = half(size);
    let add = |sum: &mut [f32; N], weight: f32, texel: &[f32; N]| {
        for (s, v) in sum.iter_mut().zip(texel) {
            *s += weight * v;
        }
    };
    let mut plane = Vec::with_capacity(width * height);
    let mut row = vec![[0.0; N]; size.0];
    let mut sum = row.clone();
    for y in 0..height {
        sum.fill([0.0; N]);
        for (from, weight) in taps(size.1, y) {
            read(from, &mut row);
            sum.iter_mut().zip(&row).for_each(|(s, v)| add(s, weight, v));
        }
        plane.extend((0..width).map(|x| {
            let mut texel = [0.0; N];
            for (from, weight) in taps(size.0, x) {
                add(&mut texel, weight, &sum[from]);
            }
            texel
        }));
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
