//! Choice of the light that a light path starts from, by power.

use crate::light::{Light, LightId};

/// Number of possible random numbers in [0, 1): the multiples of 2⁻²⁴. Each multiple is a step.
const STEPS: u32 = 1 << 24;

/// Chooses the light that a path starts from, by power. A light without power is never chosen.
///
/// Random numbers are multiples of 2⁻²⁴, called steps. Each emitting light has an interval of a
/// whole number of steps, at least one, so that probabilities are exact for any number of lights.
/// An alias table would be less exact: for a million lights its bins have sixteen steps each, and
/// probabilities would be wrong by some percent. If the number of lights is more than half the
/// number of steps, lights with a power below one step are never chosen.
#[derive(Clone, Debug)]
pub struct EmissionSelection {
    /// Step at which the interval of each light ends, by [`LightId`]; empty if there is no
    /// emission.
    ends: Vec<u32>,
}

impl EmissionSelection {
    /// Choice among `lights`, in a scene with the radius `scene_radius`, scene units.
    pub fn new(lights: &[Light], scene_radius: f32) -> Self {
        let power = |light: &Light| Some(light.power(scene_radius)).filter(|p| *p > 0.0 && p.is_finite());
        let (count, total) = lights
            .iter()
            .filter_map(power)
            .fold((0usize, 0.0), |(count, total), p| (count + 1, total + p));
        if count == 0 {
            return Self { ends: Vec::new() };
        }
        // Give each light one step, and distribute the rest by power
        let min = u32::from(count <= (STEPS / 2) as usize);
        let rest = (STEPS - min * count as u32) as f64;
        let (mut steps, mut so_far) = (0, 0.0);
        let ends = lights.iter().map(|light| {
            if let Some(power) = power(light) {
                steps += min;
                so_far += power;
            }
            // `so_far` ends exactly at `total`, so the last interval ends at the last step.
            steps + (rest * (so_far / total)) as u32
        });
        Self { ends: ends.collect() }
    }

    /// Samples a light; returns it with its probability. `None` if there is no emission.
    pub fn sample(&self, u: f32) -> Option<(LightId, f32)> {
        let step = ((u * STEPS as f32) as u32).min(STEPS - 1);
        let index = self.ends.partition_point(|&end| end <= step);
        let id = LightId(index as u32);
        (index < self.ends.len()).then(|| (id, self.pmf(id)))
    }

    /// Probability of `light`.
    pub fn pmf(&self, light: LightId) -> f32 {
        let index = light.0 as usize;
        let Some(end) = self.ends.get(index) else {
            return 0.0;
        };
        let start = index.checked_sub(1).map_or(0, |before| self.ends[before]);
        (end - start) as f32 / STEPS as f32
    }

    /// Bytes of the table.
    pub fn bytes(&self) -> usize {
        size_of_val(self.ends.as_slice())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Spectrum;
    use crate::light::PointLight;
    use crate::math::{Vec3, hash::mix};

    fn lights(intensities: impl Iterator<Item = f32>) -> Vec<Light> {
        let light = |intensity| {
            Light::Point(PointLight {
                position: Vec3::ZERO,
                intensity: Spectrum::splat(intensity),
            })
        };
        intensities.map(light).collect()
    }

    /// Over all random numbers, the frequency of each light is its probability. The probability is
    /// proportional to the power of the light, within a few steps.
    #[test]
    fn probabilities_are_exact() {
        // Intensities of many magnitudes, some of them zero
        let intensity = |i: u64| match mix(i) % 7 {
            0 => 0.0,
            k => 10f32.powi(k as i32 - 6) * (1.0 + (mix(i) >> 48) as f32 / 65536.0),
        };
        for count in [1, 2, 5, 1000, 100_000] {
            let lights = lights((0..count).map(|i| intensity(i + 1)));
            let powers: Vec<f64> = lights.iter().map(|l| l.power(1.0)).collect();
            let total: f64 = powers.iter().sum();
            let selection = EmissionSelection::new(&lights, 1.0);
            let steps = STEPS as f64;
            let mut before = 0.0;
            for (id, power) in (0..).map(LightId).zip(&powers) {
                let pmf = selection.pmf(id) as f64;
                let share = power / total;
                assert_eq!(pmf > 0.0, share > 0.0);
                assert!(
                    (pmf - share).abs() <= (2.0 + share * count as f64) / steps,
                    "{pmf} {share}"
                );
                if pmf > 0.0 {
                    // Test the first and the last number of the interval
                    for u in [before, before + pmf - 1.0 / steps] {
                        assert_eq!(selection.sample(u as f32), Some((id, pmf as f32)));
                    }
                }
                before += pmf;
            }
            assert_eq!(before, 1.0);
        }
    }

    #[test]
    fn dark_scene_chooses_no_light() {
        for dark in [lights(std::iter::empty()), lights([0.0, 0.0].into_iter())] {
            let selection = EmissionSelection::new(&dark, 1.0);
            assert!(selection.sample(0.5).is_none());
            assert_eq!((selection.pmf(LightId(0)), selection.bytes()), (0.0, 0));
        }
        // NaN or an unknown light does not panic.
        let one = EmissionSelection::new(&lights([0.0, 2.0].into_iter()), 1.0);
        for u in [f32::NAN, 1.0, -1.0, f32::INFINITY] {
            assert_eq!(one.sample(u), Some((LightId(1), 1.0)));
        }
        assert_eq!((one.pmf(LightId(0)), one.pmf(LightId(9))), (0.0, 0.0));
    }
}
