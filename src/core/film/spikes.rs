//! Pixels whose light comes mostly from one sample.
//!
//! A Markov chain that is stuck adds the light of the whole chain to one pixel. If one of n
//! iterations has all the light of a pixel, the standard error of the mean is as large as the mean.
//! Such a pixel is found by its standard error and by its contrast with the surrounding pixels.

use super::{Accumulator, Film};
use crate::math::UVec2;

/// Minimum number of samples for an error estimate.
const MIN_SAMPLES: u32 = 16;
/// Minimum standard error of a spike, relative to its value.
const MIN_ERROR: f64 = 0.5;
/// A spike is more than this many times as bright as the median of the pixels around it, and as the
/// mean of the picture.
const MIN_CONTRAST: f64 = 8.0;
/// Maximum distance, in columns and in rows, of the surrounding pixels from a spike.
const REACH: u32 = 2;

/// Pixels that are brighter than their neighbours because of one or few samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spikes {
    /// Number of spikes.
    pub count: u64,
    /// Brightest spike.
    pub brightest: UVec2,
    /// Value of the brightest spike, mean of its channels.
    pub value: f64,
    /// Standard error of `value`.
    pub error: f64,
    /// Median of the pixels around the brightest spike.
    pub around: f64,
}

impl Spikes {
    /// Spikes of `film`; `None` if there are no spikes or too few samples.
    pub fn of(film: &Film) -> Option<Self> {
        let mean = film.pixels().map(|(_, sums)| value(&sums)).sum::<f64>() / film.crop().area() as f64;
        let mut found: Option<Self> = None;
        for (pixel, sums) in film.pixels() {
            // The median is computed last, because few pixels need it.
            let (value, error) = (value(&sums), error(&sums));
            let is_noisy = sums.samples() >= MIN_SAMPLES && error >= MIN_ERROR * value;
            if !is_noisy || value <= MIN_CONTRAST * mean {
                continue;
            }
            let around = median_around(film, pixel);
            if value <= MIN_CONTRAST * around {
                continue;
            }
            let count = 1 + found.map_or(0, |spikes| spikes.count);
            found = match found {
                Some(spikes) if spikes.value >= value => Some(Self { count, ..spikes }),
                _ => Some(Self {
                    count,
                    brightest: pixel,
                    value,
                    error,
                    around,
                }),
            };
        }
        found
    }
}

/// Mean of the channels.
fn value(sums: &Accumulator) -> f64 {
    [0, 1, 2].map(|c| sums.mean(c)).iter().sum::<f64>() / 3.0
}

/// Standard error of [`value`], if the errors of the channels are perfectly correlated.
fn error(sums: &Accumulator) -> f64 {
    [0, 1, 2].map(|c| sums.variance_of_mean(c).sqrt()).iter().sum::<f64>() / 3.0
}

fn median_around(film: &Film, pixel: UVec2) -> f64 {
    let first = pixel.saturating_sub(UVec2::splat(REACH));
    let rows = first.y..=pixel.y + REACH;
    let mut values: Vec<f64> = rows
        .flat_map(|y| (first.x..=pixel.x + REACH).map(move |x| UVec2::new(x, y)))
        .filter(|&other| other != pixel)
        .filter_map(|other| film.sums(other).as_ref().map(value))
        .collect();
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::super::{Iteration, Rect};
    use super::*;
    use crate::color::Spectrum;

    /// Film of `iterations` iterations of a uniform picture with noise. `extra` returns additional
    /// light for an iteration and a pixel.
    fn film(iterations: u32, extra: impl Fn(u32, UVec2) -> f32) -> Film {
        let size = UVec2::splat(20);
        let mut film = Film::new(size, Rect::full(size));
        for i in 0..iterations {
            let mut iteration = Iteration::of(&film);
            for pixel in Rect::full(size).pixels() {
                let noise = if (pixel.x + pixel.y + i) % 2 == 0 { 0.5 } else { 1.5 };
                iteration.add(pixel, Spectrum::splat(noise + extra(i, pixel)));
            }
            film.add_iteration(&iteration);
        }
        film
    }

    #[test]
    fn light_of_one_iteration_is_a_spike() {
        let at = UVec2::new(7, 19);
        let spikes = Spikes::of(&film(64, |i, pixel| if i == 40 && pixel == at { 6400.0 } else { 0.0 }));
        let spikes = spikes.unwrap();
        assert_eq!((spikes.count, spikes.brightest, spikes.around), (1, at, 1.0));
        assert!(
            (spikes.value - 101.0).abs() < 1e-3 && (spikes.error - 100.0).abs() < 1.0,
            "{spikes:?}"
        );
    }

    /// Noise, a bright lamp, a bright area, or a picture of few samples is not a spike.
    #[test]
    fn bright_light_is_no_spike() {
        assert_eq!(Spikes::of(&film(64, |_, _| 0.0)), None);
        assert_eq!(
            Spikes::of(&film(64, |_, pixel| if pixel.x == 3 { 100.0 } else { 0.0 })),
            None
        );
        assert_eq!(
            Spikes::of(&film(64, |i, pixel| if i == 3 && pixel.x > 9 { 900.0 } else { 0.0 })),
            None
        );
        assert_eq!(Spikes::of(&film(8, |i, _| if i == 3 { 900.0 } else { 0.0 })), None);
    }
}
