//! Lamps: groups of lights, such as the triangles of a mesh. In the mode that samples all lights at
//! every vertex, each lamp is sampled as if it were one light.
//!
//! A lamp of a thousand triangles takes as many samples as a lamp of two: each sample chooses a
//! triangle by power. A light that is not part of a mesh, such as a point light or a sky, is a lamp
//! of one light.

use crate::light::{Light, LightId};
use crate::sampling::AliasTable;

/// The lamps of a scene, and how many samples each lamp takes at a vertex.
#[derive(Clone, Debug)]
pub struct Lamps {
    lamps: Vec<Lamp>,
    /// For each sample at a vertex: index of the lamp, and index of the sample among the lamp's
    /// samples.
    samples: Vec<(u32, u32)>,
    /// Expected number of samples at a vertex, by light.
    expected: Vec<f32>,
}

#[derive(Clone, Debug)]
struct Lamp {
    lights: Vec<LightId>,
    /// Table for the choice of a light by power; `None` if the lamp has a single light.
    table: Option<AliasTable>,
    samples: u32,
}

impl Lamps {
    /// Makes one lamp for each group in `groups`, in this order, from the emitting lights of the
    /// group. `scene_radius` is the radius of the scene. The lamp with the largest area takes
    /// `samples` samples per vertex. Other lamps take a number proportional to the square root of
    /// their area, at least 1. A light at infinity that shines from many directions counts as the
    /// largest.
    pub fn new(groups: impl Iterator<Item = Vec<LightId>>, lights: &[Light], scene_radius: f32, samples: u32) -> Self {
        let light = |id: &LightId| &lights[id.0 as usize];
        let power = |id: &LightId| light(id).power(scene_radius);
        let emitting = groups.map(|ids| ids.into_iter().filter(|id| power(id) > 0.0).collect::<Vec<_>>());
        let groups: Vec<Vec<LightId>> = emitting.filter(|ids| !ids.is_empty()).collect();
        let area = |ids: &[LightId]| ids.iter().map(|id| light(id).area()).sum::<f64>();
        let widest = groups.iter().map(|ids| area(ids)).filter(|area| area.is_finite());
        let widest = widest.fold(0.0, f64::max);
        let count = |ids: &[LightId]| match area(ids) {
            0.0 => 1,
            area if area >= widest => samples,
            area => (f64::from(samples) * (area / widest).sqrt()).round().max(1.0) as u32,
        };
        let lamps = groups.into_iter().map(|ids| Lamp {
            table: match ids.len() {
                1 => None,
                _ => AliasTable::new(&ids.iter().map(power).collect::<Vec<_>>()),
            },
            samples: count(&ids),
            lights: ids,
        });
        let lamps: Vec<Lamp> = lamps.collect();
        let mut expected = vec![0.0; lights.len()];
        for lamp in &lamps {
            for (index, id) in lamp.lights.iter().enumerate() {
                expected[id.0 as usize] = lamp.expected(index);
            }
        }
        let numbered = (0..).zip(&lamps);
        Self {
            samples: numbered
                .flat_map(|(i, lamp)| (0..lamp.samples).map(move |k| (i, k)))
                .collect(),
            lamps,
            expected,
        }
    }

    /// Number of lamps.
    pub fn len(&self) -> usize {
        self.lamps.len()
    }

    /// Returns true if no light emits.
    pub fn is_empty(&self) -> bool {
        self.lamps.is_empty()
    }

    /// Number of samples at a vertex.
    pub fn samples(&self) -> u32 {
        self.samples.len() as u32
    }

    /// The light of sample `index` at a vertex, and the expected number of samples of this light.
    /// All samples of a vertex have the same `u`, uniform in [0, 1). The samples of a lamp shift
    /// `u` by equal steps, so they are spread evenly over the lights of the lamp.
    #[inline]
    pub fn choose(&self, index: u32, u: f32) -> (LightId, f32) {
        let (lamp, number) = self.samples[index as usize];
        let lamp = &self.lamps[lamp as usize];
        let Some(table) = &lamp.table else {
            return (lamp.lights[0], lamp.expected(0));
        };
        let turned = u + number as f32 / lamp.samples as f32;
        let (index, _) = table.sample(if turned >= 1.0 { turned - 1.0 } else { turned });
        (lamp.lights[index], lamp.expected(index))
    }

    /// Expected number of samples of `light` at a vertex.
    #[inline]
    pub fn expected(&self, light: LightId) -> f32 {
        self.expected[light.0 as usize]
    }
}

impl Lamp {
    /// Expected number of samples of the lamp's light `index`.
    fn expected(&self, index: usize) -> f32 {
        self.samples as f32 * self.table.as_ref().map_or(1.0, |table| table.pmf(index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Spectrum;
    use crate::light::{ConstantLight, PointLight, TriangleLight, TriangleSampling};
    use crate::math::Vec3;

    /// A triangle whose legs have the length `width`.
    fn triangle(width: f32, radiance: f32) -> Light {
        let corners = [Vec3::ZERO, width * Vec3::X, width * Vec3::Y];
        Light::from(TriangleLight::new(
            corners,
            Spectrum::splat(radiance),
            TriangleSampling::Area,
        ))
    }

    fn lights() -> Vec<Light> {
        let point = Light::Point(PointLight {
            position: Vec3::ZERO,
            intensity: Spectrum::ONE,
        });
        let sky = Light::Constant(ConstantLight {
            radiance: Spectrum::ONE,
        });
        vec![
            triangle(4.0, 1.0),
            triangle(4.0, 3.0),
            triangle(1.0, 9.0),
            triangle(1.0, 0.0),
            point,
            sky,
        ]
    }

    fn lamps(samples: u32) -> Lamps {
        let groups = [vec![0, 1], vec![2], vec![3], vec![4], vec![5]];
        let groups = groups.map(|ids| ids.into_iter().map(LightId).collect());
        Lamps::new(groups.into_iter(), &lights(), 1.0, samples)
    }

    #[test]
    fn wide_lamps_take_more_samples() {
        // The lamp of two triangles has 32 times the area of the small triangle. The point light
        // has no area, and the sky counts as the largest lamp.
        for (samples, expected) in [(1, [1, 1, 1, 1]), (4, [4, 1, 1, 4]), (17, [17, 3, 1, 17])] {
            let lamps = lamps(samples);
            assert_eq!(lamps.len(), 4);
            let counts: Vec<u32> = lamps.lamps.iter().map(|lamp| lamp.samples).collect();
            assert_eq!(counts, expected);
            assert_eq!(lamps.samples(), expected.iter().sum::<u32>());
            assert_eq!(lamps.expected(LightId(3)), 0.0);
        }
    }

    /// Each light has the expected frequency.
    #[test]
    fn lights_come_as_often_as_expected() {
        for samples in [1, 3, 4] {
            let lamps = lamps(samples);
            const N: u32 = 4000;
            let mut counts = [0u32; 6];
            for i in 0..N {
                let u = (i as f32 + 0.5) / N as f32;
                for index in 0..lamps.samples() {
                    let (id, expected) = lamps.choose(index, u);
                    assert_eq!(expected, lamps.expected(id));
                    counts[id.0 as usize] += 1;
                }
            }
            for (id, count) in (0..).map(LightId).zip(counts) {
                let mean = f64::from(count) / f64::from(N);
                assert!(
                    (mean - f64::from(lamps.expected(id))).abs() < 2e-3,
                    "{samples}, {id:?}: {mean}"
                );
            }
        }
    }
}
