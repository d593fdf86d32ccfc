//! Resizing of pictures, channel by channel: averages over areas for smaller pictures, a smooth
//! filter for larger pictures. Rows are resized first, then columns.
//!
//! Enlarging uses the filter of Mitchell and Netravali (1988, "Reconstruction Filters in Computer
//! Graphics") with B = C = 1/3. The filter's negative lobes would ring around lamps, so values are
//! clamped to the range of the values under the filter.

use rayon::prelude::*;

/// Resizes a channel from `size` to `new_size` pixels.
pub fn resample(values: &[f32], size: [usize; 2], new_size: [usize; 2]) -> Vec<f32> {
    let rows = Axis::new(size[0], new_size[0]).apply(values, size[0]);
    let turned = transposed(&rows, new_size[0]);
    let columns = Axis::new(size[1], new_size[1]).apply(&turned, size[1]);
    transposed(&columns, new_size[1])
}

/// Resizes a channel by the nearest pixel, for values that cannot be averaged, such as ids.
pub fn resample_nearest(values: &[f32], size: [usize; 2], new_size: [usize; 2]) -> Vec<f32> {
    let source = |at: usize, axis: usize| {
        let place = (at as f64 + 0.5) * size[axis] as f64 / new_size[axis] as f64;
        (place as usize).min(size[axis].saturating_sub(1))
    };
    let pixel = |i: usize| {
        let (x, y) = (source(i % new_size[0], 0), source(i / new_size[0], 1));
        values.get(y * size[0] + x).copied().unwrap_or(0.0)
    };
    (0..new_size[0] * new_size[1]).map(pixel).collect()
}

/// Transposes rows of `width` values to columns.
fn transposed(values: &[f32], width: usize) -> Vec<f32> {
    let height = values.len() / width.max(1);
    let value = |i: usize| values[i % height * width + i / height];
    (0..values.len()).map(value).collect()
}

/// Resizing of lines: the weights of old values in each new value.
struct Axis {
    is_smaller: bool,
    /// For each new value: the index of the first old value, and the weights of the old values from
    /// this index on. The weights sum to 1.
    taps: Vec<(usize, Vec<f32>)>,
}

impl Axis {
    /// Resizing of lines of `from` values to lines of `to` values.
    fn new(from: usize, to: usize) -> Self {
        let step = from as f64 / to as f64;
        let is_smaller = to < from;
        let taps = (0..to).map(|i| match is_smaller {
            _ if to == from => (i, vec![1.0]),
            true => area(i as f64 * step, (i + 1) as f64 * step, from),
            false => smooth((i as f64 + 0.5) * step - 0.5, from),
        });
        Self {
            is_smaller,
            taps: taps.collect(),
        }
    }

    /// Resizes all lines of `values`. A line has `width` values.
    fn apply(&self, values: &[f32], width: usize) -> Vec<f32> {
        let line = |line: &[f32]| -> Vec<f32> { self.taps.iter().map(|taps| self.value(line, taps)).collect() };
        values.par_chunks(width.max(1)).flat_map_iter(line).collect()
    }

    fn value(&self, line: &[f32], (first, weights): &(usize, Vec<f32>)) -> f32 {
        let seen = line.iter().skip(*first).zip(weights);
        let sum = seen
            .clone()
            .map(|(value, weight)| f64::from(*value) * f64::from(*weight))
            .sum::<f64>() as f32;
        if self.is_smaller {
            return sum;
        }
        let min = seen.clone().map(|(value, _)| *value).fold(f32::INFINITY, f32::min);
        let max = seen.map(|(value, _)| *value).fold(f32::NEG_INFINITY, f32::max);
        // `max` and `min` accept NaN; `clamp` would panic.
        sum.max(min).min(max)
    }
}

/// Weights for the mean of a line between the positions `start` and `end`: the index of the first
/// value, and the weights of the values from this index on.
fn area(start: f64, end: f64, len: usize) -> (usize, Vec<f32>) {
    let first = (start as usize).min(len.saturating_sub(1));
    let last = (end.ceil() as usize).clamp(first + 1, len.max(first + 1));
    let weights =
        (first..last).map(|i| ((end.min(i as f64 + 1.0) - start.max(i as f64)).max(0.0) / (end - start)) as f32);
    (first, weights.collect())
}

/// Weights of the filter at the position `place`: the index of the first value, and the weights of
/// the values from this index on. At a border, only values inside the line have weights.
fn smooth(place: f64, len: usize) -> (usize, Vec<f32>) {
    let middle = place.floor() as i64;
    let first = (middle - 1).max(0) as usize;
    let last = ((middle + 3).max(1) as usize).min(len);
    let weights: Vec<f64> = (first..last).map(|i| mitchell((i as f64 - place).abs())).collect();
    let sum: f64 = weights.iter().sum();
    (first, weights.into_iter().map(|weight| (weight / sum) as f32).collect())
}

/// Value of the filter at a distance of `x` values, without its constant factor (eq. 8 of the
/// paper, B = C = 1/3).
fn mitchell(x: f64) -> f64 {
    if x < 1.0 {
        (7.0 * x - 12.0) * x * x + 16.0 / 3.0
    } else if x < 2.0 {
        ((-7.0 / 3.0 * x + 12.0) * x - 20.0) * x + 32.0 / 3.0
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smaller_pictures_keep_their_mean() {
        let values: Vec<f32> = (0..12 * 7).map(|i| (i * i % 31) as f32).collect();
        let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len() as f32;
        for size in [[6, 7], [5, 3], [1, 1], [12, 2]] {
            let smaller = resample(&values, [12, 7], size);
            assert_eq!(smaller.len(), size[0] * size[1]);
            assert!((mean(&smaller) / mean(&values) - 1.0).abs() < 1e-5, "{size:?}");
        }
        assert_eq!(resample(&[1.0, 3.0, 5.0, 7.0], [2, 2], [1, 2]), [2.0, 6.0]);
    }

    #[test]
    fn constant_pictures_stay_constant() {
        for size in [[1, 1], [3, 9], [40, 2], [4, 3]] {
            let larger = resample(&[0.3; 12], [4, 3], size);
            assert!(larger.len() == size[0] * size[1] && larger.iter().all(|v| (v - 0.3).abs() < 1e-6));
        }
    }

    #[test]
    fn larger_pictures_rise_evenly_and_do_not_ring() {
        let edge = resample(&[0.0, 0.0, 0.0, 9.0, 9.0, 9.0], [6, 1], [24, 1]);
        assert!(edge.windows(2).all(|pair| pair[0] <= pair[1]), "{edge:?}");
        assert!(edge[0] == 0.0 && edge[23] == 9.0);
        let odd = resample(&[f32::NAN, 1.0, f32::INFINITY], [3, 1], [9, 1]);
        assert_eq!(odd.len(), 9);
    }

    #[test]
    fn nearest_values_are_copied() {
        assert_eq!(
            resample_nearest(&[1.0, 2.0, 3.0, 4.0], [2, 2], [4, 2]),
            [1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0]
        );
        assert_eq!(resample_nearest(&[1.0, 2.0, 3.0], [3, 1], [1, 1]), [2.0]);
    }
}
