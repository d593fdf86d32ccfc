use super::{Light, LightId};

/// Steps that random numbers in [0, 1) have: multiples of 2⁻²⁴.
const STEPS: u32 = 1 << 24;

/// Chooses the light that a path starts from, by power. A light without power is never chosen.
///
/// Each light has a whole number of the steps of a random number, one at least, so that probabilities are exact however many lights there are:
/// with a million of them a bin of an alias table would be sixteen steps wide, and its parts wrong by some percent. Of more lights than half of
/// the steps, those of less power than a step are left out.
#[derive(Clone, Debug)]
pub struct EmissionSelection {
    /// The step at which the interval of each light ends, by [`LightId`]; none where nothing emits.
    ends: Vec<u32>,
}

impl EmissionSelection {
    /// Among `lights`, in a scene of such a radius.
    pub fn new(lights: &[Light], scene_radius: f32) -> Self {
        let power = |light: &Light| Some(light.power(scene_radius)).filter(|p| *p > 0.0 && p.is_finite());
        let (count, total) = lights
            .iter()
            .filter_map(power)
            .fold((0usize, 0.0), |(count, total), p| (count + 1, total + p));
        if count == 0 {
            return Self { ends: Vec::new() };
        }
        // A step for each, and the rest by power
        let least = u32::from(count <= (STEPS / 2) as usize);
        let rest = (STEPS - least * count as u32) as f64;
        let (mut steps, mut so_far) = (0, 0.0);
        let ends = lights.iter().map(|light| {
            if let Some(power) = power(light) {
                steps += least;
                so_far += power;
            }
            // The sum ends at the total to the bit, and the last interval at the last step.
            steps + (rest * (so_far / total)) as u32
        });
        Self { ends: ends.collect() }
    }

    /// Draws a light, and its probability; `None` where nothing emits.
    pub fn sample(&self, u: f32) -> Option<(LightId, f32)> {
        let step = ((u * STEPS as f32) as u32).min(STEPS - 1);
        let index = self.ends.partition_point(|&end| end <= step);
        let id = LightId(index as u32);
        (index < self.ends.len()).then(|| (id, self.pmf(id)))
    }

    /// Probability with which `light` is drawn.
    pub fn pmf(&self, light: LightId) -> f32 {
        let index = light.0 as usize;
        let Some(end) = self.ends.get(index) else {
            return 0.0;
        };
        let start = index.checked_sub(1).map_or(0, |before| self.ends[before]);
        (end - start) as f32 / STEPS as f32
    }

    /// Bytes of its table.
    pub fn bytes(&self) -> usize {
        size_of_val(self.ends.as_slice())
    }
}
