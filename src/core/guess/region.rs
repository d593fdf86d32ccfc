//! The region that contains most of a scene. Without it, a few triangles far away would shrink the
//! rest of the scene to a point in the image.
//!
//! Some files mix places: a part in the metres of a national grid and a part at the origin, or a
//! stray vertex from an exporter. The coordinates of the triangles' corners are compared along each
//! axis. Strays are separated from the rest by empty gaps that are wide compared to the extent of
//! the corners on one side of the gap. Extents are measured on the middle 90 % of the corners. A
//! scene of any shape without wide gaps is one region.

use super::triangles::for_each_triangle;
use crate::math::{Bounds3, Vec3};
use crate::scene::Scene;

/// Maximum number of triangles, evenly spread over the scene, whose corners are used to find
/// places.
const SAMPLES: u64 = 1 << 13;
/// Maximum number of triangles among which strays are found.
const MAX_TRIANGLES: u64 = 1 << 23;
/// Minimum number of corners for a search of places.
const MIN_CORNERS: usize = 30;
/// Maximum number of places that are left out.
const MAX_PLACES: usize = 8;
/// Fraction of the corners that are left out at each end when an extent is measured.
const TAIL: f32 = 0.05;
/// Minimum gap between two places, as a multiple of the extent of the larger place.
const PLACE_GAP: f32 = 50.0;
/// Minimum gap between two places, as a fraction of the scene's extent.
const MIN_GAP: f32 = 0.05;
/// Minimum gap before strays, as a multiple of the extent of the corners before the gap. At most
/// the fraction [`TAIL`] of the corners are strays.
const STRAY_GAP: f32 = 8.0;
/// Minimum gap on each side of a region, if corners lie beyond both sides: these corners may belong
/// to a ground or a dome around the region.
const SURROUNDING_GAP: f32 = 100.0;

/// Ground that reaches far beyond the objects on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum WideGround {
    /// Flat or low on all sides.
    Flat,
    /// The floor of a backdrop: a sheet that is bent upwards behind the objects. The unit vector
    /// points away from its wall.
    Backdrop(Vec3),
}

/// The part of a scene that guesses use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Region {
    /// Bounds of the triangles.
    pub bounds: Bounds3,
    /// Limits of the corners' coordinates; infinite if nothing lies beyond.
    limits: Bounds3,
    /// Number of triangles with a corner beyond the limits.
    pub left_out: u64,
    /// Middle of the corners beyond the limits.
    pub left_out_at: Vec3,
    /// Ground that reaches far beyond the bounds, if there is one.
    pub ground: Option<WideGround>,
    /// Fraction of the corners of all groups that lie in this region, if the region is one of
    /// several groups of parts.
    pub group: Option<f32>,
}

impl Region {
    /// The region that contains most of the scene.
    pub fn of(scene: &Scene) -> Self {
        let mut region = Self {
            bounds: scene.bounds(),
            limits: Bounds3 {
                min: Vec3::NEG_INFINITY,
                max: Vec3::INFINITY,
            },
            left_out: 0,
            left_out_at: Vec3::ZERO,
            ground: None,
            group: None,
        };
        let mut corners: Vec<Vec3> = Vec::new();
        for_each_triangle(scene, SAMPLES, |triangle| corners.extend(triangle.corners));
        if corners.len() < MIN_CORNERS {
            return region;
        }
        region.leave_places(&mut corners);
        region.leave_strays(scene, &corners);
        region.measure(scene);
        region
    }

    /// Region of a group of parts in `bounds`. The group has the fraction `share` of the corners of
    /// all groups.
    pub fn with_group(self, bounds: Bounds3, share: f32) -> Self {
        Self {
            bounds,
            group: Some(share),
            ..self
        }
    }

    /// Region of an object with the box `bounds`, which stands on a ground that reaches beyond the
    /// box.
    pub fn on_ground(self, bounds: Bounds3, ground: WideGround) -> Self {
        let margin = Vec3::splat(1e-4 * extent(&bounds));
        let limits = Bounds3 {
            min: self.limits.min.max(bounds.min - margin),
            max: self.limits.max.min(bounds.max + margin),
        };
        Self {
            bounds,
            limits,
            ground: Some(ground),
            ..self
        }
    }

    /// Returns true if all corners of a triangle lie in the region.
    pub fn contains(&self, corners: &[Vec3; 3]) -> bool {
        corners.iter().all(|&corner| self.has(corner))
    }

    fn has(&self, p: Vec3) -> bool {
        p.cmpge(self.limits.min).all() && p.cmple(self.limits.max).all()
    }

    /// Cuts off places with less than half of the corners.
    fn leave_places(&mut self, corners: &mut Vec<Vec3>) {
        for _ in 0..MAX_PLACES {
            let cut = (0..3).find_map(|axis| {
                let mut sorted: Vec<f32> = corners.iter().map(|p| p[axis]).collect();
                sorted.sort_unstable_by(f32::total_cmp);
                let gaps = (1..sorted.len()).map(|i| (sorted[i] - sorted[i - 1], i));
                let (gap, at) = gaps.max_by(|a, b| a.0.total_cmp(&b.0))?;
                if gap <= MIN_GAP * (sorted[sorted.len() - 1] - sorted[0]) {
                    return None;
                }
                let keeps_low = 2 * at > sorted.len();
                let middle = 0.5 * sorted[at - 1] + 0.5 * sorted[at];
                let rest = corners.iter().copied().filter(|p| (p[axis] < middle) == keeps_low);
                let extent = extent(&middle_bounds(&rest.collect::<Vec<_>>()));
                (2 * at != sorted.len() && gap > PLACE_GAP * extent && gap > 0.0).then_some((axis, middle, keeps_low))
            });
            let Some((axis, middle, keeps_low)) = cut else { return };
            self.cut(axis, middle, keeps_low);
            corners.retain(|&p| self.has(p));
        }
    }

    /// Cuts off the few corners beyond wide gaps around the middle of `corners`.
    fn leave_strays(&mut self, scene: &Scene, corners: &[Vec3]) {
        let core = middle_bounds(corners);
        let whole = extent(&scene.bounds());
        // If the scene is too small for a gap, skip the sorting.
        if whole <= (1.0 + STRAY_GAP) * extent(&core) {
            return;
        }
        let mut count = 0;
        let mut beyond: [[Vec<f32>; 2]; 3] = Default::default();
        for_each_triangle(scene, MAX_TRIANGLES, |triangle| {
            for p in triangle.corners.into_iter().filter(|&p| self.has(p)) {
                count += 1;
                for (axis, sides) in beyond.iter_mut().enumerate() {
                    if p[axis] < core.min[axis] {
                        sides[0].push(p[axis]);
                    } else if p[axis] > core.max[axis] {
                        sides[1].push(p[axis]);
                    }
                }
            }
        });
        for (axis, sides) in beyond.into_iter().enumerate() {
            let [low, high] = [(0, -1.0), (1, 1.0)].map(|(side, sign)| {
                let mut sorted: Vec<f32> = sides[side].iter().map(|x| sign * x).collect();
                sorted.sort_unstable_by(f32::total_cmp);
                let ends = [core.min[axis], core.max[axis]].map(|x| sign * x);
                let (start, mut last) = (ends[1 - side], ends[side]);
                for (i, &x) in sorted.iter().enumerate() {
                    let width = (x - last) / extent(&core).max(last - start);
                    if width > STRAY_GAP && (sorted.len() - i) as f32 <= TAIL * count as f32 {
                        return Some((sign * (0.5 * last + 0.5 * x), width));
                    }
                    last = x;
                }
                None
            });
            if let (Some((_, a)), Some((_, b))) = (low, high) {
                if a.min(b) < SURROUNDING_GAP {
                    continue;
                }
            }
            low.into_iter().for_each(|(middle, _)| self.cut(axis, middle, false));
            high.into_iter().for_each(|(middle, _)| self.cut(axis, middle, true));
        }
    }

    fn cut(&mut self, axis: usize, at: f32, keeps_low: bool) {
        if keeps_low {
            self.limits.max[axis] = self.limits.max[axis].min(at);
        } else {
            self.limits.min[axis] = self.limits.min[axis].max(at);
        }
    }

    /// Measures the parts of the scene within and beyond the limits.
    fn measure(&mut self, scene: &Scene) {
        if self.limits.min == Vec3::NEG_INFINITY && self.limits.max == Vec3::INFINITY {
            return;
        }
        let (mut bounds, mut outside) = (Bounds3::EMPTY, Bounds3::EMPTY);
        for_each_triangle(scene, MAX_TRIANGLES, |triangle| {
            if self.contains(&triangle.corners) {
                triangle.corners.iter().for_each(|&p| bounds.extend(p))
            } else {
                self.left_out += 1;
                let out = triangle.corners.iter().filter(|&&p| !self.has(p));
                out.for_each(|&p| outside.extend(p));
            }
        });
        if !bounds.is_empty() && !outside.is_empty() {
            (self.bounds, self.left_out_at) = (bounds, outside.center());
        }
    }
}

/// Bounds of the middle 90 % of the coordinates along each axis.
pub(super) fn middle_bounds(corners: &[Vec3]) -> Bounds3 {
    let mut bounds = Bounds3 {
        min: Vec3::ZERO,
        max: Vec3::ZERO,
    };
    let tail = (TAIL * corners.len() as f32) as usize;
    for axis in 0..3 {
        let mut sorted: Vec<f32> = corners.iter().map(|p| p[axis]).collect();
        sorted.sort_unstable_by(f32::total_cmp);
        if let (Some(&min), Some(&max)) = (sorted.get(tail), sorted.get(sorted.len().saturating_sub(1 + tail))) {
            (bounds.min[axis], bounds.max[axis]) = (min, max);
        }
    }
    bounds
}

/// Largest extent along an axis.
pub(super) fn extent(bounds: &Bounds3) -> f32 {
    (bounds.max - bounds.min).max_element().max(f32::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Mesh;
    use crate::material::Material;
    use crate::scene::SceneBuilder;

    /// A grid of `n` × `n` squares of side 1 around `center`.
    fn grid(n: u32, center: Vec3) -> Mesh {
        let corner = |i: u32| {
            let offset = 0.5 * n as f32;
            center
                + Vec3::new(
                    (i % (n + 1)) as f32 - offset,
                    0.1 * (i % 3) as f32,
                    (i / (n + 1)) as f32 - offset,
                )
        };
        let squares = (0..n * n).flat_map(|i| {
            let a = i / n * (n + 1) + i % n;
            [[a, a + n + 1, a + 1], [a + 1, a + n + 1, a + n + 2]]
        });
        Mesh {
            positions: (0..(n + 1) * (n + 1)).map(corner).collect(),
            triangles: squares.collect(),
            ..Mesh::default()
        }
    }

    fn region(meshes: impl IntoIterator<Item = Mesh>) -> Region {
        let mut b = SceneBuilder::new();
        let id = b.add_material(Material::default()).unwrap();
        meshes.into_iter().for_each(|mesh| b.add_mesh(mesh, id).unwrap());
        Region::of(&b.build().unwrap().0)
    }

    #[test]
    fn places_with_most_triangles_are_kept() {
        let far = Vec3::new(5e5, 0.0, 5e6);
        let found = region([grid(10, Vec3::ZERO), grid(8, far)]);
        assert_eq!(found.left_out, 128);
        assert!(found.left_out_at.distance(far) < 1.0, "{found:?}");
        assert!(found.bounds.max.abs().max_element() <= 5.0, "{found:?}");
        let found = region([grid(8, Vec3::ZERO), grid(10, far)]);
        assert_eq!(found.left_out, 128);
        assert!(found.bounds.center().distance(far) < 1.0, "{found:?}");
    }

    #[test]
    fn stray_corners_are_left_out_with_their_triangles() {
        let mut mesh = grid(20, Vec3::ZERO);
        let last = mesh.positions.len() - 1;
        mesh.positions[last] = Vec3::new(4000.0, -900.0, 30.0);
        mesh.positions[0] = Vec3::new(0.0, 700.0, 0.0);
        let found = region([mesh]);
        assert_eq!(found.left_out, 2);
        assert!(found.bounds.max.abs().max_element() <= 10.0, "{found:?}");
        assert!(found.bounds.min.abs().max_element() <= 10.0, "{found:?}");
    }

    #[test]
    fn scenes_without_strays_are_whole() {
        let tower = grid(3, Vec3::new(0.0, 60.0, 0.0));
        let floor = |half: f32| Mesh {
            positions: [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]]
                .map(|[x, z]| Vec3::new(half * x, 0.0, half * z))
                .to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        let row = (0..12).map(|i| grid(4, Vec3::new(1.5f32.powi(i) * 6.0, 0.0, 0.0)));
        for meshes in [
            vec![grid(10, Vec3::ZERO)],
            vec![grid(20, Vec3::ZERO), tower],
            // A ground around the object, and a row whose gaps grow
            vec![grid(10, Vec3::ZERO), floor(400.0)],
            row.collect(),
            vec![floor(1.0)],
        ] {
            let found = region(meshes);
            assert_eq!(found.left_out, 0, "{found:?}");
        }
        // A ground that is too large for any image
        assert_eq!(region([grid(10, Vec3::ZERO), floor(5000.0)]).left_out, 2);
    }
}
