use super::{Light, LightId};
use crate::sampling::AliasTable;

/// How next-event estimation chooses among the lights of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SelectionMode {
    /// Each with the same probability.
    Uniform,
    /// Each with a probability proportional to its power.
    #[default]
    Power,
    /// None is chosen: all are sampled at every vertex.
    All,
}

/// Chooses one light for next-event estimation, or all. A light without power is never chosen.
#[derive(Clone, Debug)]
pub struct LightSelection {
    /// `None` where nothing emits.
    table: Option<AliasTable>,
    /// Lights that are all sampled, if they are.
    all: Option<Vec<LightId>>,
}

impl LightSelection {
    /// Among `lights`, in a scene of radius `scene_radius`.
    pub fn new(mode: SelectionMode, lights: &[Light], scene_radius: f32) -> Self {
        let power = lights.iter().map(|l| l.power(scene_radius));
        let weights: Vec<f64> = match mode {
            SelectionMode::Power => power.collect(),
            SelectionMode::Uniform | SelectionMode::All => power.map(|p| f64::from(u8::from(p > 0.0))).collect(),
        };
        let emitting = || (0..).zip(&weights).filter(|(_, w)| **w > 0.0).map(|(i, _)| LightId(i));
        Self {
            all: (mode == SelectionMode::All).then(|| emitting().collect()),
            table: AliasTable::new(&weights),
        }
    }

    /// Draws a light and its probability; `None` where nothing emits.
    pub fn sample(&self, u: f32) -> Option<(LightId, f32)> {
        let (index, pmf) = self.table.as_ref()?.sample(u);
        Some((LightId(index as u32), pmf))
    }

    /// The lights that are all to be sampled, each with probability 1; `None` where one is to be chosen.
    pub fn all(&self) -> Option<&[LightId]> {
        self.all.as_deref()
    }

    /// Probability that `light` is sampled at a vertex.
    pub fn pmf(&self, light: LightId) -> f32 {
        let pmf = self.table.as_ref().map_or(0.0, |t| t.pmf(light.0 as usize));
        if self.all.is_some() && pmf > 0.0 { 1.0 } else { pmf }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Spectrum;
    use crate::light::PointLight;
    use crate::math::Vec3;

    fn lights() -> Vec<Light> {
        [0.5, 2.0, 0.0, 7.0, 0.01]
            .map(|intensity| {
                Light::Point(PointLight {
                    position: Vec3::ZERO,
                    intensity: Spectrum::splat(intensity),
                })
            })
            .to_vec()
    }

    #[test]
    fn the_mean_of_one_over_p_counts_the_lights() {
        for mode in [SelectionMode::Uniform, SelectionMode::Power] {
            let selection = LightSelection::new(mode, &lights(), 1.0);
            const N: u32 = 1_000_000;
            let mut mean = 0.0;
            for i in 0..N {
                let (id, pmf) = selection.sample((i as f32 + 0.5) / N as f32).unwrap();
                assert_eq!(pmf, selection.pmf(id));
                mean += 1.0 / (pmf as f64 * N as f64);
            }
            assert!((mean / 4.0 - 1.0).abs() < 0.02, "{mode:?}: {mean}");
            assert_eq!(selection.pmf(LightId(2)), 0.0);
        }
    }

    #[test]
    fn all_means_every_light_that_emits() {
        let selection = LightSelection::new(SelectionMode::All, &lights(), 1.0);
        assert_eq!(selection.all().unwrap(), [0, 1, 3, 4].map(LightId));
        assert_eq!((selection.pmf(LightId(1)), selection.pmf(LightId(2))), (1.0, 0.0));
        assert!(
            LightSelection::new(SelectionMode::Power, &lights(), 1.0)
                .all()
                .is_none()
        );
        assert!(
            LightSelection::new(SelectionMode::Power, &lights()[2..3], 1.0)
                .sample(0.5)
                .is_none()
        );
    }
}
