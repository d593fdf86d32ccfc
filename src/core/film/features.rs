//! Features of the first surface for the channels of `--aov`: position, texture coordinates,
//! motion, photons or irradiance records, object, part and material.
//!
//! The integrator adds the features to the first surface, and the film sums them. [`Coverage`]
//! counts the samples of each id. The writers of ids and Cryptomattes (`io/cryptomatte.rs`) use
//! these counts. Features are computed and stored only on request.

use super::Fixed;
use crate::math::{Vec2, Vec3};

/// Properties of the first surface, for channels in addition to the default channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Features {
    /// Position in world space.
    pub p: Vec3,
    /// Texture coordinates; zero if the mesh has none.
    pub uv: Vec2,
    /// Motion on the film while the shutter is open, in pixels: x to the right, y upwards.
    pub motion: Vec2,
    /// Photons or irradiance records at the surface.
    pub points: Points,
    /// Id of the object.
    pub object: u32,
    /// Id of the part, as returned by [`Scene::part`](crate::scene::Scene::part).
    pub part: u32,
    /// Id of the material.
    pub material: u32,
}

/// Photons or irradiance records from which a method interpolates the light at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Points {
    /// 1 if the point is within half a pixel's width of a photon or record, else 0.
    pub dot: f32,
    /// Search radius in scene units: distance of the farthest photon, or mean radius of the
    /// records.
    pub radius: f32,
    /// Number of photons or records that the interpolation uses.
    pub count: f32,
    /// Luminance of the light from the caustic photon map; 0 for records.
    pub caustics: f32,
    /// Length of the translational gradient of the records' irradiance, as luminance in W·m⁻³; 0
    /// for photons.
    pub gradient: f32,
}

/// Name of a channel, and its value at a surface.
type FeatureValue = (&'static str, fn(&Features) -> f32);

/// Features that are summed as numbers, each with the name of its channel: the name of the AOV, a
/// dot and a component. Checkpoints have the sums in this order.
pub(super) const SUMS: &[FeatureValue] = &[
    ("P.X", |f| f.p.x),
    ("P.Y", |f| f.p.y),
    ("P.Z", |f| f.p.z),
    ("uv.U", |f| f.uv.x),
    ("uv.V", |f| f.uv.y),
    ("motion.X", |f| f.motion.x),
    ("motion.Y", |f| f.motion.y),
    ("points.dots", |f| f.points.dot),
    ("points.radius", |f| f.points.radius),
    ("points.count", |f| f.points.count),
    ("points.caustics", |f| f.points.caustics),
    ("points.gradient", |f| f.points.gradient),
];

/// Sums of the features of one pixel in one task, over at most one block of samples.
#[derive(Clone, Debug, Default)]
pub struct FeatureBlock {
    /// Sums in the order of [`SUMS`].
    sums: [f64; SUMS.len()],
    /// Number of samples on lines.
    lines: u32,
    objects: Coverage,
    parts: Coverage,
    materials: Coverage,
}

impl FeatureBlock {
    /// Adds the features of a sample that hit a surface.
    pub fn add(&mut self, features: &Features) {
        for (sum, (_, value)) in self.sums.iter_mut().zip(SUMS) {
            *sum += f64::from(value(features));
        }
        self.objects.add(features.object, 1);
        self.parts.add(features.part, 1);
        self.materials.add(features.material, 1);
    }

    /// Adds a sample that lies on a line of a drawing. The sample may have hit a surface or the
    /// background.
    pub fn add_line(&mut self) {
        self.lines += 1;
    }

    /// Makes all sums zero.
    pub fn clear(&mut self) {
        self.sums = Default::default();
        self.lines = 0;
        self.objects.0.clear();
        self.parts.0.clear();
        self.materials.0.clear();
    }
}

/// Exact sums of the features of one pixel, as in [`Accumulator`](super::Accumulator).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FeatureSums {
    /// Sums in the order of [`SUMS`].
    pub(super) sums: [Fixed; SUMS.len()],
    /// Number of samples on lines.
    pub(super) lines: u32,
    /// Number of samples that hit each object.
    pub objects: Coverage,
    /// Number of samples that hit each part.
    pub parts: Coverage,
    /// Number of samples that hit each material.
    pub materials: Coverage,
}

impl FeatureSums {
    /// Adds the next samples.
    pub fn add(&mut self, block: &FeatureBlock) {
        for (sum, value) in self.sums.iter_mut().zip(block.sums) {
            *sum = sum.plus(Fixed::new(value));
        }
        self.lines = self.lines.saturating_add(block.lines);
        block.objects.iter().for_each(|(id, n)| self.objects.add(id, n));
        block.parts.iter().for_each(|(id, n)| self.parts.add(id, n));
        block.materials.iter().for_each(|(id, n)| self.materials.add(id, n));
    }

    /// Subtracts the samples that were added last. `block` must have fewer samples than a full
    /// block.
    pub fn take_back(&mut self, block: &FeatureBlock) {
        for (sum, value) in self.sums.iter_mut().zip(block.sums) {
            *sum = sum.minus(Fixed::new(value));
        }
        self.lines = self.lines.saturating_sub(block.lines);
        block.objects.iter().for_each(|(id, n)| self.objects.take_back(id, n));
        block.parts.iter().for_each(|(id, n)| self.parts.take_back(id, n));
        block
            .materials
            .iter()
            .for_each(|(id, n)| self.materials.take_back(id, n));
    }

    /// Adds the sums of another accumulator of the same pixel.
    pub fn merge(&mut self, other: &Self) {
        for (sum, other) in self.sums.iter_mut().zip(&other.sums) {
            *sum = sum.plus(*other);
        }
        self.lines = self.lines.saturating_add(other.lines);
        other.objects.iter().for_each(|(id, n)| self.objects.add(id, n));
        other.parts.iter().for_each(|(id, n)| self.parts.add(id, n));
        other.materials.iter().for_each(|(id, n)| self.materials.add(id, n));
    }

    /// Number of samples on lines.
    pub fn lines(&self) -> u32 {
        self.lines
    }

    /// Number of samples that hit a surface.
    pub fn surfaces(&self) -> u32 {
        self.objects.iter().map(|(_, n)| n).sum()
    }

    /// Mean value of the channel `name`, such as `P.X`, over the samples that hit a surface; 0 if
    /// no sample hit a surface.
    pub fn mean(&self, name: &str) -> f32 {
        let index = SUMS.iter().position(|(known, _)| *known == name);
        let sum = index.map_or(0.0, |i| self.sums[i].to_f64());
        (sum / f64::from(self.surfaces().max(1))) as f32
    }
}

/// Ids that the samples of a pixel hit, each with its number of samples.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Coverage(Vec<(u32, u32)>);

impl Coverage {
    /// Adds `n` samples that hit `id`.
    pub fn add(&mut self, id: u32, n: u32) {
        // Fast path: most pixels show one id only
        let found = match self.0.as_slice() {
            [(only, _)] if *only == id => Ok(0),
            all => all.binary_search_by_key(&id, |&(id, _)| id),
        };
        match found {
            Ok(at) => self.0[at].1 = self.0[at].1.saturating_add(n),
            Err(at) => self.0.insert(at, (id, n)),
        }
    }

    fn take_back(&mut self, id: u32, n: u32) {
        if let Ok(at) = self.0.binary_search_by_key(&id, |&(id, _)| id) {
            self.0[at].1 = self.0[at].1.saturating_sub(n);
            if self.0[at].1 == 0 {
                self.0.remove(at);
            }
        }
    }

    /// Ids with their numbers of samples, in ascending order of id.
    pub fn iter(&self) -> impl Iterator<Item = (u32, u32)> {
        self.0.iter().copied()
    }

    /// Id of the given rank in ascending order, and its number of samples; zeros if there are fewer
    /// ids.
    pub(super) fn at(&self, rank: usize) -> (u32, u32) {
        self.0.get(rank).copied().unwrap_or_default()
    }

    /// Number of different ids.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns true if no sample hit a surface.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Ids with their numbers of samples. The id with the most samples is first. Ids with equal
    /// numbers are in ascending order.
    pub fn by_rank(&self) -> Vec<(u32, u32)> {
        let mut ranked = self.0.clone();
        ranked.sort_by_key(|&(id, n)| (std::cmp::Reverse(n), id));
        ranked
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn features(i: u32) -> Features {
        Features {
            p: Vec3::new(i as f32 * 0.1, 1e-6, -3e4),
            uv: Vec2::new(0.3, 1.0 / (i + 1) as f32),
            motion: Vec2::new(-0.7, i as f32),
            points: Points {
                dot: (i % 2) as f32,
                radius: 0.1 * i as f32,
                ..Points::default()
            },
            object: i % 3,
            part: i % 5,
            material: 7,
        }
    }

    #[test]
    fn sums_do_not_depend_on_order_and_subtraction_is_exact() {
        let block = |range: std::ops::Range<u32>| {
            let mut block = FeatureBlock::default();
            range.for_each(|i| {
                block.add(&features(i));
                block.add_line();
            });
            block
        };
        let sum = |blocks: &[FeatureBlock]| {
            let mut sums = FeatureSums::default();
            blocks.iter().for_each(|block| sums.add(block));
            sums
        };
        let blocks = [block(0..2), block(2..40), block(40..100)];
        let backwards = [blocks[2].clone(), blocks[1].clone(), blocks[0].clone()];
        let (mut all, mut first) = (sum(&blocks), sum(&blocks[..2]));
        assert_eq!(all, sum(&backwards));
        first.merge(&sum(&blocks[2..]));
        assert_eq!(all, first);
        blocks[1..].iter().for_each(|block| all.take_back(block));
        assert_eq!(all, sum(&blocks[..1]));
        assert_eq!((all.surfaces(), all.objects.len(), all.parts.len()), (2, 2, 2));
        assert_eq!(all.lines(), 2);
        assert!((all.mean("P.X") - 0.05).abs() < 1e-7 && all.mean("motion.Y") == 0.5);
    }

    #[test]
    fn what_covers_most_comes_first() {
        let mut coverage = Coverage::default();
        for (id, n) in [(5, 3), (2, 9), (8, 3), (5, 1)] {
            coverage.add(id, n);
        }
        assert_eq!(coverage.by_rank(), [(2, 9), (5, 4), (8, 3)]);
        assert_eq!(FeatureSums::default().mean("P.X"), 0.0);
    }
}
