//! Wavelengths for light with three channels.
//!
//! Glass has a different index of refraction for each wavelength, and a channel of linear Rec.709
//! contains many wavelengths. We assume that the light of a channel is distributed over wavelengths
//! by the positive part of the channel's matching function. A path draws one wavelength from the
//! mean of the three distributions. The weight of a channel is the density of the channel's
//! distribution divided by the mean density. This is hero wavelength sampling (Wilkie et al. 2014)
//! with a channel as the hero, and the balance heuristic over the channels. Weights are at most 3,
//! and their mean is 1 in each channel, so that white light stays white.

use super::distribution::Distribution1D;
use std::sync::OnceLock;

/// First wavelength of the first band, and width of a band, both in nanometres.
const FIRST: f32 = 380.0;
const BAND: f32 = 5.0;
/// Number of bands. The last band ends at 730 nm.
const BANDS: usize = 70;

/// A wavelength for the light of all three channels of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wavelength {
    /// Wavelength in vacuum, nanometres.
    pub nanometers: f32,
    /// Weight of each channel (linear Rec.709 red, green, blue): a factor of light that was
    /// refracted at this wavelength.
    pub weight: [f32; 3],
}

struct Bands {
    /// Fraction of each channel's light that lies in each band.
    shares: [[f32; 3]; BANDS],
    /// Distribution over the bands: the mean of the distributions of the three channels.
    mean: Distribution1D,
}

impl Wavelength {
    /// Draws a wavelength from the mean distribution of the channels. `u` is in [0, 1).
    pub fn sample(u: f32) -> Self {
        let bands = bands();
        let (place, band) = bands.mean.sample(u);
        let share = bands.shares[band];
        Self {
            nanometers: FIRST + place * BAND * BANDS as f32,
            weight: share.map(|channel| channel / mean(share)),
        }
    }

    /// Middle wavelength of each band in nanometres, and the fraction of each channel's light in
    /// the band.
    pub fn bands() -> impl Iterator<Item = (f32, [f32; 3])> {
        let middles = (0..BANDS).map(|band| FIRST + BAND * (band as f32 + 0.5));
        middles.zip(bands().shares)
    }
}

fn mean(share: [f32; 3]) -> f32 {
    share.iter().sum::<f32>() / 3.0
}

fn bands() -> &'static Bands {
    static TABLE: OnceLock<Bands> = OnceLock::new();
    TABLE.get_or_init(|| {
        let matched: [[f64; 3]; BANDS] =
            std::array::from_fn(|band| matching(f64::from(FIRST + BAND * (band as f32 + 0.5))));
        let sums = [0, 1, 2].map(|c| matched.iter().map(|rgb| rgb[c]).sum::<f64>());
        let shares = matched.map(|rgb| [0, 1, 2].map(|c| (rgb[c] / sums[c]) as f32));
        Bands {
            mean: Distribution1D::new(&shares.map(mean)),
            shares,
        }
    })
}

/// Positive part of the colour matching functions of linear Rec.709 at a wavelength in nanometres.
/// The functions use the fit of CIE 1931 by Wyman, Sloan and Shirley 2013 ("Simple Analytic
/// Approximations to the CIE XYZ Color Matching Functions", eq. 4).
fn matching(nanometers: f64) -> [f64; 3] {
    let lobe = |height: f64, middle: f64, widths: [f64; 2]| {
        let width = widths[usize::from(nanometers >= middle)];
        height * (-0.5 * ((nanometers - middle) / width).powi(2)).exp()
    };
    let x = lobe(1.056, 599.8, [37.9, 31.0]) + lobe(0.362, 442.0, [16.0, 26.7]) + lobe(-0.065, 501.1, [20.4, 26.2]);
    let y = lobe(0.821, 568.8, [46.9, 40.5]) + lobe(0.286, 530.9, [16.3, 31.1]);
    let z = lobe(1.217, 437.0, [11.8, 36.0]) + lobe(0.681, 459.0, [26.0, 13.8]);
    let rgb = [
        3.2406 * x - 1.5372 * y - 0.4986 * z,
        -0.9689 * x + 1.8758 * y + 0.0415 * z,
        0.0557 * x - 0.2040 * y + 1.0570 * z,
    ];
    // Give every band some light of all channels, so that no share is zero
    rgb.map(|v| v.max(1e-4))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_leave_white_light_white() {
        const N: u32 = 200_000;
        let mut sum = [0.0f64; 3];
        for i in 0..N {
            let wavelength = Wavelength::sample((i as f32 + 0.5) / N as f32);
            assert!((FIRST..=FIRST + BAND * BANDS as f32).contains(&wavelength.nanometers));
            for (sum, weight) in sum.iter_mut().zip(wavelength.weight) {
                assert!((0.0..=3.001).contains(&weight));
                *sum += f64::from(weight) / f64::from(N);
            }
        }
        assert!(sum.iter().all(|mean| (mean - 1.0).abs() < 1e-3), "{sum:?}");
        let add = |sum: [f32; 3], (_, share): (f32, [f32; 3])| [0, 1, 2].map(|c| sum[c] + share[c]);
        let shares = Wavelength::bands().fold([0.0; 3], add);
        assert!(shares.iter().all(|sum| (sum - 1.0).abs() < 1e-5), "{shares:?}");
    }

    /// Each channel is brightest in the part of the spectrum that has the channel's colour.
    #[test]
    fn channels_have_their_colors() {
        for (c, expected) in [(0, 570.0..630.0), (1, 510.0..560.0), (2, 430.0..470.0)] {
            let largest = Wavelength::bands().max_by(|a, b| a.1[c].total_cmp(&b.1[c]));
            let (nanometers, _) = largest.unwrap();
            assert!(expected.contains(&nanometers), "{c}: {nanometers}");
        }
    }
}
