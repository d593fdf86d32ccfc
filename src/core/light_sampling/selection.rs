//! Choice of a light for next-event estimation: by power, by place, or all lights.

use super::LightSampleContext;
use super::lamps::Lamps;
use super::light_grid::LightGrid;
use super::visibility_grid::VisibilityGrid;
use crate::light::{AreaLight, Light, LightId, LightSample};
use crate::math::{Bounds3, Vec2, Vec3};
use crate::sampling::AliasTable;
use crate::texture::Texture;
use std::sync::OnceLock;

/// [`SelectionMode::Auto`] chooses by power if the scene has at most this number of lights. Two
/// lights are often the two triangles of a rectangular lamp, which contribute about the same to
/// almost every point (docs/notebook/2026-11.md).
const FEW: usize = 2;

/// Choice of lights in next-event estimation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SelectionMode {
    /// If the scene has more than two lights, by place, else by power. Directions of the sky are
    /// sampled by their learned visibility, if a gain is expected.
    #[default]
    Auto,
    /// All lights with the same probability.
    Uniform,
    /// By power.
    Power,
    /// By an estimate of the unoccluded irradiance at the receiving point.
    Place,
    /// Like [`SelectionMode::Auto`], but visibility is learned and used even if no gain is
    /// expected.
    Visibility,
    /// No choice: all lamps are sampled at every vertex.
    All,
}

impl SelectionMode {
    /// Returns true if visibility can be learned in this mode.
    pub fn learns(self) -> bool {
        matches!(self, Self::Auto | Self::Visibility)
    }
}

/// Settings of the choice of a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightChoice {
    /// Mode of the choice.
    pub mode: SelectionMode,
    /// Samples of the largest lamp at a vertex if all lamps are sampled, at least 1.
    pub lamp_samples: u32,
}

impl Default for LightChoice {
    fn default() -> Self {
        Self {
            mode: SelectionMode::default(),
            lamp_samples: 1,
        }
    }
}

/// Chooses one light for next-event estimation, or all lights. A light without power is never
/// chosen.
#[derive(Clone, Debug)]
pub struct LightSelection {
    /// Choice by weight (by power, or with equal weights); `None` if there is no emission.
    table: Option<AliasTable>,
    /// All lamps, if all are sampled.
    all: Option<Lamps>,
    /// Choice by place; also present if only `visibility` uses it.
    grid: Option<LightGrid>,
    /// True if a light is chosen by place where visibility is unknown.
    is_by_place: bool,
    mode: SelectionMode,
    /// Visible directions of the sky by place; empty until they are learned. The inner value is
    /// `None` if sampling by visibility would bring no gain.
    visibility: OnceLock<Option<VisibilityGrid>>,
}

impl LightSelection {
    /// Choice among `lights`, in a scene with the given bounds and radius.
    pub fn new(mode: SelectionMode, lights: &[Light], bounds: Bounds3, scene_radius: f32) -> Self {
        let power = lights.iter().map(|l| l.power(scene_radius));
        let weights: Vec<f64> = match mode {
            SelectionMode::Auto | SelectionMode::Visibility | SelectionMode::Power | SelectionMode::Place => {
                power.collect()
            }
            SelectionMode::Uniform | SelectionMode::All => power.map(|p| f64::from(u8::from(p > 0.0))).collect(),
        };
        let emitting = || (0..).zip(&weights).filter(|(_, w)| **w > 0.0).map(|(i, _)| LightId(i));
        let by_place = match mode {
            SelectionMode::Auto | SelectionMode::Visibility => emitting().count() > FEW,
            SelectionMode::Place => true,
            SelectionMode::Uniform | SelectionMode::Power | SelectionMode::All => false,
        };
        Self {
            all: (mode == SelectionMode::All).then(|| {
                let ids = (0..lights.len() as u32).map(LightId);
                Lamps::new(ids.map(|id| vec![id]), lights, scene_radius, 1)
            }),
            table: AliasTable::new(&weights),
            is_by_place: by_place,
            grid: (by_place || (mode.learns() && emitting().count() > 1))
                .then(|| LightGrid::new(lights, &weights, bounds, scene_radius))
                .flatten(),
            mode,
            visibility: OnceLock::new(),
        }
    }

    /// In the mode that samples all lights, samples lamps as given by `lamps` instead of each light
    /// separately.
    pub(crate) fn with_lamps(mut self, lamps: impl FnOnce() -> Lamps) -> Self {
        self.all = self.all.map(|_| lamps());
        self
    }

    /// Mode of the choice.
    pub fn mode(&self) -> SelectionMode {
        self.mode
    }

    /// Returns true if [`LightSelection::learn`] has been called.
    pub fn is_learned(&self) -> bool {
        self.visibility.get().is_some()
    }

    /// Samples directions of the sky by `visibility` from now on; `None` samples them by radiance.
    /// Only the first call after [`LightSelection::forget`] has an effect.
    pub fn learn(&self, visibility: Option<VisibilityGrid>) {
        drop(self.visibility.set(visibility));
    }

    /// Reverts [`LightSelection::learn`].
    pub fn forget(&mut self) {
        self.visibility = OnceLock::new();
    }

    /// A grid without visibility for the surface points `points`. The number of cells is limited so
    /// that `max_rays` rays suffice for all targets. Returns `None` if there are no points, or if
    /// there is nothing to learn, because no light of `lights` shines from many directions and
    /// there is at most one lamp.
    pub fn visibility_grid(&self, lights: &[Light], points: &[Vec3], max_rays: usize) -> Option<VisibilityGrid> {
        VisibilityGrid::new(lights, self.grid.as_ref(), points, max_rays)
    }

    #[inline(always)]
    fn visibility(&self) -> Option<&VisibilityGrid> {
        self.visibility.get()?.as_ref()
    }

    /// Samples incident light at `context` at `time`, from the light `id` of `lights`. `None` if no
    /// light arrives. `textures` are the textures of the scene.
    #[inline(always)]
    pub fn sample_light(
        &self,
        lights: &[Light],
        id: LightId,
        context: &LightSampleContext,
        time: f32,
        u: Vec2,
        textures: &[Texture],
    ) -> Option<LightSample> {
        let light = &lights[id.0 as usize];
        let visibility = match light {
            Light::Constant(_) | Light::Environment(_) => self.visibility(),
            _ => None,
        };
        match visibility.and_then(|visibility| visibility.sample(id, lights, self.grid.as_ref(), context, u)) {
            Some(sample) => sample,
            None => light.sample(context.p, time, u, textures),
        }
    }

    /// Calls [`LightSelection::sample_light`] for each of the lights `ids` with the random numbers
    /// `u` of the same index.
    #[inline(always)]
    pub fn sample_four(
        &self,
        lights: &[Light],
        ids: [Option<LightId>; 4],
        context: &LightSampleContext,
        time: f32,
        u: [Vec2; 4],
        textures: &[Texture],
    ) -> [Option<LightSample>; 4] {
        // If all samples are on the same rectangle, compute its solid angle only once
        let is_one = ids.iter().all(|id| id.is_none() || *id == ids[0]);
        match ids[0].map(|id| &lights[id.0 as usize]) {
            Some(Light::Area(AreaLight::Rectangle(light))) if is_one => light.sample_four(context.p, u),
            _ => {
                let mut samples = [None; 4];
                for ((sample, id), u) in samples.iter_mut().zip(ids).zip(u) {
                    *sample = id.and_then(|id| self.sample_light(lights, id, context, time, u, textures));
                }
                samples
            }
        }
    }

    /// Density with which [`LightSelection::sample_light`] samples the unit direction `wi`, divided
    /// by [`Light::pdf`]. `id` is an infinitely distant light of `lights`.
    #[inline]
    pub fn pdf_factor(&self, lights: &[Light], id: LightId, context: &LightSampleContext, wi: Vec3) -> f32 {
        match (&lights[id.0 as usize], self.visibility()) {
            (Light::Constant(_) | Light::Environment(_), Some(visibility)) => {
                visibility.pdf_factor(id, lights, self.grid.as_ref(), context, wi)
            }
            _ => 1.0,
        }
    }

    /// Bytes of the learned visibility.
    pub fn bytes(&self) -> usize {
        self.visibility().map_or(0, VisibilityGrid::bytes)
    }

    /// Samples a light of the scene's `lights` for `context`; returns it with its probability.
    /// `None` if there is no emission.
    #[inline(always)]
    pub fn sample(&self, lights: &[Light], context: &LightSampleContext, u: f32) -> Option<(LightId, f32)> {
        if let Some(visibility) = self.visibility() {
            if let Some(chosen) = visibility.choose(lights, self.grid.as_ref(), context, u) {
                return chosen;
            }
        }
        if let Some(grid) = self.grid.as_ref().filter(|_| self.is_by_place) {
            return grid.sample(lights, context, u);
        }
        let (index, pmf) = self.table.as_ref()?.sample(u);
        Some((LightId(index as u32), pmf))
    }

    /// The lamps, if all are sampled; `None` if one light is chosen.
    #[inline(always)]
    pub fn all(&self) -> Option<&Lamps> {
        self.all.as_ref()
    }

    /// Probability that `light`, one of the scene's `lights`, is sampled at `context`. If all lamps
    /// are sampled, the expected number of samples of `light`.
    #[inline(always)]
    pub fn pmf(&self, lights: &[Light], context: &LightSampleContext, light: LightId) -> f32 {
        let visibility = self.visibility();
        if let Some(pmf) = visibility.and_then(|v| v.pmf(lights, self.grid.as_ref(), context, light)) {
            return pmf;
        }
        if let Some(grid) = self.grid.as_ref().filter(|_| self.is_by_place) {
            return grid.pmf(lights, context, light);
        }
        match &self.all {
            Some(lamps) => lamps.expected(light),
            None => self.table.as_ref().map_or(0.0, |t| t.pmf(light.0 as usize)),
        }
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

    fn choice(mode: SelectionMode, lights: &[Light]) -> LightSelection {
        LightSelection::new(mode, lights, Bounds3::EMPTY, 1.0)
    }

    const HERE: LightSampleContext = LightSampleContext {
        p: Vec3::ONE,
        n: Vec3::X,
    };

    #[test]
    fn mean_inverse_probability_is_the_number_of_lights() {
        for mode in [
            SelectionMode::Uniform,
            SelectionMode::Power,
            SelectionMode::Place,
            SelectionMode::Auto,
        ] {
            let lights = lights();
            let selection = choice(mode, &lights);
            const N: u32 = 1_000_000;
            let mut mean = 0.0;
            for i in 0..N {
                let (id, pmf) = selection.sample(&lights, &HERE, (i as f32 + 0.5) / N as f32).unwrap();
                assert_eq!(pmf, selection.pmf(&lights, &HERE, id));
                mean += 1.0 / (pmf as f64 * N as f64);
            }
            assert!((mean / 4.0 - 1.0).abs() < 0.02, "{mode:?}: {mean}");
            assert_eq!(selection.pmf(&lights, &HERE, LightId(2)), 0.0);
        }
    }

    #[test]
    fn mode_all_samples_each_emitting_light() {
        let lights = lights();
        let selection = choice(SelectionMode::All, &lights);
        let all = selection.all().unwrap();
        let ids: Vec<LightId> = (0..all.samples()).map(|i| all.choose(i, 0.5).0).collect();
        assert_eq!(ids, [0, 1, 3, 4].map(LightId));
        let pmf = |i| selection.pmf(&lights, &HERE, LightId(i));
        assert_eq!((pmf(1), pmf(2)), (1.0, 0.0));
    }

    #[test]
    fn dark_scene_chooses_no_light() {
        let dark = &lights()[2..3];
        for mode in [SelectionMode::Power, SelectionMode::Place, SelectionMode::Auto] {
            let selection = choice(mode, dark);
            assert!(selection.all().is_none() && selection.sample(dark, &HERE, 0.5).is_none());
            assert_eq!(selection.pmf(dark, &HERE, LightId(0)), 0.0);
        }
    }
}
