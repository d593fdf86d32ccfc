//! Light samples at the end of camera paths, for the strategies with s = 1.

use crate::color::Spectrum;
use crate::integrator::bidirectional::subpath::{LightEnd, PathVertex, VertexKind, emission_pdfs};
use crate::light::{LightId, LightSample};
use crate::light_sampling::{LightSampleContext, LightSelection};
use crate::math::Vec3;
use crate::sampler::{Dimension, Sampler};
use crate::scene::Scene;

/// Sampler dimensions for the choice of a light and for the point on the light.
pub(super) struct LightDimensions {
    pub choice: Dimension,
    pub point: Dimension,
}

/// A sample of the light `id` for the last vertex of a camera path. `pmf` is the expected number of
/// samples of this light.
pub(super) struct SampledLight<'a> {
    scene: &'a Scene,
    pub id: LightId,
    pmf: f32,
    pub sample: LightSample,
    time: f32,
}

impl<'a> SampledLight<'a> {
    /// Incident radiance divided by the density of the sample.
    pub fn radiance(&self) -> Spectrum {
        self.sample.radiance * (1.0 / (self.pmf * self.sample.pdf))
    }

    /// Light vertex at the sampled point. Its density `forward` is the density with which a light
    /// path starts at this point.
    pub fn vertex(&self) -> PathVertex<'a> {
        let light = &self.scene.lights()[self.id.0 as usize];
        let (sample, is_infinite) = (&self.sample, self.sample.target.is_none());
        let ng = if is_infinite {
            -sample.wi
        } else {
            let q = sample.target.unwrap_or(Vec3::ZERO);
            light.normal(q, self.time).unwrap_or(Vec3::ZERO)
        };
        let [start, _] = emission_pdfs(self.scene, self.id, is_infinite, ng, -sample.wi, self.time);
        let end = LightEnd {
            id: self.id,
            is_infinite,
            is_delta: sample.is_delta,
        };
        PathVertex {
            kind: VertexKind::Light(end),
            p: sample.target.unwrap_or(Vec3::ZERO),
            ng,
            beta: Spectrum::ZERO,
            forward: self.scene.emission_selection().pmf(self.id) * start,
            reverse: 0.0,
            is_delta: false,
            is_one_way: false,
            others: 0.0,
            event: None,
        }
    }
}

/// Samples lights of `scene` for the light sampling context `context`, and calls `found` with each
/// sample. `selection` chooses one light, or all lamps.
pub(super) fn sample_lights<'a>(
    scene: &'a Scene,
    selection: &LightSelection,
    context: &LightSampleContext,
    time: f32,
    numbers: &LightDimensions,
    sampler: &impl Sampler,
    mut found: impl FnMut(SampledLight<'a>),
) {
    let mut of = |id: LightId, pmf: f32, point: Dimension| {
        let (lights, u) = (scene.lights(), sampler.get_2d(point));
        let sample = selection.sample_light(lights, id, context, time, u, scene.textures());
        if let Some(sample) = sample {
            found(SampledLight {
                scene,
                id,
                pmf,
                sample,
                time,
            });
        }
    };
    if let Some(lamps) = selection.all() {
        let choice = sampler.get_2d(numbers.choice).x;
        for index in 0..lamps.samples() {
            let (id, expected) = lamps.choose(index, choice);
            of(id, expected, numbers.point.nth(index + 1));
        }
    } else if let Some((id, pmf)) = selection.sample(scene.lights(), context, sampler.get_2d(numbers.choice).x) {
        of(id, pmf, numbers.point);
    }
}
