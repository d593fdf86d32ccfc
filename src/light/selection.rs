use super::{Light, LightId};
use crate::sampling::AliasTable;

/// Chooses one light for next-event estimation, with probability proportional to its power.
#[derive(Clone, Debug)]
pub struct LightSelection {
    /// `None` in a scene whose lights all emit nothing.
    table: Option<AliasTable>,
}

impl LightSelection {
    /// By the power of `lights` in a scene of radius `scene_radius`.
    pub fn by_power(lights: &[Light], scene_radius: f32) -> Self {
        let power: Vec<f64> = lights.iter().map(|l| l.power(scene_radius)).collect();
        Self {
            table: AliasTable::new(&power),
        }
    }

    /// Draws a light and its probability; `None` where nothing emits.
    pub fn sample(&self, u: f32) -> Option<(LightId, f32)> {
        let (index, pmf) = self.table.as_ref()?.sample(u);
        Some((LightId(index as u32), pmf))
    }

    /// Every light that is to be sampled, where all of them are.
    pub fn each(&self) -> Option<impl Iterator<Item = LightId> + '_> {
        None::<std::iter::Empty<LightId>>
    }

    /// Probability of choosing `light`.
    pub fn pmf(&self, light: LightId) -> f32 {
        self.table.as_ref().map_or(0.0, |t| t.pmf(light.0 as usize))
    }
}
