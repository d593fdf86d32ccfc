//! Parts of a scene: connected components of its triangles, and the parts that rest on others.

use super::scene_tracer::SceneTracer;
use super::triangles::for_each_triangle;
use crate::math::{Bounds3, Horizon, Vec3};
use rayon::prelude::*;
use std::collections::HashMap;

/// Maximum number of triangles of a scene. The parts of larger scenes are not found.
const MAX_TRIANGLES: u64 = 1 << 18;
/// Maximum number of parts whose contact with other parts is tested, evenly spread over all parts.
const MAX_PARTS: usize = 512;
/// Maximum number of vertices of a part whose contact is tested. They are the lowest vertices.
const MAX_FEET: usize = 8;
/// Minimum fraction of the scene's extent along two axes for a part that is the hull of the scene:
/// its walls, or its ground.
const HULL: f32 = 0.8;
/// Maximum distance of touching parts, in diagonals of the scene.
const TOUCH: f32 = 1.5e-3;
/// Minimum cosine between up and the normal of a surface that faces up.
const FACES_UP: f32 = 0.9;
/// Maximum distance of the floor and the wall of a backdrop from the sides of its box, as a
/// fraction of its extent.
const AT_SIDE: f32 = 0.1;
/// Minimum fraction of a backdrop's area that its floor and its wall have. The round edge between
/// them has the rest.
const FLAT_SHARE: f32 = 0.6;
/// Limits of a backdrop's area, as fractions of the area of the floor and one wall of its box: a
/// round edge makes it smaller, and a solid bracket has two layers.
const LAYER: [f32; 2] = [0.7, 1.2];
/// Maximum number of surfaces of the tested part that a ray may hit before it hits another part.
const MAX_OWN: u32 = 3;

/// Connected components of a scene.
pub(super) struct SceneParts<'a> {
    tracer: &'a SceneTracer<'a>,
    bounds: Bounds3,
    parts: Vec<Vec<Vec3>>,
    /// Index of the part of each triangle. The key is the number that identifies the triangle.
    of_triangles: HashMap<u64, u32>,
}

impl<'a> SceneParts<'a> {
    /// Parts of the scene of `tracer`; empty for a scene with many triangles.
    pub fn of(tracer: &'a SceneTracer) -> Self {
        let bounds = tracer.region.bounds;
        let mut parts = Self {
            tracer,
            bounds,
            parts: Vec::new(),
            of_triangles: HashMap::new(),
        };
        if tracer.scene.placed_triangle_count() <= MAX_TRIANGLES {
            parts.find();
        }
        parts
    }

    /// Joins triangles that share a corner.
    fn find(&mut self) {
        let mut vertices: HashMap<[u32; 3], u32> = HashMap::new();
        let mut positions: Vec<Vec3> = Vec::new();
        let mut joined = DisjointSets::default();
        let mut first_vertices: Vec<(u64, u32)> = Vec::new();
        for_each_triangle(self.tracer.scene, MAX_TRIANGLES, |triangle| {
            let [a, b, c] = triangle.corners.map(|p| {
                // Adding 0 turns −0 into 0.
                let bits = (p + Vec3::ZERO).to_array().map(f32::to_bits);
                *vertices.entry(bits).or_insert_with(|| {
                    positions.push(p);
                    joined.add()
                })
            });
            joined.join(a, b);
            joined.join(a, c);
            first_vertices.push((triangle.name, a));
        });
        let mut numbers: HashMap<u32, u32> = HashMap::new();
        for (vertex, &p) in (0..).zip(&positions) {
            let count = numbers.len() as u32;
            let number = *numbers.entry(joined.find(vertex)).or_insert(count);
            if number == count {
                self.parts.push(Vec::new());
            }
            self.parts[number as usize].push(p);
        }
        let number = |(name, vertex): (u64, u32)| (name, numbers[&joined.find(vertex)]);
        self.of_triangles = first_vertices.into_iter().map(number).collect();
    }

    /// Box of each part, and its number of corners.
    pub fn boxes(&self) -> Vec<(Bounds3, usize)> {
        let boxes = self
            .parts
            .iter()
            .map(|part| (part.iter().copied().collect(), part.len()));
        boxes.collect()
    }

    /// Horizontal unit vector away from the wall of a backdrop; `None` if part `number` with the
    /// upright box `bounds` is no backdrop. A backdrop is a single layer that consists of a floor
    /// at the bottom of its box and a wall at one side of the box, perhaps with a round edge
    /// between them.
    pub fn open_side_of_backdrop(&self, number: usize, bounds: Bounds3, horizon: &Horizon) -> Option<Vec3> {
        let size = bounds.max - bounds.min;
        let sides = [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z];
        let (mut all, mut floor, mut walls) = (0.0, 0.0, [0.0f32; 4]);
        for_each_triangle(self.tracer.scene, MAX_TRIANGLES, |triangle| {
            if self.of_triangles.get(&triangle.name) != Some(&(number as u32)) {
                return;
            }
            let [a, b, c] = triangle.corners.map(|p| horizon.coordinates(p));
            let (normal, middle) = (horizon.coordinates(triangle.normal), (a + b + c) / 3.0);
            let area = triangle.area as f32;
            all += area;
            if normal.y.abs() > FACES_UP && middle.y - bounds.min.y <= AT_SIDE * size.y {
                floor += area;
            }
            for (wall, side) in walls.iter_mut().zip(sides) {
                let end = if side.element_sum() > 0.0 {
                    bounds.max
                } else {
                    bounds.min
                };
                let is_near = ((middle - end) * side).element_sum().abs() <= AT_SIDE * (size * side).length();
                *wall += if is_near && normal.dot(side).abs() > FACES_UP {
                    area
                } else {
                    0.0
                };
            }
        });
        let (side, wall) = sides.into_iter().zip(walls).max_by(|a, b| a.1.total_cmp(&b.1))?;
        let width = size.x + size.z - (size * side).length();
        let layer = size.x * size.z + size.y * width;
        let is_layer = (LAYER[0] * layer..LAYER[1] * layer).contains(&all);
        let is_backdrop = is_layer && floor > 0.0 && wall > 0.0 && floor + wall >= FLAT_SHARE * all;
        is_backdrop.then(|| -horizon.point(side))
    }

    /// Returns true if a part belongs to the hull of the scene, such as its walls or its ground.
    fn is_hull(&self, part: &[Vec3]) -> bool {
        let bounds: Bounds3 = part.iter().copied().collect();
        let (size, whole) = (bounds.max - bounds.min, self.bounds.max - self.bounds.min);
        (0..3).filter(|&axis| size[axis] >= HULL * whole[axis]).count() >= 2
    }

    /// Stability of the parts for each direction of `ups`, in which each direction is followed by
    /// its opposite: weighted number of parts that rest on something below and touch nothing above,
    /// divided by the number of parts. The weight depends on the shape of a part. Zeros if there
    /// are few parts.
    pub fn standing(&self, ups: &[Vec3; 6]) -> [f32; 6] {
        const FEW: usize = 3;
        let parts: Vec<(u32, &[Vec3])> = (0..)
            .zip(&self.parts)
            .map(|(number, part)| (number, part.as_slice()))
            .filter(|(_, part)| !self.is_hull(part))
            .collect();
        if parts.len() < FEW {
            return [0.0; 6];
        }
        let stride = parts.len().div_ceil(MAX_PARTS);
        let tried: Vec<_> = parts.into_iter().step_by(stride).collect();
        let rest = tried
            .par_iter()
            .map(|&(number, part)| ups.map(|up| self.rests(number, part, up)));
        let rest: Vec<[bool; 6]> = rest.collect();
        std::array::from_fn(|i| {
            let stands = rest.iter().map(|rests| rests[i] && !rests[i ^ 1]);
            let weights = stands
                .zip(&tried)
                .map(|(stands, (_, part))| if stands { weight(part, ups[i]) } else { 0.0 });
            weights.sum::<f32>() / tried.len() as f32
        })
    }

    /// Returns true if any of the lowest vertices of a part touches the ground or another part
    /// below.
    fn rests(&self, number: u32, part: &[Vec3], up: Vec3) -> bool {
        let touch = TOUCH * 2.0 * self.bounds.radius();
        let height = |p: &Vec3| p.dot(up);
        let lowest = part.iter().map(height).fold(f32::INFINITY, f32::min);
        let ground = self.bounds.corners().iter().map(height).fold(f32::INFINITY, f32::min);
        if lowest <= ground + touch {
            return true;
        }
        let feet: Vec<Vec3> = part.iter().copied().filter(|p| height(p) <= lowest + touch).collect();
        let stride = feet.len().div_ceil(MAX_FEET);
        feet.iter()
            .step_by(stride)
            .any(|&foot| self.touches(number, foot, up, touch))
    }

    /// Returns true if another part lies within `touch` of the point `foot` and faces up.
    fn touches(&self, number: u32, foot: Vec3, up: Vec3, touch: f32) -> bool {
        let mut way = 0.0;
        for _ in 0..=MAX_OWN {
            let Some(seen) = self.tracer.trace(foot + (touch - way) * up, -up) else {
                return false;
            };
            way += seen.distance;
            if way > 2.0 * touch {
                return false;
            }
            if self.of_triangles.get(&seen.triangle) != Some(&number) {
                return seen.normal.dot(up) > FACES_UP;
            }
            way += 0.01 * touch;
        }
        false
    }
}

/// Weight of a part that rests on something, from 0 to 1, by its shape. A compact part such as a
/// chair has a high weight. Sheets and poles have low weights: sheets also hang on walls, and poles
/// lean at any angle.
fn weight(part: &[Vec3], up: Vec3) -> f32 {
    let bounds: Bounds3 = part.iter().copied().collect();
    let size = bounds.max - bounds.min;
    let axis = up.abs().max_position();
    let across = [size[(axis + 1) % 3], size[(axis + 2) % 3]];
    let (narrow, wide) = (across[0].min(across[1]), across[0].max(across[1]));
    let height = size[axis].max(f32::MIN_POSITIVE);
    (narrow / height).min(height / wide.max(f32::MIN_POSITIVE)).min(1.0)
}

/// Disjoint sets of numbers (union-find with path halving).
#[derive(Default)]
struct DisjointSets(Vec<u32>);

impl DisjointSets {
    fn add(&mut self) -> u32 {
        let number = self.0.len() as u32;
        self.0.push(number);
        number
    }

    /// Representative of the set of `i`.
    fn find(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            let above = self.0[self.0[i as usize] as usize];
            self.0[i as usize] = above;
            i = above;
        }
        i
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}
